// SPDX-License-Identifier: Apache-2.0
// Does a sampled solution function jump?

#ifndef DLCS_CORE_ITERATION_JUMP_TEST_H_
#define DLCS_CORE_ITERATION_JUMP_TEST_H_

#include <optional>
#include <string>

#include "core/types.h"

namespace dlcs {

struct Jump {
  Index column = 0;     // the step from column - 1
  double quotient = 0;  // ‖y_j - y_{j-1}‖_∞ / ‖q_j - q_{j-1}‖_∞
};

// The first step over which `y`, column by column the selected solution at the columns of `q`, changes by more than
// `largest_slope` times the change of q: a continuous selection, whose pieces are no steeper, has none
// (core/matrix_classes/lipschitz.h). Differences at the level of rounding are ignored.
std::optional<Jump> DetectJump(const Eigen::Ref<const Matrix>& q, const Eigen::Ref<const Matrix>& y,
                               double largest_slope);

// "y changes by 2.3e+06 times the change of N x + g before t = 0.5, a piece of it by at most 1".
std::string DescribeJump(const Jump& step, double time, double largest_slope);

}  // namespace dlcs

#endif  // DLCS_CORE_ITERATION_JUMP_TEST_H_
