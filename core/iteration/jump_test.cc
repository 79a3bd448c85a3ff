// SPDX-License-Identifier: Apache-2.0
#include "core/iteration/jump_test.h"

#include "core/context/solve_context.h"
#include "core/lcp/basis/tolerance.h"
#include "core/linalg/norms.h"

namespace dlcs {

std::optional<Jump> DetectJump(const Eigen::Ref<const Matrix>& q, const Eigen::Ref<const Matrix>& y,
                               double largest_slope) {
  // The rounding of y, and of q through the slope.
  const double rounding = kSameResult * (MaxAbs(y) + largest_slope * MaxAbs(q));
  for (Index j = 1; j < q.cols(); ++j) {
    const double change = MaxAbs(y.col(j) - y.col(j - 1));
    const double moved = MaxAbs(q.col(j) - q.col(j - 1));
    if (change > (1 + kClearDifference) * largest_slope * moved + rounding) return Jump{j, change / moved};
  }
  return std::nullopt;
}

std::string DescribeJump(const Jump& step, double time, double largest_slope) {
  return "y changes by " + FormatNumber(step.quotient) +
         " times the change of N x + g before t = " + FormatNumber(time) + ", but its pieces change by at most " +
         FormatNumber(largest_slope);
}

}  // namespace dlcs
