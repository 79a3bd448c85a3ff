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

  struct alignas(64) Row {
    double mode[kModes];
  };
  // `num_modes` <= kModes modes of a recursion from `first_mode` on, in the order in which a tile reads them.
  struct Terms {
    Terms(const ModeRecursion& recursion, Index first_mode, Index num_modes);

    Index begin, count, exponentials;
    std::vector<Row> decay, past_weight, mid_weight, start;
    Row now, mid_before, mid_after;
  };

  enum class Sums { kNone, kNodes, kNodesAndMiddles };

  // Starts at P_0 for `first` = û_0 of all modes. `forgets_first` if û_0 has no effect afterward (`start` is zero
  // then). Is carried by at most `most_steps` <= kSteps steps at once. Keeps a reference to `terms`.
  ModeTile(const Terms& terms, const Eigen::Ref<const Vector>& first, bool forgets_first, Index most_steps);

  // Advances by one step for each column of `inputs`, the û of all modes.
  void Carry(const Eigen::Ref<const Matrix>& inputs, Sums sums);
  // Stores node_j and middle_j of those steps in the rows of the tile in `values`, one step a column, or adds them to
  // what is there.
  void StoreNodes(Eigen::Ref<Matrix> values) const { Store(nodes_, values); }
  void StoreMiddles(Eigen::Ref<Matrix> values) const { Store(middles_, values); }
  void AddNodes(Eigen::Ref<Matrix> values) const { Add(nodes_, values); }
  void AddMiddles(Eigen::Ref<Matrix> values) const { Add(middles_, values); }
  // P after the last step: count × exponentials.
  Matrix Past() const;

 private:
  void Store(const std::vector<Row>& from, Eigen::Ref<Matrix> values) const;
  void Add(const std::vector<Row>& from, Eigen::Ref<Matrix> values) const;

  const Terms& terms_;
  std::vector<Row> past_, inputs_, nodes_, middles_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_MODE_TILE_H_
