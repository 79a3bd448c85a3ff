// SPDX-License-Identifier: Apache-2.0

#include "core/laplace/toeplitz_convolution.h"

#include <algorithm>
#include <bit>
#include <complex>
#include <unsupported/Eigen/FFT>
#include <utility>
#include <vector>

#include "core/parallel/memory_pages.h"
#include "core/parallel/stop_scope.h"

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

Matrix ToeplitzConvolution::Apply(const Eigen::Ref<const Matrix>& blocks, const Matrix& d, Workers& workers) {
  return DirectIsFaster(order_, d.cols()) ? ApplyDirectly(blocks, d, workers) : ApplyByFft(blocks, d, workers);
}

Matrix ToeplitzConvolution::ApplyDirectly(const Eigen::Ref<const Matrix>& blocks, const Matrix& d,
                                          Workers& workers) const {
  const Index n = order_;
  const Index window = d.cols();
  Matrix r = Matrix::Zero(n, window);
  workers.ForBlocks(window, kColumnBlock, [&](Index, Index begin, Index end) {
    for (Index lag = 0; lag < end; ++lag) {
      LookForStop();
      const Index first = std::max(begin, lag);
      const auto block = blocks.middleCols(lag * n, n);
      if (n == 1) {
        r.middleCols(first, end - first) += block(0, 0) * d.middleCols(first - lag, end - first);
      } else {
        r.middleCols(first, end - first).noalias() += block * d.middleCols(first - lag, end - first);
      }
    }
  });
  return r;
}

const ToeplitzConvolution::Spectra& ToeplitzConvolution::SpectraOf(const Eigen::Ref<const Matrix>& blocks, Index length,
                                                                   Workers& workers) {
  const Index n = order_;
  const auto wanted = [&](Index padded) { return std::min(padded / 2, blocks.cols() / n); };
  std::erase_if(spectra_, [&](const auto& entry) { return entry.second.blocks != wanted(entry.first); });
  if (const auto found = spectra_.find(length); found != spectra_.end()) return found->second.values;
  const Index frequencies = length / 2 + 1, count = wanted(length);
  Spectra spectra(frequencies, n * n);
  AdviseHugePages(spectra.data(), static_cast<std::size_t>(spectra.size()) * sizeof(std::complex<double>));
  workers.ForBlocks(n * n, 4, [&](Index, Index begin, Index end) {
    Eigen::FFT<double> fft = MakeFft();
    std::vector<double> series(length);
    std::vector<std::complex<double>> transform;
    for (Index pair = begin; pair < end; ++pair) {
      std::fill(series.begin(), series.end(), 0.0);
      for (Index k = 0; k < count; ++k) series[k] = blocks(pair % n, k * n + pair / n);
      fft.fwd(transform, series);
      std::copy(transform.begin(), transform.begin() + frequencies, spectra.col(pair).data());
    }
  });
  return spectra_.emplace(length, KernelSpectra{count, std::move(spectra)}).first->second.values;
}

Matrix ToeplitzConvolution::ApplyByFft(const Eigen::Ref<const Matrix>& blocks, const Matrix& d, Workers& workers) {
  const Index n = order_;
  const Index window = d.cols();
  const Index length = PaddedLength(window);
  const Index frequencies = length / 2 + 1;
  const Spectra& kernel = SpectraOf(blocks, length, workers);

  Spectra transforms(frequencies, n);
  workers.ForBlocks(n, 1, [&](Index, Index i, Index) {
    Eigen::FFT<double> fft = MakeFft();
    std::vector<double> series(length, 0.0);
    std::vector<std::complex<double>> transform;
    for (Index k = 0; k < window; ++k) series[k] = d(i, k);
    fft.fwd(transform, series);
    std::copy(transform.begin(), transform.begin() + frequencies, transforms.col(i).data());
  });

  Matrix r(n, window);
  workers.ForBlocks(n, 1, [&](Index, Index i, Index) {
    std::vector<std::complex<double>> sum(frequencies);
    for (Index column = 0; column < n; ++column) {
      const std::complex<double>* factor = kernel.col(i + n * column).data();
      const std::complex<double>* transform = transforms.col(column).data();
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
