// SPDX-License-Identifier: Apache-2.0
#include "core/laplace/contour_blocks.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "core/laplace/range_contour.h"
#include "core/laplace/resolvent.h"

namespace dlcs {

TransferFunction DenseTransferFunction(const Problem& problem) {
  struct InSchurCoordinates {
    explicit InSchurCoordinates(const Problem& problem)
        : resolvent(problem.A), B(resolvent.to() * problem.B.Dense()), N(problem.N.Dense() * resolvent.from()) {}
    Resolvent resolvent;
    Eigen::MatrixXcd B, N;
  };
  const auto system = std::make_shared<const InSchurCoordinates>(problem);
  return {.value =
              [system](std::complex<double> z) {
                Eigen::MatrixXcd columns = system->B;
                system->resolvent.Solve(z, columns);
                return Eigen::MatrixXcd(system->N * columns);
              },
          .eigenvalues = system->resolvent.Eigenvalues()};
}

namespace {

using Complex = std::complex<double>;

// e^{-42} = 1e-18. Defective eigenvalues lose accuracy: each order of a pole costs a factor of 90.
constexpr double kAccuracyOfHats = 42;
// The double pole of a ramp at zero, close to the contour, adds two orders.
constexpr double kAccuracyOfRamps = 52;

// The transform of the hat whose response is K_k: the factor of H(z/h).
Complex HatTransform(Complex z, Index k) {
  if (k == 0) return std::exp(z) / (z * z);
  if (k == 1) return (std::exp(2.0 * z) - 2.0 * std::exp(z)) / (z * z);
  const Complex difference = 2.0 * std::sinh(z / 2.0) / z;  // Re z > -40: no overflow
  return std::exp(static_cast<double>(k) * z) * difference * difference;
}

}  // namespace

ContourBlocks::ContourBlocks(TransferFunction transfer, double step)
    : transfer_(std::move(transfer)), step_(step), eigenvalues_(step * transfer_.eigenvalues) {}

bool ContourBlocks::NextContour(Index n, Index first, Workers& workers, const std::stop_token& stop) {
  // Block k >= 2 is made of times k - 1 to k + 1; blocks 0 and 1, of 1 and 2, come with the first contour.
  const auto contour =
      FindRangeContour(static_cast<double>(std::max<Index>(first - 1, 1)), static_cast<double>(first + 1),
                       first == 0 ? kAccuracyOfRamps : kAccuracyOfHats, eigenvalues_);
  if (!contour) return false;
  nodes_ = contour->Nodes();
  const auto terms = static_cast<Index>(nodes_.size());
  values_.resize(n * n, 2 * terms);
  workers.ForBlocks(terms, 1, [&](Index, Index p, Index) {
    if (stop.stop_requested()) return;
    const Eigen::MatrixXcd value = nodes_[p].weight * transfer_.value(nodes_[p].z / step_);
    values_.col(2 * p) = value.real().reshaped();
    values_.col(2 * p + 1) = -value.imag().reshaped();
  });
  if (stop.stop_requested()) return false;
  end_ = static_cast<Index>(contour->end);
  ++contours_;
  factorizations_ += terms;
  return true;
}

bool ContourBlocks::Append(Index window, Workers& workers, const std::stop_token& stop, Matrix& blocks) {
  const Index n = blocks.rows();
  const Index first = blocks.cols() / n;
  if (first >= end_ && !NextContour(n, first, workers, stop)) return false;
  const Index count = std::min(window, end_) - first;
  const auto terms = static_cast<Index>(nodes_.size());
  blocks.conservativeResize(n, (first + count) * n);
  auto added = blocks.rightCols(count * n).reshaped(n * n, count);
  // K_k = Re Σ_p weight_p hat_k(z_p) H(z_p/h), as a real product: rows are the entries of a block.
  constexpr Index kBlocksAtOnce = 64;
  workers.ForBlocks(count, kBlocksAtOnce, [&](Index, Index begin, Index end) {
    Matrix hats(2 * terms, end - begin);
    for (Index k = begin; k < end; ++k) {
      for (Index p = 0; p < terms; ++p) {
        const Complex hat = HatTransform(nodes_[p].z, first + k);
        hats(2 * p, k - begin) = hat.real();
        hats(2 * p + 1, k - begin) = hat.imag();
      }
    }
    added.middleCols(begin, end - begin).noalias() = values_ * hats;
  });
  return true;
}

}  // namespace dlcs
