// SPDX-License-Identifier: Apache-2.0
// The blocks of the kernel by inversion of the transfer function.

#ifndef DLCS_CORE_LAPLACE_CONTOUR_BLOCKS_H_
#define DLCS_CORE_LAPLACE_CONTOUR_BLOCKS_H_

#include <complex>
#include <functional>
#include <stop_token>
#include <vector>

#include "core/laplace/contour.h"
#include "core/parallel/parallel.h"
#include "core/problem/problem.h"
#include "core/types.h"

namespace dlcs {

// H(z) = N (zI - A)⁻¹ B, n × n, and its poles. This is all that the contours need to know of a system, whatever the
// structure of A: one factorization of zI - A for each z.
struct TransferFunction {
  // Safe to call from several threads at once. Not finite where z is an eigenvalue.
  std::function<Eigen::MatrixXcd(std::complex<double> z)> value;
  Eigen::VectorXcd eigenvalues;  // of A, or points whose convex hull with their conjugates holds them
};

// For dense A: one complex Schur form, some 100 m³, then O(m²n) for each z.
TransferFunction DenseTransferFunction(const Problem& problem);

// The blocks K_0, K_1, ... of core/laplace/kernel.h for steps of length h, by contours round zero and the spectrum
// of hA:
//
//     K_0 = 1/(2πi) ∫ e^z z⁻² H(z/h) dz,     K_1 = 1/(2πi) ∫ (e^{2z} - 2e^z) z⁻² H(z/h) dz,
//     K_k = 1/(2πi) ∫ e^{kz} (2 sinh(z/2)/z)² H(z/h) dz       for k >= 2,
//
// since a hat is a second difference of ramps. One contour covers a range of times k - 1 ... k + 1, up to 16 times its
// first (core/laplace/range_contour.h), with about 50 values of H. So W blocks cost 50 log_16 W factorizations, no
// power or exponential of A, and then 200 n² multiplications per block.
class ContourBlocks {
 public:
  ContourBlocks(TransferFunction transfer, double step);

  // Appends blocks to `blocks` (n × n each, side by side), which holds all earlier blocks: up to block `window` - 1, or
  // up to the last one that the contour covers. Returns false and does not change `blocks` if the spectrum has no
  // contour for the next times, or if `stop` was requested (checked at every factorization). The accuracy of the blocks
  // is not checked here. Threads: those of `workers`; same bits for any number.
  bool Append(Index window, Workers& workers, const std::stop_token& stop, Matrix& blocks);

  Index contours() const { return contours_; }
  Index factorizations() const { return factorizations_; }

 private:
  // Makes the contour for the blocks from `first` on; false as Append().
  bool NextContour(Index n, Index first, Workers& workers, const std::stop_token& stop);

  TransferFunction transfer_;
  double step_;
  Eigen::VectorXcd eigenvalues_;  // of hA
  Index end_ = 0;                 // the first block that the contour does not cover
  std::vector<ContourNode> nodes_;
  Matrix values_;  // weight H(z/h) for each node, real part and negative imaginary part, a block in a column
  Index contours_ = 0;
  Index factorizations_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LAPLACE_CONTOUR_BLOCKS_H_
