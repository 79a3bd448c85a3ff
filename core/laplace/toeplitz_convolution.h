// SPDX-License-Identifier: Apache-2.0
// The block-Toeplitz product in time that one iteration costs.

#ifndef DLCS_CORE_LAPLACE_TOEPLITZ_CONVOLUTION_H_
#define DLCS_CORE_LAPLACE_TOEPLITZ_CONVOLUTION_H_

#include <complex>
#include <map>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/types.h"

namespace dlcs {

// Computes  r_j = Σ_{l=0..j} K_{j-l} d_l,  j = 0..W-1, for square blocks K_0, K_1, ... of order n.
//
// Windows that are short for their order are summed directly, n²W²/2 multiplications; others by real FFTs of padded
// length (a power of two >= 2W), O(nW log W + n²W), with the transforms of the kernel kept per length.
// The bits of the result depend on W and the data alone, not on the number of threads.
// Accuracy of the FFT: some 1e-15 times max‖K‖ · Σ‖d‖, relative to the largest entries, not to each one.
class ToeplitzConvolution {
 public:
  explicit ToeplitzConvolution(Index order) : order_(order) {}

  // Replaces the kernel by `blocks`; column-major n × n blocks side by side (n × n·count).
  void SetKernel(const Matrix& blocks);
  Index num_blocks() const { return blocks_.cols() / order_; }

  // `d` is n × W with W <= num_blocks(); returns r, n × W.
  Matrix Apply(const Matrix& d, Workers& workers);

 private:
  Matrix ApplyDirectly(const Matrix& d, Workers& workers) const;
  Matrix ApplyByFft(const Matrix& d, Workers& workers);

  using Spectrum = std::vector<std::complex<double>>;  // [pair · frequencies + frequency], pair = row + n·column
  // The transforms of the first length/2 blocks: enough for any window of that length.
  const Spectrum& KernelSpectrum(Index length, Workers& workers);

  Index order_;
  Matrix blocks_;
  std::map<Index, Spectrum> spectra_;  // by padded length
};

}  // namespace dlcs

#endif  // DLCS_CORE_LAPLACE_TOEPLITZ_CONVOLUTION_H_
