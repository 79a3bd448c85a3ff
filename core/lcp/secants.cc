// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/secants.h"

#include <algorithm>

namespace dlcs {

void Secants::Add(const Vector& x, const Vector& image) {
  constexpr double kDependent = 1e-6;  // what is left of a step that others span is rounding
  if (is_first_) {
    is_first_ = false;
    residual_ = image - x;
    image_ = image;
    return;
  }
  residual_step_ = image - x - residual_;
  image_step_ = image - image_;
  residual_ = image - x;
  image_ = image;
  const double length = residual_step_.norm();
  for (Index i = 0; i < kept_; ++i) {
    const double part = residual_steps_.col(i).dot(residual_step_);
    residual_step_ -= part * residual_steps_.col(i);
    image_step_ -= part * image_steps_.col(i);
  }
  const double left = residual_step_.norm();
  if (!(left > kDependent * length)) return;
  residual_steps_.col(newest_) = residual_step_ / left;
  image_steps_.col(newest_) = image_step_ / left;
  newest_ = (newest_ + 1) % kDepth;
  kept_ = std::min(kept_ + 1, kDepth);
}

void Secants::Next(Vector& x) const {
  x = image_;
  for (Index i = 0; i < kept_; ++i) x -= residual_steps_.col(i).dot(residual_) * image_steps_.col(i);
}

}  // namespace dlcs
