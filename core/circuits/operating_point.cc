// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/operating_point.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/circuits/circuit_names.h"
#include "core/circuits/first_branch.h"
#include "core/circuits/linear_network.h"
#include "core/circuits/solution_blocks.h"
#include "core/format_number.h"
#include "core/lcp/basis/tolerance.h"
#include "core/lcp/lcp.h"
#include "core/linalg/bounded_sum.h"
#include "core/matrix_classes/matrix_class.h"

namespace dlcs {
namespace {

using RowVector = Eigen::RowVectorXd;

// The circuit at rest. Branches beyond those of the graph hold those node voltages of the circuit that are `held`.
std::vector<Branch> BranchesAtRest(const Circuit& circuit, const CircuitBranches& graph,
                                   const std::vector<Index>& held) {
  std::vector<Branch> branches = graph.branches;
  for (const StorageBranch& storage : graph.storages) {
    Branch& branch = branches[AsSize(storage.branch)];
    branch.role = storage.is_capacitor ? BranchRole::kCurrent : BranchRole::kVoltage;
    branch.order = storage.is_capacitor ? kLastOrder + 1 : kSourceOrder;
  }
  for (const Index k : held) {
    branches.push_back({.plus = circuit.node_voltages[AsSize(k)].node,
                        .minus = 0,
                        .role = BranchRole::kVoltage,
                        .order = kSourceOrder});
  }
  return branches;
}

absl::Status StatusOfRest(const NetworkFault& fault, const CircuitBranches& graph, const Circuit& circuit,
                          const std::vector<Index>& held) {
  const auto known = static_cast<Index>(graph.branches.size());
  for (const Index branch : fault.branches) {
    if (branch < known) continue;
    const NodeVoltage& given = circuit.node_voltages[AsSize(held[AsSize(branch - known)])];
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

// A voltage that is given where a controlled source sets it: it chooses among several solutions, and is held by none.
struct FreeVoltage {
  Index given = 0;      // of `node_voltages`
  absl::Status misses;  // if no solution has it
};

// The circuit at rest with the node voltages that can be held.
struct RestNetwork {
  LinearNetwork network;
  std::vector<Index> held;  // of `node_voltages`, in the order of their branches
  std::vector<FreeVoltage> free;
};

absl::StatusOr<RestNetwork> MakeRestNetwork(const Circuit& circuit, const CircuitBranches& graph) {
  const auto known = static_cast<Index>(graph.branches.size());
  std::vector<Index> held(circuit.node_voltages.size());
  std::iota(held.begin(), held.end(), Index{0});
  std::vector<FreeVoltage> free;
  for (;;) {
    auto made = LinearNetwork::Create(graph.nodes, BranchesAtRest(circuit, graph, held));
    if (auto* network = std::get_if<LinearNetwork>(&made)) return RestNetwork{std::move(*network), held, free};
    const auto& fault = std::get<NetworkFault>(made);
    const absl::Status status = StatusOfRest(fault, graph, circuit, held);
    const auto given = std::find_if(fault.branches.begin(), fault.branches.end(), [&](Index b) { return b >= known; });
    const bool is_controlled = std::any_of(fault.branches.begin(), fault.branches.end(), [&](Index b) {
      return b < known && graph.branches[AsSize(b)].role == BranchRole::kControlledVoltage;
    });
    if (fault.kind != NetworkFault::Kind::kVoltageLoop || given == fault.branches.end() || !is_controlled)
      return status;
    const auto released = held.begin() + (*given - known);
    free.push_back({*released, status});
    held.erase(released);
  }
}

// q, M and what the storages are, as functions of y.
struct RestProblem {
  Matrix M;
  Vector q, q_size;  // the second: the sum of the sizes of its terms
  Vector sign;       // 1 where y is a current, -1 where it is a reverse voltage
  Matrix storage;    // storages × y
  Vector constant;   // storages
  BranchVoltages clamps;
  BranchVoltages blocking;  // across the elements that may block: diodes and switches
};

RestProblem MakeRestProblem(const RestNetwork& at_rest, const Circuit& circuit, const CircuitBranches& graph,
                            const Vector& given) {
  const LinearNetwork& network = at_rest.network;
  const auto pairs = static_cast<Index>(graph.diodes.size()), storages = static_cast<Index>(graph.storages.size());
  RestProblem rest{Matrix::Zero(pairs, pairs),
                   Vector::Zero(pairs),
                   Vector::Zero(pairs),
                   Vector::Zero(pairs),
                   Matrix::Zero(storages, pairs),
                   Vector::Zero(storages),
                   {},
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
  // The rows of node voltages that are held stay zero.
  const auto clamps = static_cast<Index>(graph.clamps.size());
  const Index voltages = clamps + static_cast<Index>(circuit.node_voltages.size());
  rest.clamps.of_y = Matrix::Zero(voltages, pairs);
  rest.clamps.constant = Vector::Zero(voltages);
  const auto set_potential = [&](Index row, Index node) {
    RowVector of_y(pairs);
    rest.clamps.constant[row] = split(network.Potential(node), of_y);
    rest.clamps.of_y.row(row) = of_y;
  };
  for (Index k = 0; k < clamps; ++k) set_potential(k, graph.clamps[AsSize(k)].node);
  for (const FreeVoltage& free : at_rest.free) {
    set_potential(clamps + free.given, circuit.node_voltages[AsSize(free.given)].node);
  }
  std::vector<Index> may_block;
  for (Index e = 0; e < static_cast<Index>(circuit.elements.size()); ++e) {
    if (MayBlock(circuit.elements[AsSize(e)])) may_block.push_back(e);
  }
  rest.blocking.of_y = Matrix::Zero(static_cast<Index>(may_block.size()), pairs);
  rest.blocking.constant = Vector::Zero(static_cast<Index>(may_block.size()));
  for (Index k = 0; k < rest.blocking.constant.size(); ++k) {
    const Element& element = circuit.elements[AsSize(may_block[AsSize(k)])];
    RowVector of_y(pairs);
    rest.blocking.constant[k] = split(network.Potential(element.plus) - network.Potential(element.minus), of_y);
    rest.blocking.of_y.row(k) = of_y;
  }
  return rest;
}

// The first of the free voltages that `y` does not have.
absl::Status MissedVoltage(const RestNetwork& at_rest, const RestProblem& rest, const Circuit& circuit,
                           const CircuitBranches& graph, const Vector& y) {
  constexpr double kSame = 1e-3;
  for (const FreeVoltage& free : at_rest.free) {
    const Index row = static_cast<Index>(graph.clamps.size()) + free.given;
    const double volts = rest.clamps.constant[row] + rest.clamps.of_y.row(row).dot(y);
    const double wanted = circuit.node_voltages[AsSize(free.given)].volts;
    if (std::abs(volts - wanted) > kSame * (kSame + std::abs(volts) + std::abs(wanted))) return free.misses;
  }
  return absl::OkStatus();
}

// What is zero but for rounding is zero.
Vector StorageAt(const RestProblem& rest, const Vector& y) {
  return BoundedProduct(rest.storage, y, rest.constant).WithoutRounding(kLcpTolerance);
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

// Of all solutions of a positive semidefinite problem that with the least sum of squares of blocking voltages.
absl::StatusOr<Vector> LeastBlocking(const RestProblem& rest, const Circuit& circuit, const CircuitBranches& graph) {
  const absl::Status not_decided = absl::InvalidArgumentError(
      "could not decide whether the operating point at 0 is the only one; give the "
      "start with IC= and UIC");
  if (rest.blocking.constant.size() == 0) return not_decided;
  const LcpRequest request{.rule = SolutionRule::kMinimizer,
                           .selector = Selector{rest.blocking.of_y, -rest.blocking.constant}};
  const auto chosen = SolveLcp(rest.M, rest.q, request);
  if (!chosen.ok()) return chosen.status();
  if (chosen->verdict != LcpStatus::kSolved) return not_decided;
  const Index open = FirstOpenRow(rest.M, rest.q, rest.storage, chosen->y, rest.blocking.of_y);
  if (open >= 0) return NotDetermined(circuit.elements[AsSize(graph.storages[AsSize(open)].element)]);
  return open < -1 ? absl::StatusOr<Vector>(not_decided) : chosen->y;
}

// Switches with hysteresis that are neither open nor closed: the circuit rests in neither state.
std::vector<std::string> NotesOnHalfClosed(const RestProblem& rest, const Circuit& circuit,
                                           const CircuitBranches& graph, const Vector& y) {
  std::vector<std::string> notes;
  for (std::size_t k = 0; k < graph.clamps.size(); ++k) {
    const ClampBranches& clamp = graph.clamps[k];
    const Element& element = circuit.elements[AsSize(clamp.element)];
    if (!clamp.is_gate || element.switching.hysteresis == 0) continue;
    const auto row = static_cast<Index>(k);
    const double gate = rest.clamps.constant[row] + rest.clamps.of_y.row(row).dot(y);
    if (!(gate > kSameResult && gate < 1 - kSameResult)) continue;
    notes.push_back(WithPlace(element) +
                    " starts between open and closed, since the circuit is at rest in neither state: it oscillates, "
                    "and other programs begin elsewhere in the period; IC= and UIC give another start");
  }
  return notes;
}

// y at the start if M is of no class.
absl::StatusOr<Vector> StartAmongSeveral(const RestProblem& rest, const Circuit& circuit,
                                         const CircuitBranches& graph) {
  const std::string advice = "; give the start with IC= and UIC";
  const BlockSolutions found =
      SolveByBlocks(rest.M, rest.q, kWorkingPrecision * rest.q_size, rest.storage, graph.clamps, rest.sign);
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
  const double size = kSameResult * (first.cwiseAbs() + rest.constant.cwiseAbs()).sum();
  for (const Index k : starts) {
    if ((storages(k) - first).cwiseAbs().sum() <= size) continue;
    return absl::InvalidArgumentError("there are several operating points at 0, which differ in " +
                                      ElementsThatDiffer(found.all, starts, rest.clamps, circuit, graph) + advice);
  }
  return found.all[AsSize(starts.front())].y;
}

}  // namespace

absl::StatusOr<OperatingPoint> FindOperatingPoint(const Circuit& circuit, const CircuitBranches& graph,
                                                  const Vector& source_values) {
  const auto at_rest = MakeRestNetwork(circuit, graph);
  if (!at_rest.ok()) return at_rest.status();
  const LinearNetwork& network = at_rest->network;

  Vector given = Vector::Zero(network.num_inputs());
  for (std::size_t s = 0; s < graph.sources.size(); ++s) {
    given[network.InputOf(graph.sources[s].branch)] = source_values[static_cast<Index>(s)];
  }
  for (std::size_t k = 0; k < at_rest->held.size(); ++k) {
    given[network.InputOf(static_cast<Index>(graph.branches.size() + k))] =
        circuit.node_voltages[AsSize(at_rest->held[k])].volts;
  }
  const RestProblem rest = MakeRestProblem(*at_rest, circuit, graph, given);
  const auto start_at = [&](const Vector& y) -> absl::StatusOr<OperatingPoint> {
    if (absl::Status status = MissedVoltage(*at_rest, rest, circuit, graph, y); !status.ok()) return status;
    return OperatingPoint{StorageAt(rest, y), NotesOnHalfClosed(rest, circuit, graph, y)};
  };
  if (rest.q.size() == 0) return start_at(Vector(0));

  const MatrixClass matrix_class = Classify(rest.M);
  const bool semidefinite = matrix_class.positive_semidefinite.yes();
  if (!matrix_class.p.yes() && !semidefinite) {
    const auto y = StartAmongSeveral(rest, circuit, graph);
    return y.ok() ? start_at(*y) : y.status();
  }
  const auto solved = SolveLcp(rest.M, rest.q, matrix_class.p.yes() ? SolutionRule::kUnique : SolutionRule::kLeastNorm);
  if (!solved.ok()) return solved.status();
  if (solved->verdict != LcpStatus::kSolved) return absl::InvalidArgumentError(NoOperatingPoint(graph, circuit));
  if (matrix_class.p.yes() || rest.storage.isZero(0)) return start_at(solved->y);
  const Index open = FirstOpenRow(rest.M, rest.q, rest.storage, solved->y);
  if (open == -1) return start_at(solved->y);
  const auto least = LeastBlocking(rest, circuit, graph);
  if (!least.ok()) return least.status();
  auto start = start_at(*least);
  const Index decided = open >= 0 ? open : FirstOpenRow(rest.M, rest.q, rest.storage, *least);
  if (start.ok() && decided >= 0) {
    start->notes.push_back(
        "the operating point at 0 does not determine the voltage of " +
        WithPlace(circuit.elements[AsSize(graph.storages[AsSize(decided)].element)]) +
        ": as if all diodes and switches that block had the same tiny conductance; .ic V(node)=... gives another");
  }
  return start;
}

}  // namespace dlcs
