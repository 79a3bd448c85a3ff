// SPDX-License-Identifier: Apache-2.0
// The convolution history of time stepping with exponentials of all modes, where each input is known only after the
// previous output.

#ifndef DLCS_CORE_PROPAGATOR_MODE_HISTORY_H_
#define DLCS_CORE_PROPAGATOR_MODE_HISTORY_H_

#include <vector>

#include "core/propagator/mode_tile.h"

namespace dlcs {

// Of a ModeRecursion, whose inputs come one at a time: sum_j = Σ_k past_k P_{j,k}. The cost is dominated by memory
// traffic, so the exponentials are read and written only once in four nodes. Their sums for the next nodes are computed
// at the same time, and the inputs in between are added by their effects one to three nodes later,
//
//     sum_{j+m} = Σ_k past_k e_k^m P_{j,k} + Σ_{l=1..m} effect_{m-l} û_{j+l-1},   effect_i = Σ_k past_k e_k^i.
//
// Copies are independent. Cost of a node: 5 operations and one number of traffic for each mode and term.
class ModeHistory {
 public:
  static constexpr Index kNodes = 4;
  static constexpr Index kModes = 8;  // of a tile

  // At P_0 = start û_0. `forgets_first` if û_0 has no effect afterward (`start` is zero then).
  ModeHistory(const ModeRecursion& recursion, const Vector& first, bool forgets_first);

  // sum_j, initially for j = 1.
  const Vector& sum() const { return sum_; }
  // Adds û_j and advances to the next node.
  void Push(const Eigen::Ref<const Vector>& input);

 private:
  struct alignas(64) Row {
    double mode[kModes] = {};
  };

  std::vector<Row> TilesOf(const Matrix& terms) const;
  // Adds the inputs to P if there are kNodes of them, and computes the sums for the next nodes.
  void Pass(bool takes_inputs);

  Index terms_, num_modes_;
  std::vector<Row> decay_, weight_;  // tile by tile; k runs within a tile
  std::vector<Row> past_;            // P, the same
  Matrix effects_;                   // effect_i in column i; modes fill whole tiles here and below
  Matrix ahead_;                     // Σ_k past_k e_k^m P_k in column m
  Matrix inputs_;                    // since P, one a column
  Index num_inputs_ = 0;
  Vector sum_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_MODE_HISTORY_H_
