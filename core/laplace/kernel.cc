// SPDX-License-Identifier: Apache-2.0

#include "core/laplace/kernel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/format_number.h"
#include "core/linalg/norms.h"
#include "core/linalg/panel_product.h"
#include "core/linalg/weyl_sequence.h"

namespace dlcs {
namespace {

constexpr Index kMaxDoubles = Index{1} << 24;  // 128 MB of blocks, and up to four times that of their transforms
constexpr double kMaxGrowth = 1e4;             // an FFT then errs by 1e-11 of the smallest block at most

// A combination of the rows of N. Rows have different units, so each is divided by its size within the first two steps.
// Signs and weights are arbitrary, but irregular, so that errors do not cancel.
Vector CombinationOfRows(const Matrix& N, const Scheme& scheme) {
  Vector size = RowMaxAbs(Product(N, scheme.y_after)).cwiseMax(RowMaxAbs(Product(N, scheme.y_before)));
  Vector combination(size.size());
  for (Index i = 0; i < size.size(); ++i) {
    const double weight = 1 + WeylValue(static_cast<double>(i + 1));
    combination[i] = (i % 2 == 0 ? weight : -weight) / (size[i] > 0 ? size[i] : 1);
  }
  return combination;
}

}  // namespace

Kernel::Kernel(const Problem& problem, const Scheme& scheme, KernelSource source, Workers& workers,
               KernelRecord& record)
    : problem_(problem),
      scheme_(scheme),
      source_(source),
      workers_(workers),
      record_(record),
      recursion_(problem.N, scheme),
      combination_(CombinationOfRows(problem.N, scheme)),
      probe_(combination_.transpose() * problem.N.Dense(), scheme),
      norm_(scheme.step * InfinityNorm(problem.A)),
      blocks_(problem.num_constraints(), 0),
      longest_window_(std::max<Index>(1, kMaxDoubles / (problem.num_constraints() * problem.num_constraints()))),
      convolution_(problem.num_constraints()) {}

void Kernel::Reserve(Index window, const std::stop_token& stop) {
  window = std::min(window, longest_window_);
  if (window <= count_) return;
  reservations_.push_back(window);
  if (ContourPays(window)) ExtendByContour(window, stop);
  if (!contours_) ExtendByRecursion(window, stop);
}

Matrix Kernel::Respond(const Matrix& d) {
  return convolution_.Apply(blocks_.leftCols(count_ * problem_.num_constraints()), d, workers_);
}

// Compares costs in multiplications of a matrix product. Scalar work, of Schur forms and triangular solves, is
// converted to these; the factors were fitted for m from 30 to 200, n from 1 to 60 and windows from 64 to 2048. For
// dense A the two ways are close: for m = 200 and 2048 blocks contours take 1.6 s instead of 2.4 s with n = 60, the
// same time with n = 20, and more with n = 5. The number of threads must not matter, or the bits would depend on it.
bool Kernel::ContourPays(Index window) const {
  if (source_ != KernelSource::kAuto || contours_) return source_ != KernelSource::kPhiFunctions;
  const double m = static_cast<double>(problem_.num_states()), n = static_cast<double>(problem_.num_constraints());
  const double blocks = static_cast<double>(window - count_);
  const double nodes = 50 * std::ceil(std::log2(static_cast<double>(window)) / 4);
  const double recursion = (2 * m * m * n + 2 * m * n * n) * blocks;
  const double contours =
      100 * m * m * m + nodes * (12 * m * m * n + 8 * m * n * n) + (800 * n * n + 2 * m * m) * blocks;
  return recursion > contours;
}

void Kernel::ExtendByContour(Index window, const std::stop_token& stop) {
  if (!contours_) contours_.emplace(DenseTransferFunction(problem_), scheme_.step);
  while (count_ < window && !stop.stop_requested()) {
    if (blocks_.cols() == count_ * blocks_.rows() && !AppendBlocks(window, stop)) {
      if (stop.stop_requested()) return;
      return GiveContoursUp("an eigenvalue of A oscillates too fast over " + std::to_string(count_ + 1) + " steps of " +
                            FormatNumber(scheme_.step) + " for a contour with acceptable rounding");
    }
    const double deviation = Deviation(count_);
    record_.contour_error = NanMax(record_.contour_error, deviation);
    if (!(deviation <= kContourTolerance + RecursionError(count_))) {
      return GiveContoursUp("block " + std::to_string(count_) + " differs from the recursion by " +
                            FormatNumber(deviation) + " of the largest block");
    }
    if (!Accept()) return;
    ++record_.blocks_by_contour;
  }
}

bool Kernel::AppendBlocks(Index window, const std::stop_token& stop) {
  const Index contours = contours_->contours(), factorizations = contours_->factorizations();
  const bool appended = contours_->Append(window, workers_, stop, blocks_);
  record_.contours += contours_->contours() - contours;
  record_.factorizations += contours_->factorizations() - factorizations;
  return appended;
}

void Kernel::GiveContoursUp(const std::string& why) {
  record_.fallback = why;
  source_ = KernelSource::kPhiFunctions;
  contours_.reset();
}

void Kernel::ExtendByRecursion(Index window, const std::stop_token& stop) {
  const Index n = problem_.num_constraints();
  blocks_.conservativeResize(n, window * n);
  while (recursion_.next() < count_ && !stop.stop_requested()) recursion_.Next();  // blocks that came by contours
  while (count_ < window && !stop.stop_requested()) {
    blocks_.middleCols(count_ * n, n) = recursion_.Next();
    if (!Accept()) break;
    ++record_.blocks_by_recursion;
  }
  blocks_.conservativeResize(n, count_ * n);
}

bool Kernel::Accept() {
  const Index n = problem_.num_constraints();
  const double bound = InfinityNorm(blocks_.middleCols(count_ * n, n)) / scheme_.step;
  const double largest = bounds_.empty() ? bound : NanMax(bounds_.back(), bound);
  // The first two blocks are the response within a step or two; growth beyond is that of e^{At}.
  if (count_ >= 2 && !(largest <= kMaxGrowth * bounds_[1])) {
    longest_window_ = count_;
    return false;
  }
  bounds_.push_back(largest);
  ++count_;
  return true;
}

double Kernel::RecursionError(Index k) const {
  return std::numeric_limits<double>::epsilon() * norm_ * static_cast<double>(k + 1);
}

double Kernel::Deviation(Index k) {
  const Index n = problem_.num_constraints();
  Matrix expected;
  while (probe_.next() <= k) expected = probe_.Next();
  const Matrix block = blocks_.middleCols(k * n, n);
  const Matrix size = combination_.cwiseAbs().transpose() * block.cwiseAbs();
  const Matrix difference = combination_.transpose() * block - expected;
  probed_size_ = NanMax(probed_size_, MaxAbs(size));
  return probed_size_ == 0 ? MaxAbs(difference) : MaxAbs(difference) / probed_size_;
}

double Kernel::Bound(Index window) const {
  return bounds_.empty() ? 0 : bounds_[std::min<size_t>(window, bounds_.size()) - 1];
}

}  // namespace dlcs
