// SPDX-License-Identifier: Apache-2.0
// f and g at the nodes and midpoints of a segment.

#ifndef DLCS_CORE_DISCRETIZATION_SOURCES_H_
#define DLCS_CORE_DISCRETIZATION_SOURCES_H_

#include <optional>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "core/discretization/grid.h"
#include "core/discretization/segment.h"
#include "core/problem/problem.h"

namespace dlcs {

class Sources {
 public:
  // A time at which a source has no finite value.
  struct NonFinite {
    double time = 0;
    std::string message;  // "g[1] is -inf at t = 0.25"
  };

  // Errors: InvalidArgument as TimeFunctionEvaluator::Create().
  static absl::StatusOr<Sources> Create(const Problem& problem);

  // Fills f, g, f_mid and g_mid of `segment` for `steps` steps of `run` from step `first_step` on, and sets its
  // first_node, steps and step. The first node holds right limits, all others left limits; at inner nodes of a run the
  // two agree. Returns the first time at which a value was not finite, if any.
  std::optional<NonFinite> Sample(const Grid& grid, const Run& run, Index first_step, Index steps, Segment& segment);

  // One value of f (m entries) or g (n entries), finite or not.
  void F(double t, Side side, Eigen::Ref<Vector> value) {
    f_.Evaluate(t, side, value);
    if (f_offset_.size() > 0) value += f_offset_;
  }
  void G(double t, Side side, Eigen::Ref<Vector> value) {
    g_.Evaluate(t, side, value);
    if (g_offset_.size() > 0) value += g_offset_;
  }
  // From here on these functions return f + `f` and g + `g`: what discrete states add.
  void SetOffsets(Vector f, Vector g) {
    f_offset_ = std::move(f);
    g_offset_ = std::move(g);
  }
  // Whether f or g is known to be constant between the two times.
  bool FIsSteady(double begin, double end) { return f_.IsSteady(begin, end); }
  bool GIsSteady(double begin, double end) { return g_.IsSteady(begin, end); }
  // Bounds of the rounding errors of the values at `t`, between break points.
  void RoundingOfF(double t, Eigen::Ref<Vector> bound) { f_.RoundingAt(t, bound); }
  void RoundingOfG(double t, Eigen::Ref<Vector> bound) { g_.RoundingAt(t, bound); }
  // g' and bounds of its rounding errors, infinite where it is not known.
  void SlopeOfG(double t, Side side, Eigen::Ref<Vector> value, Eigen::Ref<Vector> bound) {
    g_.SlopeAt(t, side, value, bound);
  }
  Index num_states() const { return f_.size(); }
  Index num_constraints() const { return g_.size(); }

 private:
  Sources(TimeFunctionEvaluator f, TimeFunctionEvaluator g) : f_(std::move(f)), g_(std::move(g)) {}

  TimeFunctionEvaluator f_;
  TimeFunctionEvaluator g_;
  Vector f_offset_, g_offset_;  // empty: zero
};

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_SOURCES_H_
