// SPDX-License-Identifier: Apache-2.0
#include "core/models/heat.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/format_number.h"
#include "core/models/grid_operators.h"

namespace dlcs {
namespace {

// The groups of the surface, for messages: "wall", 7.
std::string SurfaceGroups(const Mesh& mesh, int dimension) {
  std::vector<std::string> found;
  const auto add = [&](std::string text) {
    if (std::find(found.begin(), found.end(), text) == found.end()) found.push_back(std::move(text));
  };
  for (const Mesh::Group& group : mesh.groups) {
    if (group.dimension == dimension) add("\"" + group.name + "\"");
  }
  for (const Mesh::Element& element : mesh.elements) {
    if (element.dimension != dimension) continue;
    for (const int tag : element.groups) {
      const bool is_named = std::any_of(mesh.groups.begin(), mesh.groups.end(), [&](const Mesh::Group& group) {
        return group.dimension == dimension && group.tag == tag;
      });
      if (!is_named) add(std::to_string(tag));
    }
  }
  if (found.empty()) return "it has none";
  std::string all = "it has ";
  for (std::size_t k = 0; k < found.size(); ++k) all += (k > 0 ? ", " : "") + found[k];
  return all;
}

// The share of the surface of `groups` that belongs to each node; zero elsewhere. What is wrong goes to `violations`.
Vector SurfaceOf(const Mesh& mesh, const std::vector<std::string>& groups, const std::string& field,
                 std::vector<Violation>& violations) {
  const int facet = mesh.dimension() - 1;
  Vector share = Vector::Zero(mesh.points.cols());
  for (const std::string& wanted : groups) {
    const auto is_wanted = [&](int tag) {
      if (wanted == std::to_string(tag)) return true;
      return std::any_of(mesh.groups.begin(), mesh.groups.end(), [&](const Mesh::Group& group) {
        return group.dimension == facet && group.tag == tag && group.name == wanted;
      });
    };
    bool found = false;
    for (const Mesh::Element& element : mesh.elements) {
      if (element.dimension != facet || std::none_of(element.groups.begin(), element.groups.end(), is_wanted)) continue;
      found = true;
      const double part = Measure(mesh, element) / (facet + 1);
      for (int k = 0; k <= facet; ++k) share[element.nodes[static_cast<std::size_t>(k)]] += part;
    }
    if (found) continue;
    const char* what = facet == 0 ? "points" : facet == 1 ? "lines" : "triangles";
    violations.push_back({field, "\"" + wanted + "\"; the mesh has no physical group of " + what +
                                     " with this name or number: " + SurfaceGroups(mesh, facet)});
  }
  return share;
}

void CheckMesh(const Mesh& mesh, std::vector<Violation>& violations) {
  constexpr double kFlat = 1e-12;
  const int d = mesh.dimension();
  if (d == 0) {
    violations.push_back({"mesh", "no lines, triangles or tetrahedra"});
    return;
  }
  for (const Mesh::Element& element : mesh.elements) {
    if (element.dimension != d) continue;
    double longest = 0;
    for (int i = 0; i <= d; ++i) {
      for (int j = 0; j < i; ++j) {
        longest = std::max(longest, (mesh.points.col(element.nodes[static_cast<std::size_t>(i)]) -
                                     mesh.points.col(element.nodes[static_cast<std::size_t>(j)]))
                                        .norm());
      }
    }
    const double measure = Measure(mesh, element);
    if (measure > kFlat * std::pow(longest, d)) continue;
    violations.push_back({"mesh", "element " + std::to_string(element.number) + " is flat: " +
                                      (d == 1   ? "length "
                                       : d == 2 ? "area "
                                                : "volume ") +
                                      FormatNumber(measure)});
    return;
  }
}

}  // namespace

absl::StatusOr<HeatProblem> MakeHeatProblem(const HeatModel& model) {
  const Mesh& mesh = model.mesh;
  std::vector<Violation> violations;
  CheckPositive("coefficient", model.coefficient, violations);
  CheckPositive("horizon", model.horizon, violations);
  CheckMesh(mesh, violations);
  if (model.contact.empty()) violations.push_back({"contact", "missing; must name a physical group of the surface"});
  Vector contact, fixed;
  if (mesh.dimension() > 0) {
    contact = SurfaceOf(mesh, model.contact, "contact", violations);
    fixed = SurfaceOf(mesh, model.fixed, "fixed", violations);
  }
  if (const absl::Status status = StatusOf(violations); !status.ok()) return status;

  const FiniteElements elements = Assemble(mesh);
  std::vector<Index> state(static_cast<std::size_t>(mesh.points.cols()), -1);
  std::vector<Index> nodes, pairs;  // the node of each state, and the state of each pair
  for (Index node = 0; node < mesh.points.cols(); ++node) {
    if (elements.loads[node] == 0 || fixed[node] > 0) continue;  // in no element of the body, or known
    state[static_cast<std::size_t>(node)] = static_cast<Index>(nodes.size());
    if (contact[node] > 0) pairs.push_back(static_cast<Index>(nodes.size()));
    nodes.push_back(node);
  }
  if (pairs.empty()) {
    return StatusOf(std::vector<Violation>{{"contact", "all of its nodes are fixed; at least one must be free"}});
  }
  const auto m = static_cast<Index>(nodes.size()), n = static_cast<Index>(pairs.size());
  const auto of_states = [&](const SparseMatrix& of_nodes, double factor) {
    std::vector<Eigen::Triplet<double>> entries;
    for (Index j = 0; j < of_nodes.outerSize(); ++j) {
      for (SparseMatrix::InnerIterator entry(of_nodes, j); entry; ++entry) {
        const Index row = state[static_cast<std::size_t>(entry.row())], column = state[static_cast<std::size_t>(j)];
        if (row >= 0 && column >= 0) entries.emplace_back(row, column, factor * entry.value());
      }
    }
    SparseMatrix matrix(m, m);
    matrix.setFromTriplets(entries.begin(), entries.end());
    return matrix;
  };

  HeatProblem made;
  Problem& problem = made.problem;
  problem.A = of_states(elements.stiffness, -model.coefficient);
  problem.E = of_states(elements.mass, 1);
  SparseMatrix B(m, n);
  for (Index i = 0; i < n; ++i) {
    const Index row = pairs[static_cast<std::size_t>(i)];
    B.insert(row, i) = model.coefficient * contact[nodes[static_cast<std::size_t>(row)]];
  }
  problem.B = B;
  problem.N = SparseMatrix(UnitColumns(m, pairs, 1).transpose());
  problem.M = SparseMatrix(n, n);
  problem.f = TimeFunction::Formulas({model.load});
  problem.f.lift = Matrix(elements.loads(nodes));
  problem.g = TimeFunction::Zero(n);
  problem.x0 = Vector::Zero(m);
  problem.horizon = model.horizon;
  for (const Index node : nodes) made.nodes.push_back(mesh.numbers[static_cast<std::size_t>(node)]);
  // Only the formula of the load can still be wrong.
  if (const absl::Status status = StatusOf(Validate(problem)); !status.ok()) return status;
  return made;
}

}  // namespace dlcs
