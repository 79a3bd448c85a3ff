// SPDX-License-Identifier: Apache-2.0
// The response to a hat, step after step.

#ifndef DLCS_CORE_LAPLACE_HAT_RESPONSE_H_
#define DLCS_CORE_LAPLACE_HAT_RESPONSE_H_

#include "core/discretization/scheme.h"
#include "core/types.h"

namespace dlcs {

// R h φ_2 B,  R h E^{k-1} φ_1² B (k = 1, 2, ...), one after the other: what a hat of y at a node does to R x at
// that node and at later ones. R = N gives the blocks of the kernel, R = vᵀN one combination of their rows.
class HatResponse {
 public:
  // `scheme` (ExponentialPiecewiseLinear) must outlive it.
  HatResponse(const Matrix& rows, const Scheme& scheme)
      : scheme_(scheme), rows_(rows), response_(scheme.state * scheme.y_after + scheme.y_before) {}

  Index next() const { return next_; }  // k

  // Cost: 2 m² for each row.
  Matrix Next() {
    if (next_++ == 0) return rows_ * scheme_.y_after;
    Matrix response = rows_ * response_;
    rows_ = (rows_ * scheme_.state).eval();
    return response;
  }

 private:
  const Scheme& scheme_;
  Matrix rows_;      // R E^{k-1} for the next k
  Matrix response_;  // h φ_1² B
  Index next_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LAPLACE_HAT_RESPONSE_H_
