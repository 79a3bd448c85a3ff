// SPDX-License-Identifier: Apache-2.0
// The sparse system of one iterative step, assembled by rows: all of them, or those of one process.

#ifndef DLCS_CORE_STEPPING_ITERATIVE_SYSTEM_H_
#define DLCS_CORE_STEPPING_ITERATIVE_SYSTEM_H_

#include <functional>
#include <string>
#include <vector>

#include "core/discretization/step_rule.h"
#include "core/lcp/structured/bounded_solver.h"
#include "core/linalg/sparse/row_writer.h"
#include "core/problem/problem.h"

namespace dlcs {

// The matrices of pairs. Rows are those of the pairs that this process has, columns those of the whole problem.
struct RowsOfPairs {
  RowMajorMatrix N, M;
  RowMajorMatrix columns_of_B, columns_of_M;  // as rows
  std::vector<Index> numbers;                 // of the pairs in the whole problem, increasing

  Index count() const { return static_cast<Index>(numbers.size()); }
  // Whether pair `i` of these has no M_ii and so must be an obstacle.
  bool IsObstacle(Index i) const;
};

// The same for states.
struct RowsOfStates {
  RowMajorMatrix A, B, E;  // E without rows stands for the identity
  std::vector<Index> numbers;
};

// All rows. Cost: the entries.
RowsOfPairs AllPairs(const Problem& problem);
RowsOfStates AllStates(const Problem& problem);

// Why a pair is not served by core/stepping/iterative_step.h.
struct UnservedPair {
  enum class Rule { kNone, kNoDiagonal, kNoSingleState, kTwoBounds };
  Rule rule = Rule::kNone;
  Index pair = 0, state = 0;  // the first one, and of two bounds their state

  std::string Text() const;  // empty for kNone
};
// The first of these pairs that is not served. A state must be bounded by pairs of one process only.
UnservedPair FindUnserved(const RowsOfPairs& rows, Index states);

struct IterativeSystem {
  struct Pair {
    bool is_obstacle = false;
    Index unknown = 0;       // that of the state of an obstacle, else y
    double scale = 0;        // of multipliers: y_i = multiplier / scale of an obstacle; else w_i
    double coefficient = 0;  // ν S_cc

    BoundedUnknown bound() const { return {.index = unknown, .sign = is_obstacle && coefficient < 0 ? -1.0 : 1.0}; }
  };

  RowMajorMatrix K;         // rows of states, then of unknowns y; columns are all unknowns
  std::vector<Pair> pairs;  // in the order of their rows
  Vector scales;            // S of these states; empty without a mass matrix
  // ‖S (E - sA) S‖_∞, ‖w S B‖_∞ of the unknowns y, ‖D M‖_∞ and ‖D N S‖_∞ over these rows.
  double norm_of_states = 0, norm_of_coupling = 0, norm_of_pairs = 0, norm_of_pair_states = 0;
};

// The unknowns of all processes: a column of K for each state and each pair that is no obstacle.
struct UnknownNumbers {
  Index count = 0;
  std::function<Index(Index)> of_state;  // by the number of the state
  std::function<Index(Index)> of_pair;   // by that of the pair; negative for an obstacle
};

// For pairs that are served. `scales`: S of all states, empty without a mass matrix. Cost: the entries.
IterativeSystem AssembleRows(const StepRule& rule, const RowsOfStates& states, RowsOfPairs pairs, const Vector& scales,
                             const UnknownNumbers& numbers);

// Whether two matrices differ by rounding only, which K and its transpose are taken to do where both are to be
// symmetric: then their mean takes the place of K.
bool DifferByRounding(const RowMajorMatrix& K, const RowMajorMatrix& transpose);

// The whole system in one process, symmetric where it is so up to rounding. Unknowns y follow all states.
IterativeSystem AssembleAll(const StepRule& rule);

}  // namespace dlcs

#endif  // DLCS_CORE_STEPPING_ITERATIVE_SYSTEM_H_
