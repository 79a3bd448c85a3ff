// SPDX-License-Identifier: Apache-2.0
// The kernel of the iteration in reduced space: how y now moves N x later.

#ifndef DLCS_CORE_LAPLACE_KERNEL_H_
#define DLCS_CORE_LAPLACE_KERNEL_H_

#include <stop_token>
#include <vector>

#include "core/laplace/toeplitz_convolution.h"
#include "core/methods/scheme.h"
#include "core/problem.h"

namespace dlcs {

// The blocks  K_0 = N h φ_2 B,  K_k = N E^{k-1} (E h φ_2 + h(φ_1 - φ_2)) B = N h E^{k-1} φ_1² B  (k >= 1)
// of an exp-PL step (φ at hA, E = φ_0): a hat function of y at node l moves q = N x + g at node j >= l by
// K_{j-l} y_l. Each block is the inverse Laplace transform of N (zI - A)⁻¹ B against a hat; for dense A the
// φ-functions give it to about 1e-15.
class Kernel {
 public:
  // `problem` and `scheme` (ExponentialPiecewiseLinear) must outlive the kernel.
  Kernel(const Problem& problem, const Scheme& scheme);

  // Makes blocks up to `window` - 1 available, fewer where `stop` is requested (looked at every block).
  // Cost: m²n per new block.
  void Reserve(Index window, const std::stop_token& stop);

  // Longest window worth taking: where the blocks would fill the memory (kMaxDoubles in all), or where they have
  // grown by kMaxGrowth (unstable A), so that rounding in an FFT stays far below the tolerance. Looks ahead no
  // farther than blocks are reserved.
  Index longest_window() const { return longest_window_; }

  // max over the reserved blocks of ‖K_k‖_∞ / h, for the first `window` of them.
  double Bound(Index window) const;

  ToeplitzConvolution& convolution() { return convolution_; }

 private:
  const Problem& problem_;
  const Scheme& scheme_;
  Matrix powers_;   // N E^{k} for the next block
  Matrix response_; // (E h φ_2 + h(φ_1 - φ_2)) B
  Matrix blocks_;
  Index count_ = 0;
  std::vector<double> bounds_;  // running maxima
  Index longest_window_;
  ToeplitzConvolution convolution_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LAPLACE_KERNEL_H_
