// SPDX-License-Identifier: Apache-2.0
// Acceleration of a fixed-point iteration.

#ifndef DLCS_CORE_ITERATION_ANDERSON_H_
#define DLCS_CORE_ITERATION_ANDERSON_H_

#include <vector>

#include "core/parallel/parallel.h"
#include "core/types.h"

namespace dlcs {

// Anderson's acceleration of u = G(u): of the last `depth` + 1 iterates the affine combination whose residual G(u) - u
// is least in ‖·‖₂, rows in units of their size, and the same combination of their images. For a linear G that is
// GMRES; for a piecewise linear one it is so once the pieces are settled.
//
// The least squares problem is solved by normal equations, to which an iterate adds one row: columns have length one
// there, and directions that are no more than rounding are left out, so that a bad combination costs iterations and no
// accuracy. Cost: two passes over `depth` + 4 iterates, in parallel; the same bits for any number of threads.
// Source: [Walker & Ni 2011] H. F. Walker, P. Ni. Anderson acceleration for fixed-point iterations. SIAM J. Numer.
// Anal. 49.
class AndersonAcceleration {
 public:
  // `workers` must outlive it.
  AndersonAcceleration(int depth, Workers& workers) : depth_(depth), workers_(workers) {}

  // Replaces `image` = G(u) by the next iterate; depth 0 keeps it. `size` holds the size of each row.
  void Accelerate(const Matrix& u, const Vector& size, Matrix& image);

 private:
  // The changes from one iterate to the next.
  struct Step {
    Matrix residual, image;
  };

  // Starts with the iterate `u`, or replaces the oldest step by that to `u`; fills products_ and right_.
  void AddStep(const Matrix& u, const Vector& unit, const Matrix& image);
  Vector Weights() const;

  Index depth_;
  Workers& workers_;
  Matrix last_residual_, last_image_;
  std::vector<Step> steps_;  // at most depth_, in any order
  Index newest_ = -1;        // the one that was written last
  Matrix products_;          // of the residuals of steps
  Vector right_;             // their products with the last residual
};

}  // namespace dlcs

#endif  // DLCS_CORE_ITERATION_ANDERSON_H_
