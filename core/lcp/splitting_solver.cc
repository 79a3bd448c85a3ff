// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/splitting_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "core/linalg/norms.h"
#include "core/linalg/wide_loops.h"

namespace dlcs {

SplittingLcpSolver::SplittingLcpSolver(Tridiagonal T, Remainder remainder)
    : tridiagonal_(std::make_shared<const Tridiagonal>(T), nullptr),
      remainder_(std::move(remainder)),
      basis_(T.size()),
      y_(T.size()),
      shifted_q_(T.size()),
      lagged_(T.size()),
      current_(T.size()),
      difference_(T.size()),
      secants_(T.size()) {}

SplittingVerdict SplittingLcpSolver::Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                                           Eigen::Ref<Vector> y) {
  constexpr double kRounding = 1e-14;
  constexpr double kSlowest = 0.7;  // beyond that, eighty solves are not enough for twelve digits
  constexpr int kPatience = 3;      // ratios above it in a row: the first ones tell of the guess, not of the rate
  constexpr Index kPlain = 4;       // solves before secants, at the start and where those do not help
  constexpr Index kMost = 100;
  iterations_ = 0;
  rate_ = 0;
  secants_.Forget();
  y_ = y;
  for (std::size_t i = 0; i < basis_.size(); ++i) basis_[i] = y_[static_cast<Index>(i)] > 0;
  remainder_(y_, lagged_);
  double last_change = 0;
  Index plain = kPlain;  // solves without secants that are left
  for (int patience = kPatience; iterations_ < kMost;) {
    shifted_q_ = q + lagged_;
    ++iterations_;
    if (tridiagonal_.Solve(shifted_q_, tolerance, basis_, y_) != LcpVerdict::kSolved) return SplittingVerdict::kFailed;
    remainder_(y_, current_);
    const double rounding = kRounding * MaxAbs(current_);
    difference_ = lagged_ - current_;
    if ((difference_.array().abs() <= tolerance.array() + kRounding * q.array().abs() + rounding).all()) {
      y = y_;
      return SplittingVerdict::kSolved;
    }
    const double change = MaxAbs(difference_), ratio = change / last_change;
    if (plain > 0 && iterations_ > 1) rate_ = ratio;
    patience = iterations_ == 1 || ratio <= kSlowest ? kPatience : patience - 1;  // NaN counts as slow
    last_change = change;
    if (patience == 0) {
      if (plain > 0) return SplittingVerdict::kNotContracting;
      plain = kPlain;
      patience = kPatience;
      secants_.Forget();
    }
    if (plain <= kPlain - 2) secants_.Add(lagged_, current_);  // most are solved before
    if (plain > 0 && --plain > 0) {
      lagged_.swap(current_);
    } else {
      secants_.Next(lagged_);
    }
  }
  return SplittingVerdict::kNotContracting;
}

namespace {

// The diagonals of R, by their distance from the main one.
class Diagonals {
 public:
  // Of `K` without its three middle diagonals, as far as `bandwidth`.
  Diagonals(const Matrix& K, Index bandwidth)
      : n_(K.rows()),
        bandwidth_(bandwidth),
        above_(Matrix::Zero(n_, std::max<Index>(bandwidth - 1, 0))),
        below_(above_),
        padded_y_(Vector::Zero(n_ + 2 * bandwidth)) {
    for (Index d = 2; d <= bandwidth; ++d) {
      above_.col(d - 2).head(n_ - d) = K.diagonal(d);
      below_.col(d - 2).tail(n_ - d) = K.diagonal(-d);
    }
  }

  void operator()(const Vector& y, Vector& result) {
    padded_y_.segment(bandwidth_, n_) = y;  // zeros on both sides
    result.setZero(n_);
    const Index n = n_;
    double* __restrict sum = result.data();
    for (Index d = 2; d <= bandwidth_; ++d) {
      const double* __restrict above = above_.col(d - 2).data();
      const double* __restrict below = below_.col(d - 2).data();
      const double* after = padded_y_.data() + bandwidth_ + d;
      const double* before = padded_y_.data() + bandwidth_ - d;
      RunWide([=]() DLCS_WIDE {
        for (Index i = 0; i < n; ++i) sum[i] += above[i] * after[i] + below[i] * before[i];
      });
    }
  }

 private:
  Index n_, bandwidth_;
  Matrix above_, below_;  // K(i, i + d) and K(i, i - d) at (i, d - 2)
  Vector padded_y_;
};

// The least bandwidth beyond which no entry of K is more than the rounding of its row.
Index BandwidthUpToRounding(const Matrix& K) {
  constexpr double kRounding = 8 * std::numeric_limits<double>::epsilon();
  const Index n = K.rows();
  const Vector allowed = kRounding * K.cwiseAbs().rowwise().sum();
  for (Index d = n - 1; d > 1; --d) {
    const Index count = n - d;
    const bool negligible = (K.diagonal(d).array().abs() <= allowed.head(count).array()).all() &&
                            (K.diagonal(-d).array().abs() <= allowed.tail(count).array()).all();
    if (!negligible) return d;
  }
  return 1;
}

}  // namespace

std::optional<TridiagonalSplitting> SplitOffTridiagonal(const Matrix& K, double largest_rate) {
  const Index n = K.rows();
  TridiagonalSplitting result{Tridiagonal(n), {}, 0, BandwidthUpToRounding(K)};
  result.T.diagonal = K.diagonal();
  result.T.below.tail(n - 1) = K.diagonal(-1);
  result.T.above.head(n - 1) = K.diagonal(1);
  if (!K.allFinite() || !IsClearlyMMatrix(result.T)) return std::nullopt;
  // v = T⁻¹|R|1 solves LCP(-|R|1, T): it is >= 0.
  Vector row_sums = -K.cwiseAbs().rowwise().sum();
  row_sums += result.T.diagonal.cwiseAbs() + result.T.below.cwiseAbs() + result.T.above.cwiseAbs();
  Basis basis(n, 1);
  Vector v(n);
  TridiagonalSolver solver(std::make_shared<const Tridiagonal>(result.T), nullptr);
  if (solver.Solve(row_sums.cwiseMin(0), Vector::Zero(n), basis, v) != LcpVerdict::kSolved) return std::nullopt;
  result.rate = MaxAbs(v);
  if (!(result.rate <= largest_rate)) return std::nullopt;
  result.remainder = Diagonals(K, result.bandwidth);
  return result;
}

}  // namespace dlcs
