// SPDX-License-Identifier: Apache-2.0

#include "core/laplace/kernel.h"

#include <algorithm>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

constexpr Index kMaxDoubles = Index{1} << 24;  // 128 MB of blocks, and up to four times that of their transforms
constexpr double kMaxGrowth = 1e4;             // an FFT then errs by 1e-11 of the smallest block at most

}  // namespace

Kernel::Kernel(const Problem& problem, const Scheme& scheme)
    : problem_(problem),
      scheme_(scheme),
      powers_(problem.N),
      response_(scheme.state * scheme.y_after + scheme.y_before),
      longest_window_(std::max<Index>(1, kMaxDoubles / (problem.num_constraints() * problem.num_constraints()))),
      convolution_(problem.num_constraints()) {}

void Kernel::Reserve(Index window, const std::stop_token& stop) {
  const Index n = problem_.num_constraints();
  window = std::min(window, longest_window_);
  if (window <= count_) return;
  blocks_.conservativeResize(n, window * n);
  for (; count_ < window && !stop.stop_requested(); ++count_) {
    auto block = blocks_.middleCols(count_ * n, n);
    if (count_ == 0) {
      block.noalias() = problem_.N * scheme_.y_after;
    } else {
      block.noalias() = powers_ * response_;
      powers_ = (powers_ * scheme_.state).eval();
    }
    const double bound = InfinityNorm(block) / scheme_.step;
    bounds_.push_back(bounds_.empty() ? bound : NanMax(bounds_.back(), bound));
    // The first two blocks are the response within a step or two; growth beyond is that of e^{At}.
    if (count_ >= 2 && !(bounds_[count_] <= kMaxGrowth * bounds_[1])) {
      longest_window_ = count_;
      bounds_.pop_back();
      break;
    }
  }
  blocks_.conservativeResize(n, count_ * n);
  convolution_.SetKernel(blocks_);
}

double Kernel::Bound(Index window) const {
  return bounds_.empty() ? 0 : bounds_[std::min<size_t>(window, bounds_.size()) - 1];
}

}  // namespace dlcs
