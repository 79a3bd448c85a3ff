// SPDX-License-Identifier: Apache-2.0
// Percentiles of what was measured.

#ifndef DLCS_TESTS_LOAD_PERCENTILES_H_
#define DLCS_TESTS_LOAD_PERCENTILES_H_

#include <algorithm>
#include <cmath>
#include <vector>

namespace dlcs::load {

// The smallest of `values` (not empty) that at least `percent` percent of them do not exceed; 100 is the largest.
inline double Percentile(std::vector<double> values, double percent) {
  std::sort(values.begin(), values.end());
  const double rank = std::ceil(percent / 100 * static_cast<double>(values.size()));
  return values[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

}  // namespace dlcs::load

#endif  // DLCS_TESTS_LOAD_PERCENTILES_H_
