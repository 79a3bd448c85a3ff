// SPDX-License-Identifier: Apache-2.0
// Acceleration of a fixed-point iteration.

#ifndef DLCS_CORE_ITERATION_ANDERSON_H_
#define DLCS_CORE_ITERATION_ANDERSON_H_

#include <deque>

#include "core/types.h"

namespace dlcs {

// Anderson's acceleration of u = G(u): of the last `depth` + 1 iterates the affine combination whose residual G(u) - u
// is least in ‖·‖₂, rows in units of their size, and the same combination of their images. For a linear G that is
// GMRES; for a piecewise linear one it is so once the pieces are settled.
// Cost: 2 `depth` products with an iterate, and a least squares problem of as many unknowns.
// Source: [Walker & Ni 2011] H. F. Walker, P. Ni. Anderson acceleration for fixed-point iterations. SIAM J. Numer.
// Anal. 49.
class AndersonAcceleration {
 public:
  explicit AndersonAcceleration(int depth) : depth_(depth) {}

  // The next iterate after `u` with image `image` = G(u); depth 0 gives the image. `size` holds the size of each row.
  Matrix Next(const Matrix& u, const Matrix& image, const Vector& size);
  // Drops all earlier iterates.
  void Restart();

 private:
  std::size_t depth_;
  Matrix last_image_, last_residual_;
  std::deque<Matrix> image_steps_, residual_steps_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_ITERATION_ANDERSON_H_
