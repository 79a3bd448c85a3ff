// SPDX-License-Identifier: Apache-2.0
// What is computed once per step length.

#ifndef DLCS_CORE_DISCRETIZATION_STEP_CACHE_H_
#define DLCS_CORE_DISCRETIZATION_STEP_CACHE_H_

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "core/discretization/state_archive.h"
#include "core/types.h"

namespace dlcs {

// Whether two step lengths agree to the rounding of their times.
inline bool IsSameStep(double a, double b) { return std::abs(a - b) <= 1e-12 * b; }

// Most grids have few lengths; the limit keeps grids with many different lengths from filling the memory.
inline constexpr size_t kCachedSteps = 8;
// The limit for steps with sparse factors and iterative ones, which take up to gigabytes each.
inline size_t MostStepsKept(Index states) { return states > 100'000 ? 1 : kCachedSteps; }

// Runs whose steps agree to rounding share one value. The values of the `most` most recently used lengths are kept.
template <typename Value>
class StepCache {
 public:
  explicit StepCache(std::function<std::unique_ptr<Value>(double step)> make, std::size_t most = kCachedSteps)
      : make_(std::move(make)), most_(most) {}

  Value& At(double step) {
    const auto found =
        std::find_if(values_.begin(), values_.end(), [&](const auto& entry) { return IsSameStep(entry.first, step); });
    if (found != values_.end()) {
      std::rotate(found, found + 1, values_.end());
    } else {
      if (values_.size() >= most_) values_.erase(values_.begin());
      values_.emplace_back(step, nullptr);
    }
    auto& [length, value] = values_.back();
    if (!value) value = make_(length);
    return *value;
  }

  // For checkpoints: the cached lengths, whose last bits come from the first run with that length. Values are computed
  // again when they are needed.
  friend void CarryFields(StateArchive& state, StepCache& cache) {
    std::vector<double> lengths;
    for (const auto& [length, value] : cache.values_) lengths.push_back(length);
    state(lengths);
    if (!state.reads()) return;
    cache.values_.clear();
    for (const double length : lengths) cache.values_.emplace_back(length, nullptr);
  }
  // Calls visit(length, value) for each entry, the most recently used one last. The value is null if it was not used
  // since a checkpoint was read.
  template <typename Visit>
  void ForEach(const Visit& visit) {
    for (auto& [length, value] : values_) visit(length, value.get());
  }

 private:
  std::function<std::unique_ptr<Value>(double)> make_;
  std::size_t most_;
  std::vector<std::pair<double, std::unique_ptr<Value>>> values_;  // the most recently used one is last
};

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_STEP_CACHE_H_
