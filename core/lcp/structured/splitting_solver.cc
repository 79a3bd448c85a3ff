// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/structured/splitting_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/lcp/basis/tolerance.h"
#include "core/linalg/norms.h"
#include "core/linalg/simd/simd_dispatch.h"

namespace dlcs {

SplittingLcpSolver::SplittingLcpSolver(BandSplitting splitting)
    : product_(std::move(splitting.product)),
      diagonal_(std::move(splitting.diagonal)),
      factor_(splitting.B),
      basis_(static_cast<std::size_t>(splitting.B->size())),
      is_basic_(splitting.B->size()),
      y_(splitting.B->size()),
      w_(splitting.B->size()) {}

SplittingVerdict SplittingLcpSolver::Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                                           Eigen::Ref<Vector> y) {
  constexpr Index kMax = 60;
  constexpr double kSlowest = 0.7;  // of two residuals with the same basis
  constexpr int kPatience = 3;
  y_ = (y.array() > 0).select(y, 0);
  is_basic_ = (y.array() > 0).cast<double>();
  double last = 0;
  int patience = kPatience;
  for (iterations_ = 1; iterations_ <= kMax; ++iterations_) {
    product_(y_, w_);
    w_ += q;
    const Judgment seen = Judge(q, tolerance);
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

SplittingLcpSolver::Judgment SplittingLcpSolver::Judge(const Eigen::Ref<const Vector>& q,
                                                       const Eigen::Ref<const Vector>& tolerance) {
  constexpr Index kLanes = 16;
  double misses[kLanes] = {}, moves[kLanes] = {}, nonfinite[kLanes] = {}, residuals[kLanes] = {};
  RunWide([&misses, &moves, &nonfinite, &residuals, n = y_.size(), y_data = y_.data(), w_data = w_.data(),
           q_data = q.data(), tolerances = tolerance.data(), diagonals = diagonal_.data(),
           basic_data = is_basic_.data()]() DLCS_WIDE {
    const double* __restrict all_y = y_data;
    const double* __restrict all_w = w_data;
    const double* __restrict all_q = q_data;
    const double* __restrict all_tolerances = tolerances;
    const double* __restrict all_diagonals = diagonals;
    double* __restrict all_basic = basic_data;
    double miss[kLanes] = {}, move[kLanes] = {}, bad[kLanes] = {}, residual[kLanes] = {};
    const auto judge = [=, &miss, &move, &bad, &residual](Index i, Index l) DLCS_WIDE {
      const double w = all_w[i], basic = all_basic[i];
      const double allowed =
          all_tolerances[i] +
          kRowRounding * (std::abs(all_q[i]) + std::abs(w - all_q[i] - 2 * all_diagonals[i] * all_y[i]));
      const double below = w >= -allowed ? 0.0 : 1.0, above = w <= allowed ? 0.0 : 1.0;
      const double positive = all_y[i] == 0 ? 0.0 : 1.0;
      const double misses_it = below + positive * above;
      // An index of S moves if y_i = 0 < w_i, another one if its certificate fails.
      const double moves_it = basic > 0 ? (1 - positive) * above : (misses_it > 0 ? 1.0 : 0.0);
      const double size = (moves_it > 0 ? 1 - basic : basic) * std::abs(w);
      all_basic[i] = moves_it > 0 ? 1 - basic : basic;
      miss[l] += misses_it;
      move[l] += moves_it;
      bad[l] += 0 * w;  // an entry of y that is not finite makes one of w
      residual[l] = size > residual[l] ? size : residual[l];
    };
    Index i = 0;
    for (; i + kLanes <= n; i += kLanes) {
      for (Index l = 0; l < kLanes; ++l) judge(i + l, l);
    }
    for (; i < n; ++i) judge(i, 0);
    for (Index l = 0; l < kLanes; ++l) {
      misses[l] = miss[l];
      moves[l] = move[l];
      nonfinite[l] = bad[l];
      residuals[l] = residual[l];
    }
  });
  const auto sum_of = [](const double(&lanes)[kLanes]) { return std::accumulate(lanes, lanes + kLanes, 0.0); };
  Judgment seen;
  seen.finite = sum_of(nonfinite) == 0;
  seen.moved = sum_of(moves) > 0;
  seen.solved = seen.finite && sum_of(misses) == 0;
  seen.residual = *std::max_element(residuals, residuals + kLanes);
  return seen;
}

void SplittingLcpSolver::Correct() {
  for (Index i = 0; i < w_.size(); ++i) basis_[static_cast<std::size_t>(i)] = is_basic_[i] > 0;
  factor_.Factor(basis_);
  w_.array() *= is_basic_.array();
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

// ‖B⁻¹|K - B|‖_∞ if B is clearly an M-matrix, otherwise infinity. Each entry of B is that of K or zero, so the sums of
// sizes of their rows give |K - B| 1.
double RateOf(const BandMatrix& B, const Vector& sizes_of_K) {
  if (!BandFactor::IsClearlyMMatrix(B)) return std::numeric_limits<double>::infinity();
  BandFactor factor(std::make_shared<const BandMatrix>(B));
  factor.Factor(Basis(static_cast<std::size_t>(B.size()), 1));
  Vector v = (sizes_of_K - SumsOf(B).sizes).cwiseMax(0);
  factor.Solve(v);
  return MaxAbs(v);
}

// B with the entries of K outside of B added to its diagonal, if the result is clearly an M-matrix; otherwise B.
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
  constexpr double kEvenUnits = 64;
  if (!K.allFinite() || !(K.diagonal().maxCoeff() <= kEvenUnits * K.diagonal().minCoeff())) return std::nullopt;
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
                         .diagonal = K.diagonal(),
                         .rate = rate,
                         .bandwidth = bandwidth};
  }
  return std::nullopt;
}

}  // namespace dlcs
