// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/operating_point.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/circuits/circuit_names.h"
#include "core/circuits/first_branch.h"
#include "core/circuits/linear_network.h"
#include "core/circuits/solution_blocks.h"
#include "core/format_number.h"
#include "core/lcp/lcp.h"
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
  Vector q, q_size;  // the second: the sum of the sizes of its terms
  Vector sign;       // 1 where y is a current, -1 where it is a reverse voltage
  Matrix storage;    // storages × y
  Vector constant;   // storages
  BranchVoltages clamps;
};

RestProblem MakeRestProblem(const LinearNetwork& network, const CircuitBranches& graph, const Vector& given,
                            Index num_given) {
  const auto pairs = static_cast<Index>(graph.diodes.size()), storages = static_cast<Index>(graph.storages.size());
  RestProblem rest{Matrix::Zero(pairs, pairs),
                   Vector::Zero(pairs),
                   Vector::Zero(pairs),
                   Vector::Zero(pairs),
                   Matrix::Zero(storages, pairs),
                   Vector::Zero(storages),
                   {}};
  Vector& sign = rest.sign;
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
    rest.q_size[k] = row.cwiseAbs().dot(given.cwiseAbs().transpose());
    rest.M.row(k) = of_y;
  }
  for (Index k = 0; k < storages; ++k) {
    const StorageBranch& storage = graph.storages[AsSize(k)];
    const RowVector row = storage.is_capacitor ? network.Voltage(storage.branch) : network.Current(storage.branch);
    RowVector of_y(pairs);
    rest.constant[k] = split(row, of_y);
    rest.storage.row(k) = of_y;
  }
  MakeReciprocal(graph, sign, rest.M);
  // Given node voltages are held: their rows stay zero.
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

// What is zero but for rounding is zero.
Vector StorageAt(const RestProblem& rest, const Vector& y) {
  constexpr double kRounding = 1e-13;
  const Vector terms = rest.constant.cwiseAbs() + rest.storage.cwiseAbs() * y.cwiseAbs();
  Vector at = rest.constant + rest.storage * y;
  at = (at.array().abs() <= kRounding * terms.array()).select(0, at);
  return at;
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

std::string NoOperatingPoint(const CircuitBranches& graph, const Circuit& circuit) {
  return "there is no operating point at 0: no voltages and currents of " + NamesOfDiodes(graph, circuit) +
         " fit the sources at 0. A diode across a source, or against a current that has no other path, may be the "
         "reason";
}

// The start if M is of no class.
absl::StatusOr<Vector> StartAmongSeveral(const RestProblem& rest, const Circuit& circuit,
                                         const CircuitBranches& graph) {
  const std::string advice = "; give the start with IC= and UIC";
  const BlockSolutions found =
      SolveByBlocks(rest.M, rest.q, 1e-12 * rest.q_size, rest.storage, graph.clamps, rest.sign);
  if (found.open_row >= 0)
    return NotDetermined(circuit.elements[AsSize(graph.storages[AsSize(found.open_row)].element)]);
  if (!found.undecided.empty()) {
    return absl::InvalidArgumentError("the operating point at 0 may not be the only one: controlled sources act on " +
                                      ElementsOfPairs(found.undecided, circuit, graph) + advice);
  }
  if (found.all.empty()) return absl::InvalidArgumentError(NoOperatingPoint(graph, circuit));
  const std::vector<Index> starts = PossibleStarts(found.all, rest.clamps, circuit, graph);
  const auto storages = [&](Index k) -> Vector { return rest.storage * found.all[AsSize(k)].y; };
  const Vector first = storages(starts.front());
  const double size = 1e-9 * (first.cwiseAbs() + rest.constant.cwiseAbs()).sum();
  for (const Index k : starts) {
    if ((storages(k) - first).cwiseAbs().sum() <= size) continue;
    return absl::InvalidArgumentError("there are several operating points at 0, which differ in " +
                                      ElementsThatDiffer(found.all, starts, rest.clamps, circuit, graph) + advice);
  }
  return StorageAt(rest, found.all[AsSize(starts.front())].y);
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
  if (!matrix_class.p.yes() && !semidefinite) return StartAmongSeveral(rest, circuit, graph);
  const auto solved = SolveLcp(rest.M, rest.q, matrix_class.p.yes() ? SolutionRule::kUnique : SolutionRule::kLeastNorm);
  if (!solved.ok()) return solved.status();
  if (solved->verdict != LcpStatus::kSolved) return absl::InvalidArgumentError(NoOperatingPoint(graph, circuit));
  const Vector start = StorageAt(rest, solved->y);
  if (matrix_class.p.yes() || rest.storage.isZero(0)) return start;
  const Index open = FirstOpenRow(rest.M, rest.q, rest.storage, solved->y);
  if (open >= 0) return NotDetermined(circuit.elements[AsSize(graph.storages[AsSize(open)].element)]);
  if (open < -1) {
    return absl::InvalidArgumentError(
        "could not decide whether the operating point at 0 is the only one; give the "
        "start with IC= and UIC");
  }
  return start;
}

}  // namespace dlcs
