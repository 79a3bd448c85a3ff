// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/operating_point.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/circuits/circuit_names.h"
#include "core/circuits/first_branch.h"
#include "core/circuits/linear_network.h"
#include "core/format_number.h"
#include "core/lcp/lcp.h"
#include "core/linalg/linear_program.h"
#include "core/matrix_classes/matrix_class.h"

namespace dlcs {
namespace {

using RowVector = Eigen::RowVectorXd;

// The circuit at rest. Branches beyond those of the graph hold node voltages.
std::vector<Branch> BranchesAtRest(const Circuit& circuit, const CircuitBranches& graph) {
  std::vector<Branch> branches = graph.branches;
  for (const StorageBranch& storage : graph.storages) {
    Branch& branch = branches[AsSize(storage.branch)];
    branch.role = storage.is_capacitor ? BranchRole::kCurrent : BranchRole::kVoltage;
    branch.order = storage.is_capacitor ? kLastOrder + 1 : kSourceOrder;
  }
  for (const NodeVoltage& given : circuit.node_voltages) {
    branches.push_back({.plus = given.node, .minus = 0, .role = BranchRole::kVoltage, .order = kSourceOrder});
  }
  return branches;
}

absl::Status StatusOfRest(NetworkFault fault, const CircuitBranches& graph, const Circuit& circuit) {
  const auto known = static_cast<Index>(graph.branches.size());
  for (const Index branch : fault.branches) {
    if (branch < known) continue;
    const NodeVoltage& given = circuit.node_voltages[AsSize(branch - known)];
    std::vector<Index> others;
    std::copy_if(fault.branches.begin(), fault.branches.end(), std::back_inserter(others),
                 [known](Index b) { return b < known; });
    return absl::InvalidArgumentError(".ic V(" + circuit.nodes[AsSize(given.node)] +
                                      ") = " + FormatNumber(given.volts) + " cannot be held at the start: " +
                                      (others.empty() ? std::string("the node has another .ic")
                                                      : ElementsOf(others, graph, circuit) + " set this voltage too"));
  }
  return StatusOfFault(fault, graph, circuit, /*at_start=*/true);
}

// q, M and what the storages are, as functions of y.
struct RestProblem {
  Matrix M;
  Vector q;
  Matrix storage;   // storages × y
  Vector constant;  // storages
  BranchVoltages clamps;
};

RestProblem MakeRestProblem(const LinearNetwork& network, const CircuitBranches& graph, const Vector& given,
                            Index num_given) {
  const auto pairs = static_cast<Index>(graph.diodes.size()), storages = static_cast<Index>(graph.storages.size());
  RestProblem rest{
      Matrix::Zero(pairs, pairs), Vector::Zero(pairs), Matrix::Zero(storages, pairs), Vector::Zero(storages), {}};
  Vector sign(pairs);
  std::vector<Index> input(AsSize(pairs));
  for (Index k = 0; k < pairs; ++k) {
    const Index branch = graph.diodes[AsSize(k)].branch;
    sign[k] = network.InTree(branch) ? -1 : 1;  // a voltage-driven diode has y = -v
    input[AsSize(k)] = network.InputOf(branch);
  }
  const auto split = [&](const RowVector& row, Eigen::Ref<RowVector> of_y) {
    for (Index k = 0; k < pairs; ++k) of_y[k] = sign[k] * row[input[AsSize(k)]];
    return row.dot(given.transpose());
  };
  for (Index k = 0; k < pairs; ++k) {
    const Index branch = graph.diodes[AsSize(k)].branch;
    const RowVector row = network.InTree(branch) ? network.Current(branch) : RowVector(-network.Voltage(branch));
    RowVector of_y(pairs);
    rest.q[k] = split(row, of_y);
    rest.M.row(k) = of_y;
  }
  for (Index k = 0; k < storages; ++k) {
    const StorageBranch& storage = graph.storages[AsSize(k)];
    const RowVector row = storage.is_capacitor ? network.Voltage(storage.branch) : network.Current(storage.branch);
    RowVector of_y(pairs);
    rest.constant[k] = split(row, of_y);
    rest.storage.row(k) = of_y;
  }
  // Given node voltages are held, and tell nothing.
  const auto clamps = static_cast<Index>(graph.clamps.size());
  rest.clamps.of_y = Matrix::Zero(clamps + num_given, pairs);
  rest.clamps.constant = Vector::Zero(clamps + num_given);
  for (Index k = 0; k < clamps; ++k) {
    RowVector of_y(pairs);
    rest.clamps.constant[k] = split(network.Potential(graph.clamps[AsSize(k)].node), of_y);
    rest.clamps.of_y.row(k) = of_y;
  }
  return rest;
}

// The smallest and the largest value of each storage over all solutions, for a positive semidefinite M: with one of
// them, y*, the others are { y >= 0, q + M y >= 0, (M + Mᵀ)(y - y*) = 0, qᵀ(y - y*) = 0 } ([Cottle 1992], Theorem
// 3.1.7). Returns the first storage for which they differ, -1 if there is none, -2 if a program failed.
Index FirstUndetermined(const RestProblem& rest, const Vector& y) {
  const Index pairs = y.size();
  Vector unit(pairs);  // of y: M then has entries of a moderate size
  for (Index k = 0; k < pairs; ++k) unit[k] = rest.M(k, k) > 0 ? 1 / std::sqrt(rest.M(k, k)) : 1;
  const Matrix M = unit.asDiagonal() * rest.M * unit.asDiagonal();
  const Vector q = unit.cwiseProduct(rest.q), at = y.cwiseQuotient(unit);
  const double size = std::max({1e-300, q.cwiseAbs().maxCoeff(), at.cwiseAbs().maxCoeff()});

  LinearProgram program = MakeLinearProgram(2 * pairs + 1, pairs);
  const Vector z = at / size, scaled_q = q / size;
  program.rows.topRows(pairs) = M;
  program.row_lower.head(pairs) = -scaled_q;
  program.rows.middleRows(pairs, pairs) = M + M.transpose();
  program.row_lower.segment(pairs, pairs) = program.row_upper.segment(pairs, pairs) = (M + M.transpose()) * z;
  program.rows.row(2 * pairs) = scaled_q.transpose();
  program.row_lower[2 * pairs] = program.row_upper[2 * pairs] = scaled_q.dot(z);
  for (Index s = 0; s < rest.storage.rows(); ++s) {
    RowVector row = rest.storage.row(s) * unit.asDiagonal();
    const double largest = row.cwiseAbs().maxCoeff();
    if (largest == 0) continue;
    row /= largest;
    for (const double sign : {1.0, -1.0}) {
      program.cost = sign * row.transpose();
      const LinearProgramSolution solution = SolveLinearProgram(program);
      if (solution.verdict == LinearProgramVerdict::kUnboundedBelow) return s;
      if (solution.verdict != LinearProgramVerdict::kOptimal) return -2;
      constexpr double kSame = 1e-6;  // beside the tolerances of the program
      if (std::abs(solution.objective - sign * row.dot(z.transpose())) > kSame * (1 + z.cwiseAbs().maxCoeff()))
        return s;
    }
  }
  return -1;
}

std::string NamesOfDiodes(const CircuitBranches& graph, const Circuit& circuit) {
  std::vector<Index> branches;
  for (const DiodeBranch& diode : graph.diodes) branches.push_back(diode.branch);
  return ElementsOf(branches, graph, circuit);
}

absl::Status NotDetermined(const Element& element) {
  const bool is_capacitor = element.kind == ElementKind::kCapacitor;
  return absl::InvalidArgumentError(std::string("the operating point at 0 does not determine the ") +
                                    (is_capacitor ? "voltage" : "current") + " of " + WithPlace(element) +
                                    ": diodes allow several values; give the start with " +
                                    (is_capacitor ? ".ic V(node)=..., or with IC= and UIC" : "IC= and UIC"));
}

// The start if M is of no class.
absl::StatusOr<Vector> StartAmongSeveral(const RestProblem& rest, const LcpResult& solved, const Circuit& circuit,
                                         const CircuitBranches& graph) {
  const std::string advice = "; give the start with IC= and UIC";
  const auto& solutions = solved.basic_solutions;
  if (!solutions || !solutions->complete || !solutions->faces.empty() || solutions->solutions.empty()) {
    return absl::InvalidArgumentError("the operating point at 0 may not be the only one: controlled sources act on " +
                                      NamesOfDiodes(graph, circuit) + advice);
  }
  const std::vector<Index> starts = PossibleStarts(*solutions, rest.clamps, circuit, graph);
  const auto storages = [&](Index k) -> Vector { return rest.storage * solutions->solutions[AsSize(k)].y; };
  const Vector first = storages(starts.front());
  const double size = 1e-9 * (first.cwiseAbs() + rest.constant.cwiseAbs()).sum();
  for (const Index k : starts) {
    if ((storages(k) - first).cwiseAbs().sum() <= size) continue;
    return absl::InvalidArgumentError("there are several operating points at 0, which differ in " +
                                      ElementsThatDiffer(*solutions, starts, rest.clamps, circuit, graph) + advice);
  }
  return Vector(rest.constant + first);
}

}  // namespace

absl::StatusOr<Vector> FindOperatingPoint(const Circuit& circuit, const CircuitBranches& graph,
                                          const Vector& source_values) {
  auto made = LinearNetwork::Create(graph.nodes, BranchesAtRest(circuit, graph));
  if (auto* fault = std::get_if<NetworkFault>(&made)) return StatusOfRest(std::move(*fault), graph, circuit);
  const LinearNetwork& network = std::get<LinearNetwork>(made);

  Vector given = Vector::Zero(network.num_inputs());
  for (std::size_t s = 0; s < graph.sources.size(); ++s) {
    given[network.InputOf(graph.sources[s].branch)] = source_values[static_cast<Index>(s)];
  }
  for (std::size_t k = 0; k < circuit.node_voltages.size(); ++k) {
    given[network.InputOf(static_cast<Index>(graph.branches.size() + k))] = circuit.node_voltages[k].volts;
  }
  const RestProblem rest = MakeRestProblem(network, graph, given, static_cast<Index>(circuit.node_voltages.size()));
  if (rest.q.size() == 0) return rest.constant;

  const MatrixClass matrix_class = Classify(rest.M);
  const bool semidefinite = matrix_class.positive_semidefinite.yes();
  LcpRequest request;
  if (!matrix_class.p.yes()) {
    request.rule = semidefinite ? SolutionRule::kLeastNorm : SolutionRule::kAuto;
    request.all_basic_solutions = !semidefinite && rest.q.size() <= kMaxBasicSolutionsSize;
  }
  const auto solved = SolveLcp(rest.M, rest.q, request);
  if (!solved.ok()) return solved.status();
  if (solved->verdict != LcpStatus::kSolved) {
    return absl::InvalidArgumentError("there is no operating point at 0: no voltages and currents of " +
                                      NamesOfDiodes(graph, circuit) + " fit the sources at 0");
  }
  const Vector start = rest.constant + rest.storage * solved->y;
  if (matrix_class.p.yes() || rest.storage.isZero(0)) return start;
  if (!semidefinite) return StartAmongSeveral(rest, *solved, circuit, graph);
  const Index open = FirstUndetermined(rest, solved->y);
  if (open >= 0) return NotDetermined(circuit.elements[AsSize(graph.storages[AsSize(open)].element)]);
  if (open < -1) {
    return absl::InvalidArgumentError(
        "could not decide whether the operating point at 0 is the only one; give the "
        "start with IC= and UIC");
  }
  return start;
}

}  // namespace dlcs
