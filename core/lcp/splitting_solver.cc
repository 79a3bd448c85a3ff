// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/splitting_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/linalg/norms.h"
#include "core/linalg/wide_loops.h"

namespace dlcs {
namespace {

// The largest entry of y >= 0, in lanes.
double Largest(const Vector& y) {
  constexpr Index kLanes = 16;
  double lanes[kLanes] = {};
  RunWide([&lanes, y = y.data(), n = y.size()]() DLCS_WIDE {
    double largest[kLanes] = {};
    for (Index i = 0; i + kLanes <= n; i += kLanes) {
      for (Index l = 0; l < kLanes; ++l) largest[l] = y[i + l] > largest[l] ? y[i + l] : largest[l];
    }
    for (Index i = n - n % kLanes; i < n; ++i) largest[0] = y[i] > largest[0] ? y[i] : largest[0];
    for (Index l = 0; l < kLanes; ++l) lanes[l] = largest[l];
  });
  return *std::max_element(lanes, lanes + kLanes);
}

}  // namespace

SplittingLcpSolver::SplittingLcpSolver(BandSplitting splitting)
    : product_(std::move(splitting.product)),
      row_sums_(std::move(splitting.row_sums)),
      factor_(splitting.B),
      basis_(static_cast<std::size_t>(splitting.B->size())),
      y_(splitting.B->size()),
      w_(splitting.B->size()) {}

SplittingVerdict SplittingLcpSolver::Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                                           Eigen::Ref<Vector> y) {
  constexpr Index kMost = 60;
  constexpr double kSlowest = 0.7;  // of two residuals with the same basis
  constexpr int kPatience = 3;
  for (Index i = 0; i < y.size(); ++i) {
    basis_[static_cast<std::size_t>(i)] = y[i] > 0;
    y_[i] = y[i] > 0 ? y[i] : 0;
  }
  double last = 0;
  int patience = kPatience;
  for (iterations_ = 1; iterations_ <= kMost; ++iterations_) {
    product_(y_, w_);
    w_ += q;
    const Judgement seen = Judge(q, tolerance);
    if (seen.solved) {
      y = y_;
      return SplittingVerdict::kSolved;
    }
    if (!seen.finite) return SplittingVerdict::kFailed;
    patience = seen.moved || last == 0 || seen.residual <= kSlowest * last ? kPatience : patience - 1;
    if (patience == 0) return SplittingVerdict::kNotContracting;
    last = seen.moved ? 0 : seen.residual;
    Correct();
  }
  return SplittingVerdict::kNotContracting;
}

SplittingLcpSolver::Judgement SplittingLcpSolver::Judge(const Eigen::Ref<const Vector>& q,
                                                        const Eigen::Ref<const Vector>& tolerance) {
  constexpr double kRounding = 1e-14;
  constexpr double kLargest = std::numeric_limits<double>::max();
  const double largest = Largest(y_);
  Judgement seen;
  for (Index i = 0; i < y_.size(); ++i) {
    const double w = w_[i], allowed = tolerance[i] + kRounding * (std::abs(q[i]) + row_sums_[i] * largest);
    std::uint8_t& basic = basis_[static_cast<std::size_t>(i)];
    const bool is_zero = y_[i] == 0;
    seen.finite = seen.finite && std::abs(w) <= kLargest;  // an entry of y that is not makes one of w
    const bool good = w >= -allowed && (is_zero || w <= allowed);
    seen.solved = seen.solved && good;
    const bool moves = basic ? is_zero && w > allowed : !good;
    basic ^= static_cast<std::uint8_t>(moves);
    seen.moved = seen.moved || moves;
    if (basic && std::abs(w) > seen.residual) seen.residual = std::abs(w);
  }
  seen.solved = seen.solved && seen.finite;
  return seen;
}

void SplittingLcpSolver::Correct() {
  factor_.Factor(basis_);
  for (Index i = 0; i < w_.size(); ++i) w_[i] = basis_[static_cast<std::size_t>(i)] ? w_[i] : 0;
  factor_.Solve(w_);
  y_ = (y_ - w_).cwiseMax(0);
}

namespace {

// K's entries within `bandwidth`, without positive ones off the diagonal.
BandMatrix NonpositiveBand(const Matrix& K, Index bandwidth) {
  BandMatrix B(K, bandwidth);
  for (Index i = 0; i < B.size(); ++i) {
    double* const row = B.Row(i);
    for (Index d = -bandwidth; d <= bandwidth; ++d) row[d] = d == 0 ? row[d] : std::min(row[d], 0.0);
  }
  return B;
}

struct RowSums {
  Vector sizes, sums;  // of |K| and K
};
RowSums SumsOf(const BandMatrix& B) {
  RowSums result{Vector::Zero(B.size()), Vector::Zero(B.size())};
  for (Index i = 0; i < B.size(); ++i) {
    for (Index d = -B.bandwidth(); d <= B.bandwidth(); ++d) {
      result.sizes[i] += std::abs(B.Row(i)[d]);
      result.sums[i] += B.Row(i)[d];
    }
  }
  return result;
}

// ‖B⁻¹|K - B|‖_∞ where B is clearly an M-matrix, otherwise infinity. B agrees with K or is zero: the sizes of rows
// tell.
double RateOf(const BandMatrix& B, const Vector& sizes_of_K) {
  if (!BandFactor::IsClearlyMMatrix(B)) return std::numeric_limits<double>::infinity();
  BandFactor factor(std::make_shared<const BandMatrix>(B));
  factor.Factor(Basis(static_cast<std::size_t>(B.size()), 1));
  Vector v = (sizes_of_K - SumsOf(B).sizes).cwiseMax(0);
  factor.Solve(v);
  return MaxAbs(v);
}

// B with what K has beyond it added to the diagonal, where that leaves it clearly an M-matrix.
BandMatrix WithRowSums(const BandMatrix& B, const Vector& sums_of_K) {
  BandMatrix lumped = B;
  const Vector left_out = sums_of_K - SumsOf(B).sums;
  for (Index i = 0; i < B.size(); ++i) lumped.Row(i)[0] += left_out[i];
  return BandFactor::IsClearlyMMatrix(lumped) ? lumped : B;
}

}  // namespace

std::optional<BandSplitting> SplitOffBand(const Matrix& K, double largest_rate) {
  constexpr double kGoodRate = 3e-4;
  constexpr Index kWidest = 64;
  if (!K.allFinite()) return std::nullopt;
  const Index bandwidth = BandwidthUpToRounding(K);
  const RowSums of_K = SumsOf(BandMatrix(K, std::min(bandwidth, K.rows() - 1)));
  for (const Index width : {8, 16, 24, 32, 48, 64}) {  // narrower ones cost as much, and more rounds
    const Index b = std::min(width, bandwidth);
    const bool is_last = b == bandwidth || b == kWidest;
    const BandMatrix B = NonpositiveBand(K, b);
    const double rate = RateOf(B, of_K.sizes);
    if (!is_last && !(rate <= kGoodRate)) continue;
    if (!(rate <= largest_rate)) return std::nullopt;
    return BandSplitting{.B = std::make_shared<const BandMatrix>(WithRowSums(B, of_K.sums)),
                         .product = BandProduct(K, bandwidth),
                         .row_sums = of_K.sizes,
                         .rate = rate,
                         .bandwidth = bandwidth};
  }
  return std::nullopt;
}

}  // namespace dlcs
