// SPDX-License-Identifier: Apache-2.0
// Secants of a map of vectors, for the next guess of its fixed point.

#ifndef DLCS_CORE_LCP_SECANTS_H_
#define DLCS_CORE_LCP_SECANTS_H_

#include <vector>

#include "core/types.h"

namespace dlcs {

// Anderson's acceleration of x = G(x): of all x + combinations of the steps so far, the image of the one whose residual
// G(x) - x is least, as if G were affine between them. Where G is affine that is GMRES, so a compact G takes few steps.
// Residual steps are kept orthonormal, the newest kDepth of them: 4 kDepth n operations a step, and no memory once it
// is made. Source: [Walker & Ni 2011] H. F. Walker, P. Ni. Anderson acceleration for fixed-point iterations. SIAM J.
// Numerical Analysis 49(4),
//         1715-1735.
class Secants {
 public:
  static constexpr Index kDepth = 5;

  explicit Secants(Index n) : residual_steps_(n, kDepth), image_steps_(n, kDepth), residual_(n), image_(n) {}

  void Forget() {
    is_first_ = true;
    kept_ = newest_ = 0;
  }
  // `image` = G(x).
  void Add(const Vector& x, const Vector& image);
  // The x to try next, after Add().
  void Next(Vector& x) const;

 private:
  Matrix residual_steps_;  // orthonormal columns
  Matrix image_steps_;     // the same combinations of the steps of G
  Vector residual_, image_, residual_step_, image_step_;
  bool is_first_ = true;
  Index kept_ = 0, newest_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_SECANTS_H_
