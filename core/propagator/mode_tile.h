// SPDX-License-Identifier: Apache-2.0
// Exponentials of sixteen modes, carried from step to step in registers.

#ifndef DLCS_CORE_PROPAGATOR_MODE_TILE_H_
#define DLCS_CORE_PROPAGATOR_MODE_TILE_H_

#include <vector>

#include "core/types.h"

namespace dlcs {

// Arrays of some modes (rows) and exponentials k (columns), and the further terms of each step. For inputs û_0, û_1,
// ...:
//
//     P_j = e P_{j-1} + û_{j-1},                                     P_0 = start û_0,
//     node_j   = now û_j + Σ_k past_k P_{j,k},
//     middle_j = mid_before û_{j-1} + mid_after û_j + Σ_k mid_past_k P_{j-1,k}.
struct ModeRecursion {
  Matrix decay, start;
  Matrix past, mid_past;
  Vector now, mid_before, mid_after;
};

// Sixteen modes of a ModeRecursion. An exponential stays in registers for kSteps steps, whose inputs and sums stay in
// the first cache: 6 operations for each step, mode and exponential, and almost no memory traffic.
//
// Sums run over k in its order. The bits depend neither on the registers of the processor nor on the other modes of the
// tile.
class ModeTile {
 public:
  static constexpr Index kModes = 16;
  static constexpr Index kSteps = 64;

  enum class Sums { kNone, kNodes, kNodesAndMiddles };

  // Of the modes `begin` ... `begin` + count - 1, count <= kModes, at P_0 for `first` = û_0 of all modes.
  // `forgets_first` if û_0 has no effect afterward (`start` is zero then).
  ModeTile(const ModeRecursion& recursion, Index begin, Index count, const Eigen::Ref<const Vector>& first,
           bool forgets_first);

  // Advances by one step for each column of `inputs`, the û of all modes; at most kSteps columns.
  void Carry(const Eigen::Ref<const Matrix>& inputs, Sums sums);
  // Stores node_j and middle_j of those steps in the rows of the tile in `values`, one step a column, or adds them to
  // what is there.
  void StoreNodes(Eigen::Ref<Matrix> values) const { Store(nodes_, values); }
  void StoreMiddles(Eigen::Ref<Matrix> values) const { Store(middles_, values); }
  void AddNodes(Eigen::Ref<Matrix> values) const { Add(nodes_, values); }
  void AddMiddles(Eigen::Ref<Matrix> values) const { Add(middles_, values); }
  // P after the last step: count × exponentials.
  Matrix Past() const;

  struct alignas(64) Row {
    double mode[kModes];
  };

 private:
  std::vector<Row> RowsOf(const Matrix& terms) const;
  Row RowOf(const Vector& values) const;
  void Store(const std::vector<Row>& from, Eigen::Ref<Matrix> values) const;
  void Add(const std::vector<Row>& from, Eigen::Ref<Matrix> values) const;

  Index begin_, count_, terms_;
  std::vector<Row> decay_, past_weight_, mid_weight_, past_;
  Row now_, mid_before_, mid_after_;
  std::vector<Row> inputs_, nodes_, middles_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_MODE_TILE_H_
