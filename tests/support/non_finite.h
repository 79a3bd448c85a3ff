// SPDX-License-Identifier: Apache-2.0
// Numbers that invalid input may hold.
#ifndef DLCS_TESTS_SUPPORT_NON_FINITE_H_
#define DLCS_TESTS_SUPPORT_NON_FINITE_H_

#include <limits>

namespace dlcs::testing {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_NON_FINITE_H_
