// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/contour_kernel.h"

#include <algorithm>
#include <bit>
#include <utility>
#include <vector>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

constexpr Index kMaxDoubles = Index{1} << 24;  // 128 MB of blocks, and up to four times that of their transforms
constexpr Index kBoundedAtFirst = 64;

class ContourHistory final : public ConvolutionHistory {
 public:
  ContourHistory(const ContourResponse& response, PulseTrain train) : response_(response), train_(std::move(train)) {}

  void Next(Eigen::Ref<Vector> q) override { response_.Next(train_, q); }

  Matrix History(Index steps) override {
    PulseTrain train = train_;
    Matrix history(response_.now().rows(), steps);
    for (Index k = 0; k < steps; ++k) {
      response_.Next(train, history.col(k));
      train.Advance();
    }
    return history;
  }

  void Push(const Eigen::Ref<const Vector>& y) override { train_.Push(y); }

 private:
  const ContourResponse& response_;
  PulseTrain train_;
};

}  // namespace

ContourKernel::ContourKernel(double step, Index longest, ContourResponse response)
    : step_(step), longest_(longest), response_(std::move(response)) {}

std::unique_ptr<ConvolutionHistory> ContourKernel::Start(const Eigen::Ref<const Vector>& y0) const {
  return std::make_unique<ContourHistory>(response_, response_.Start(y0));
}

bool ContourKernel::ReserveBlocks(Index window, Workers& workers) const {
  const Index n = K0().rows();
  if (window > kMaxDoubles / (n * n)) return false;
  if (blocks_.cols() < window * n) {
    const auto doubled = static_cast<Index>(std::bit_ceil(static_cast<std::size_t>(window)));
    const Index count = std::min({std::max(window, longest_), std::max(doubled, window), kMaxDoubles / (n * n)});
    blocks_ = response_.Blocks(count, workers);
    convolution_.emplace(n);  // longer runs of blocks have other bits
  }
  return true;
}

Matrix ContourKernel::Respond(const Matrix& y, Workers& workers) const {
  {
    const std::scoped_lock lock(mutex_);  // the convolution keeps transforms
    if (ReserveBlocks(y.cols(), workers)) return convolution_->Apply(blocks_, y, workers);
  }
  Matrix signal = Matrix::Zero(y.rows(), y.cols() + 1);
  signal.rightCols(y.cols()) = y;
  return response_.Respond(signal, workers).nodes;
}

Matrix ContourKernel::RespondAtMiddles(const Matrix& y, Workers& workers) const {
  return response_.Respond(y, workers).middles;
}

double ContourKernel::Bound(Index window) const {
  const std::scoped_lock lock(mutex_);
  const Index n = K0().rows();
  const Index fit = std::max<Index>(1, kMaxDoubles / (n * n));
  const Index most = std::clamp<Index>(window, 1, fit);
  if (static_cast<Index>(bounds_.size()) < most) {
    Workers one(1);
    const Index count = std::max(most, std::min({kBoundedAtFirst, longest_, fit}));
    const Matrix blocks = response_.Blocks(count, one);
    bounds_.clear();
    for (Index k = 0; k < count; ++k) {
      const double bound = InfinityNorm(blocks.middleCols(k * n, n)) / step_;
      bounds_.push_back(k == 0 ? bound : NanMax(bounds_.back(), bound));
    }
  }
  return bounds_[static_cast<std::size_t>(most - 1)];
}

}  // namespace dlcs
