// SPDX-License-Identifier: Apache-2.0
// What is computed once per step length.

#ifndef DLCS_CORE_METHODS_STEP_CACHE_H_
#define DLCS_CORE_METHODS_STEP_CACHE_H_

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

namespace dlcs {

// Whether two lengths of steps agree to the rounding of their times.
inline bool IsSameStep(double a, double b) { return std::abs(a - b) <= 1e-12 * b; }

// Grids have few lengths; many odd output times must not fill the memory.
inline constexpr size_t kCachedSteps = 8;

// Runs whose steps agree to rounding share one value. The values of the kCachedSteps lengths that were asked for
// last are kept.
template <typename Value>
class StepCache {
 public:
  explicit StepCache(std::function<std::unique_ptr<Value>(double step)> make) : make_(std::move(make)) {}

  Value& At(double step) {
    const auto found = std::find_if(values_.begin(), values_.end(),
                                    [&](const auto& entry) { return IsSameStep(entry.first, step); });
    if (found != values_.end()) {
      std::rotate(found, found + 1, values_.end());
      return *values_.back().second;
    }
    if (values_.size() == kCachedSteps) values_.erase(values_.begin());
    return *values_.emplace_back(step, make_(step)).second;
  }

 private:
  std::function<std::unique_ptr<Value>(double)> make_;
  std::vector<std::pair<double, std::unique_ptr<Value>>> values_;  // the one used last is last
};

}  // namespace dlcs

#endif  // DLCS_CORE_METHODS_STEP_CACHE_H_
