// SPDX-License-Identifier: Apache-2.0
#include "core/iteration/anderson.h"

#include <limits>

#include "core/linalg/decompositions.h"

namespace dlcs {

Matrix AndersonAcceleration::Next(const Matrix& u, const Matrix& image, const Vector& size) {
  if (depth_ == 0) return image;
  const Vector unit = size.unaryExpr([](double s) { return s > 0 ? 1 / s : 1.0; });
  const Matrix residual = unit.asDiagonal() * (image - u);
  if (last_image_.size() > 0) {
    image_steps_.push_back(image - last_image_);
    residual_steps_.push_back(residual - last_residual_);
    if (image_steps_.size() > depth_) {
      image_steps_.pop_front();
      residual_steps_.pop_front();
    }
  }
  last_image_ = image;
  last_residual_ = residual;
  if (image_steps_.empty()) return image;

  Matrix steps(residual.size(), static_cast<Index>(residual_steps_.size()));
  for (Index k = 0; k < steps.cols(); ++k) {
    steps.col(k) = residual_steps_[static_cast<std::size_t>(k)].reshaped();
  }
  const Vector weights = steps.colPivHouseholderQr().solve(Vector(residual.reshaped()));
  if (!weights.allFinite()) {
    Restart();
    return image;
  }
  Matrix next = image;
  for (Index k = 0; k < steps.cols(); ++k) next -= weights[k] * image_steps_[static_cast<std::size_t>(k)];
  return next;
}

void AndersonAcceleration::Restart() {
  last_image_.resize(0, 0);
  image_steps_.clear();
  residual_steps_.clear();
}

}  // namespace dlcs
