// SPDX-License-Identifier: Apache-2.0
// The block-Toeplitz product in time that one iteration costs.

#ifndef DLCS_CORE_LAPLACE_TOEPLITZ_CONVOLUTION_H_
#define DLCS_CORE_LAPLACE_TOEPLITZ_CONVOLUTION_H_

#include <map>

#include "core/parallel/parallel.h"
#include "core/types.h"

namespace dlcs {

// Computes  r_j = Σ_{l=0..j} K_{j-l} d_l,  j = 0..W-1, for square blocks K_0, K_1, ... of order n.
//
// The caller owns the blocks, and may append further ones between calls; existing ones must not change. Windows that
// are short for their order are summed directly, n²W²/2 multiplications; others by real FFTs of padded length (a power
// of two >= 2W), O(nW log W + n²W), with the transforms of the kernel kept per length. The bits of the result depend on
// W and the data alone, not on the number of threads. Checks for a stop (core/parallel/stop_scope.h) at every lag of a
// direct sum and at every row of a transformed one. Accuracy of the FFT: some 1e-15 times max‖K‖ · Σ‖d‖, relative to
// the largest entries, not to each one.
class ToeplitzConvolution {
 public:
  explicit ToeplitzConvolution(Index order) : order_(order) {}

  // `blocks` are column-major n × n blocks side by side (n × n·count), `d` is n × W with W <= count; returns r, n × W.
  Matrix Apply(const Eigen::Ref<const Matrix>& blocks, const Matrix& d, Workers& workers);

 private:
  Matrix ApplyDirectly(const Eigen::Ref<const Matrix>& blocks, const Matrix& d, Workers& workers) const;
  Matrix ApplyByFft(const Eigen::Ref<const Matrix>& blocks, const Matrix& d, Workers& workers);

  // One transform per column. They take up to hundreds of MB, so they are written once and not zero-initialized before.
  using Spectra = Eigen::MatrixXcd;
  struct KernelSpectra {
    Index blocks;    // the number of blocks transformed
    Spectra values;  // frequency × (row + n·column)
  };
  // The transforms of the first length/2 blocks: enough for any window of that length.
  const Spectra& SpectraOf(const Eigen::Ref<const Matrix>& blocks, Index length, Workers& workers);

  Index order_;
  std::map<Index, KernelSpectra> spectra_;  // by padded length
};

}  // namespace dlcs

#endif  // DLCS_CORE_LAPLACE_TOEPLITZ_CONVOLUTION_H_
