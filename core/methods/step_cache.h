// SPDX-License-Identifier: Apache-2.0
// What is computed once per step length.

#ifndef DLCS_CORE_METHODS_STEP_CACHE_H_
#define DLCS_CORE_METHODS_STEP_CACHE_H_

#include <cmath>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

namespace dlcs {

// Runs whose steps agree to rounding share one value. The values of the last few lengths are kept.
template <typename Value>
class StepCache {
 public:
  explicit StepCache(std::function<std::unique_ptr<Value>(double step)> make) : make_(std::move(make)) {}

  Value& At(double step) {
    constexpr double kSameStep = 1e-12;
    constexpr size_t kKept = 8;  // grids have few lengths; many odd output times must not fill the memory
    for (auto& [length, value] : values_) {
      if (std::abs(length - step) <= kSameStep * step) return *value;
    }
    if (values_.size() == kKept) values_.erase(values_.begin());
    return *values_.emplace_back(step, make_(step)).second;
  }

 private:
  std::function<std::unique_ptr<Value>(double)> make_;
  std::vector<std::pair<double, std::unique_ptr<Value>>> values_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_METHODS_STEP_CACHE_H_
