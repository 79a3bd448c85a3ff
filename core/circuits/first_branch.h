// SPDX-License-Identifier: Apache-2.0
// Which of several solutions a circuit starts with.

#ifndef DLCS_CORE_CIRCUITS_FIRST_BRANCH_H_
#define DLCS_CORE_CIRCUITS_FIRST_BRANCH_H_

#include <string>
#include <vector>

#include "core/circuits/circuit.h"
#include "core/circuits/circuit_branches.h"
#include "core/circuits/solution_blocks.h"
#include "core/types.h"

namespace dlcs {

// Voltages as functions of y: of the nodes of `graph.clamps`, then of those of `circuit.node_voltages`.
struct BranchVoltages {
  Matrix of_y;
  Vector constant;
};

// Those of `solutions` that the circuit may start with. Comparators with feedback have several: solutions between two
// folds, and those in which a gate is neither open nor closed, are left out where there are others, then those farther
// than others from the given node voltages, then those in which a switch is not as it starts. Of those that are joined
// by a line of solutions with the same voltages the first.
std::vector<Index> PossibleStarts(const std::vector<BlockSolution>& solutions, const BranchVoltages& voltages,
                                  const Circuit& circuit, const CircuitBranches& graph);

// The elements of `graph.clamps` in which solutions differ, for messages.
std::string ElementsThatDiffer(const std::vector<BlockSolution>& solutions, const std::vector<Index>& among,
                               const BranchVoltages& voltages, const Circuit& circuit, const CircuitBranches& graph);

// The elements of `pairs`, for messages.
std::string ElementsOfPairs(const std::vector<Index>& pairs, const Circuit& circuit, const CircuitBranches& graph);

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_FIRST_BRANCH_H_
