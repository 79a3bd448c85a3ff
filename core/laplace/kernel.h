// SPDX-License-Identifier: Apache-2.0
// The kernel of the iteration in reduced space: the effect of y on N x at later times.

#ifndef DLCS_CORE_LAPLACE_KERNEL_H_
#define DLCS_CORE_LAPLACE_KERNEL_H_

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/discretization/scheme.h"
#include "core/laplace/contour_blocks.h"
#include "core/laplace/toeplitz_convolution.h"
#include "core/parallel/parallel.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"
#include "core/types.h"

namespace dlcs {

// R h φ_2 B, R h E^{k-1} φ_1² B (k = 1, 2, ...), computed one after the other: the response of R x, at a node and at
// later ones, to a hat function of y at that node. R = N gives the blocks of the kernel, R = vᵀN one combination of
// their rows.
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

// The blocks K_0 = N h φ_2 B, K_k = N E^{k-1} (E h φ_2 + h(φ_1 - φ_2)) B = N h E^{k-1} φ_1² B (k >= 1) of an exp-PL
// step (φ at hA, E = φ_0): a hat function of y at node l moves q = N x + g at node j >= l by K_{j-l} y_l. They are
// computed in one of two ways, which agree to about 1e-13:
//
//   φ-functions   by the recursion that stands above, 2m²n multiplications a block, for any spectrum;
//   contours      each block is the inverse Laplace transform of N (zI - A)⁻¹ B against a hat
//                 (core/laplace/contour_blocks.h): a set-up, some 50 solves a contour, and then 200 n² a block.
//
// Each block from a contour is checked against the recursion for one combination of its rows (2m² per block). If they
// differ by more than kContourTolerance of the largest block and by more than the error of the recursion, or if the
// spectrum has no contour, all further blocks come from the recursion, and the record says why. (For large ‖hA‖ the
// recursion is less accurate: each squaring of the exponential doubles its rounding, and each block adds it again.)
class Kernel {
 public:
  // `source` chooses the way; kAuto changes to contours when the requested blocks would cost more by the recursion.
  // `problem`, `scheme` (ExponentialPiecewiseLinear), `workers` and `record` (which counts the blocks) must outlive the
  // kernel.
  Kernel(const Problem& problem, const Scheme& scheme, KernelSource source, Workers& workers, KernelRecord& record);

  static constexpr double kContourTolerance = 1e-12;

  // Computes the blocks up to `window` - 1, fewer if `stop` is requested (checked for every block).
  void Reserve(Index window, const std::stop_token& stop);

  // The arguments of the calls of Reserve() that computed blocks. The bits of later blocks depend on them, since a
  // contour covers a range of blocks: the same calls in the same order give the same kernel.
  const std::vector<Index>& reservations() const { return reservations_; }

  // The longest usable window. It is limited by memory (kMaxDoubles numbers in all blocks), and by the growth of the
  // blocks for unstable A (kMaxGrowth), so that the rounding of an FFT stays far below the tolerance. Growth is known
  // only for the reserved blocks.
  Index longest_window() const { return longest_window_; }

  // max over the reserved blocks of ‖K_k‖_∞ / h, for the first `window` of them.
  double Bound(Index window) const;

  // The reserved blocks, n × n each, side by side.
  const Matrix& blocks() const { return blocks_; }
  // The response of q to the deviations d (n × W) of y: Σ_{l=0..j} K_{j-l} d_l. At least W blocks must be reserved.
  Matrix Respond(const Matrix& d);

 private:
  bool ContourPays(Index window) const;
  // Both append blocks up to `window` - 1. ExtendByContour() stops, and gives contours up, where their blocks fail the
  // check.
  void ExtendByContour(Index window, const std::stop_token& stop);
  void ExtendByRecursion(Index window, const std::stop_token& stop);
  bool AppendBlocks(Index window, const std::stop_token& stop);
  void GiveContoursUp(const std::string& why);
  // Counts block count_ of `blocks_` as reserved. If the blocks have grown too much, ends the kernel there.
  bool Accept();
  // A bound of the rounding error of the recursion at block k, relative to the largest block.
  double RecursionError(Index k) const;
  // The deviation of block k from the recursion, relative to the largest block so far; called with k = 0, 1, ....
  double Deviation(Index k);

  const Problem& problem_;
  const Scheme& scheme_;
  KernelSource source_;
  Workers& workers_;
  KernelRecord& record_;
  HatResponse recursion_;
  Vector combination_;  // v: of the rows of a block, each in units of its size
  HatResponse probe_;   // vᵀK_k
  double probed_size_ = 0;
  double norm_;  // ‖hA‖_∞
  std::optional<ContourBlocks> contours_;
  Matrix blocks_;
  Index count_ = 0;
  std::vector<Index> reservations_;
  std::vector<double> bounds_;  // running maxima
  Index longest_window_;
  ToeplitzConvolution convolution_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LAPLACE_KERNEL_H_
