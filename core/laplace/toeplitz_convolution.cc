// SPDX-License-Identifier: Apache-2.0

#include "core/laplace/toeplitz_convolution.h"

#include <algorithm>
#include <bit>
#include <unsupported/Eigen/FFT>
#include <utility>

namespace dlcs {
namespace {

// Padded length of the transforms for a window.
Index PaddedLength(Index window) { return static_cast<Index>(std::bit_ceil(static_cast<size_t>(2 * window))); }

// Measured for n = 1, 2, 4, 8, 30 and 200: direct sums win below 256 steps for scalars, below 64 for all blocks.
bool DirectIsFaster(Index order, Index window) { return window < (order == 1 ? 256 : 64); }

// Columns of the result that one task sums.
constexpr Index kColumnBlock = 16;

Eigen::FFT<double> MakeFft() {
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  return fft;
}

}  // namespace

void ToeplitzConvolution::SetKernel(const Matrix& blocks) {
  blocks_ = blocks;
  spectra_.clear();
}

Matrix ToeplitzConvolution::Apply(const Matrix& d, Workers& workers) {
  return DirectIsFaster(order_, d.cols()) ? ApplyDirectly(d, workers) : ApplyByFft(d, workers);
}

Matrix ToeplitzConvolution::ApplyDirectly(const Matrix& d, Workers& workers) const {
  const Index n = order_;
  const Index window = d.cols();
  Matrix r = Matrix::Zero(n, window);
  workers.ForBlocks(window, kColumnBlock, [&](Index, Index begin, Index end) {
    for (Index lag = 0; lag < end; ++lag) {
      const Index first = std::max(begin, lag);
      const auto block = blocks_.middleCols(lag * n, n);
      if (n == 1) {
        r.middleCols(first, end - first) += block(0, 0) * d.middleCols(first - lag, end - first);
      } else {
        r.middleCols(first, end - first).noalias() += block * d.middleCols(first - lag, end - first);
      }
    }
  });
  return r;
}

const ToeplitzConvolution::Spectrum& ToeplitzConvolution::KernelSpectrum(Index length, Workers& workers) {
  const auto found = spectra_.find(length);
  if (found != spectra_.end()) return found->second;
  const Index n = order_;
  const Index frequencies = length / 2 + 1;
  const Index blocks = std::min(length / 2, num_blocks());
  Spectrum spectrum(static_cast<size_t>(n * n * frequencies));
  workers.ForBlocks(n * n, 4, [&](Index, Index begin, Index end) {
    Eigen::FFT<double> fft = MakeFft();
    std::vector<double> series(length);
    std::vector<std::complex<double>> transform;
    for (Index pair = begin; pair < end; ++pair) {
      std::fill(series.begin(), series.end(), 0.0);
      for (Index k = 0; k < blocks; ++k) series[k] = blocks_(pair % n, k * n + pair / n);
      fft.fwd(transform, series);
      std::copy(transform.begin(), transform.begin() + frequencies, spectrum.begin() + pair * frequencies);
    }
  });
  return spectra_.emplace(length, std::move(spectrum)).first->second;
}

Matrix ToeplitzConvolution::ApplyByFft(const Matrix& d, Workers& workers) {
  const Index n = order_;
  const Index window = d.cols();
  const Index length = PaddedLength(window);
  const Index frequencies = length / 2 + 1;
  const Spectrum& kernel = KernelSpectrum(length, workers);

  Spectrum transforms(static_cast<size_t>(n * frequencies));
  workers.ForBlocks(n, 1, [&](Index, Index i, Index) {
    Eigen::FFT<double> fft = MakeFft();
    std::vector<double> series(length, 0.0);
    std::vector<std::complex<double>> transform;
    for (Index k = 0; k < window; ++k) series[k] = d(i, k);
    fft.fwd(transform, series);
    std::copy(transform.begin(), transform.begin() + frequencies, transforms.begin() + i * frequencies);
  });

  Matrix r(n, window);
  workers.ForBlocks(n, 1, [&](Index, Index i, Index) {
    std::vector<std::complex<double>> sum(frequencies);
    for (Index column = 0; column < n; ++column) {
      const std::complex<double>* factor = kernel.data() + (i + n * column) * frequencies;
      const std::complex<double>* transform = transforms.data() + column * frequencies;
      for (Index k = 0; k < frequencies; ++k) sum[k] += factor[k] * transform[k];
    }
    Eigen::FFT<double> fft = MakeFft();
    std::vector<double> series;
    fft.inv(series, sum, length);
    for (Index k = 0; k < window; ++k) r(i, k) = series[k];
  });
  return r;
}

}  // namespace dlcs
