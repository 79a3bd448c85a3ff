// SPDX-License-Identifier: Apache-2.0
#include "core/iteration/anderson.h"

#include "core/linalg/bounded_sum.h"
#include "core/linalg/decompositions.h"

namespace dlcs {
namespace {

constexpr Index kColumnsOfABlock = 16;

}  // namespace

void AndersonAcceleration::Accelerate(const Matrix& u, const Vector& size, Matrix& image) {
  if (depth_ == 0) return;
  const Vector unit = size.unaryExpr([](double s) { return s > 0 ? 1 / s : 1.0; });
  if (last_image_.size() == 0) {
    last_image_ = image;
    last_residual_ = unit.asDiagonal() * (image - u);
    return;
  }
  AddStep(u, unit, image);
  const Vector weights = Weights();
  if (!weights.allFinite()) return;
  workers_.ForBlocks(image.cols(), kColumnsOfABlock, [&](Index, Index begin, Index end) {
    for (Index k = 0; k < weights.size(); ++k) {
      const Matrix& step = steps_[static_cast<std::size_t>(k)].image;
      image.middleCols(begin, end - begin) -= weights[k] * step.middleCols(begin, end - begin);
    }
  });
}

void AndersonAcceleration::AddStep(const Matrix& u, const Vector& unit, const Matrix& image) {
  newest_ = (newest_ + 1) % depth_;
  if (newest_ == static_cast<Index>(steps_.size())) {
    steps_.push_back({Matrix(u.rows(), u.cols()), Matrix(u.rows(), u.cols())});
    products_.conservativeResize(newest_ + 1, newest_ + 1);
  }
  Step& step = steps_[static_cast<std::size_t>(newest_)];
  const auto count = static_cast<Index>(steps_.size());
  const Index blocks = (u.cols() + kColumnsOfABlock - 1) / kColumnsOfABlock;
  Matrix with_step(count, blocks), with_residual(count, blocks);
  workers_.ForBlocks(u.cols(), kColumnsOfABlock, [&](Index block, Index begin, Index end) {
    const auto of = [&](auto& matrix) { return matrix.middleCols(begin, end - begin); };
    of(step.image) = of(image) - of(last_image_);
    of(last_image_) = of(image);
    of(step.residual) = -of(last_residual_);
    of(last_residual_) = unit.asDiagonal() * (of(image) - of(u));
    of(step.residual) += of(last_residual_);
    for (Index k = 0; k < count; ++k) {
      const auto other = of(steps_[static_cast<std::size_t>(k)].residual);
      with_step(k, block) = of(step.residual).cwiseProduct(other).sum();
      with_residual(k, block) = of(last_residual_).cwiseProduct(other).sum();
    }
  });
  products_.col(newest_) = with_step.rowwise().sum();
  products_.row(newest_) = products_.col(newest_).transpose();
  right_ = with_residual.rowwise().sum();
}

Vector AndersonAcceleration::Weights() const {
  const Vector lengths = products_.diagonal().cwiseSqrt();
  const Vector unit = lengths.unaryExpr([](double length) { return length > 0 ? 1 / length : 0.0; });
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(unit.asDiagonal() * products_ * unit.asDiagonal());
  const double least = RoundingOf(20 * unit.size());
  const Vector inverse = eigen.eigenvalues().unaryExpr([least](double value) { return value > least ? 1 / value : 0; });
  const Matrix& vectors = eigen.eigenvectors();
  return unit.cwiseProduct(vectors * inverse.cwiseProduct(vectors.transpose() * unit.cwiseProduct(right_)));
}

}  // namespace dlcs
