// SPDX-License-Identifier: Apache-2.0
#include "core/outputs/output_curves.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/discretization/resolved_cells.h"
#include "core/lcp/basis/tolerance.h"
#include "core/outputs/output_evaluator.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

class CurveMaker {
 public:
  CurveMaker(const Problem& problem, OutputEvaluator evaluator, Vector levels)
      : evaluator_(std::move(evaluator)), levels_(std::move(levels)), cells_(problem, {&problem.outputs.h}) {}

  // Cut where the cells of h end: on a cell h is nearly a polynomial, so that halving shows whether it is one. Where h
  // has more cells than a formula may have switching times, the rest is sampled.
  void Add(const TrajectoryPiece& piece) {
    double reached = piece.begin;
    while (reached < piece.end && cells_.CountUntil(reached) < kMaxSwitchingTimes) {
      LookForStop();
      reached = cells_.Reach(reached, piece.end);
    }
    if (StaysBelowLevels(piece)) return;
    double begin = piece.begin;
    for (const double end : cells_.EndsIn(piece.begin, reached)) {
      AddPolynomials(piece, begin, end, Vector());
      begin = end;
    }
    AddPolynomials(piece, begin, piece.end, Vector());
  }

  // Adds the part [begin, end] of `piece`, on which x and y are polynomials. `tail` is the tail of the part twice as
  // long, empty for the whole piece. If h is smooth, each halving lowers the tail by 2^-12. If it hardly falls, the
  // rest is rounding, or the kink of a y that is zero but for its error.
  void AddPolynomials(const TrajectoryPiece& piece, double begin, double end, const Vector& tail) {
    constexpr double kHardlyFalls = 0.1;
    LookForStop();
    const LegendreVector& nodes = GetLegendreBasis().nodes;
    CurvePiece curve{begin, end, {}};
    LegendreVector times;
    for (Index j = 0; j < kLegendreSize; ++j) times[j] = curve.t_of(nodes[j]);
    times[0] = begin;
    times[kLegendreSize - 1] = end;
    const Vector places = (2 / piece.length * (times.array() - piece.begin) - 1).cwiseMax(-1).cwiseMin(1);
    LegendreRows at;
    LegendreValuesAt(places, at);
    const Matrix x = Product(piece.x, at.leftCols(piece.x.cols()).transpose());
    const Matrix y = Product(piece.y, at.leftCols(piece.y.cols()).transpose()).cwiseMax(0);
    curve.z = evaluator_.Between(times, x, y);
    const Vector terms =
        evaluator_.TermsOf(x.col(0), y.col(0)).cwiseMax(evaluator_.TermsOf(x.rightCols(1), y.rightCols(1)));
    const Vector size = curve.z.cwiseAbs().rowwise().maxCoeff();
    largest_ = largest_.size() > 0 ? Vector(largest_.cwiseMax(size)) : size;
    curve.z = InterpolateAtNodes(curve.z);
    const Vector left = EstimateTail(curve.z);
    // The current of a switch is a small difference of large terms.
    const Vector enough = kCurveAccuracy * largest_ + kRowRounding * terms;
    const auto fits = left.array() <= enough.array();
    const bool is_enough = tail.size() > 0 ? (fits || left.array() >= kHardlyFalls * tail.array()).all() : fits.all();
    const double middle = curve.t_of(0);
    // Where an output overflows, shorter parts do not help.
    if (is_enough || !left.allFinite() || !(middle > begin && middle < end)) {
      curves_.push_back(std::move(curve));
      return;
    }
    AddPolynomials(piece, begin, middle, left);
    AddPolynomials(piece, middle, end, left);
  }

  void AddLines(const Solution& solution) {
    for (Index k = 0; k + 1 < static_cast<Index>(solution.times.size()); ++k) {
      LookForStop();
      const Vector begin = evaluator_.AtColumn(solution, k);
      const Vector end = evaluator_.BeforeColumn(solution, k + 1);
      CurvePiece curve{solution.times[static_cast<std::size_t>(k)], solution.times[static_cast<std::size_t>(k + 1)],
                       LegendreSeries::Zero(begin.size(), kLegendreSize)};
      curve.z.col(0) = (begin + end) / 2;
      curve.z.col(1) = (end - begin) / 2;
      curves_.push_back(std::move(curve));
    }
  }

  std::vector<CurvePiece> Take() { return std::move(curves_); }

 private:
  // Since no P_k exceeds 1. Where h varies and where a value is not finite, false.
  bool StaysBelowLevels(const TrajectoryPiece& piece) {
    if (levels_.size() == 0) return false;
    const std::optional<Matrix> z = evaluator_.Polynomials(piece.begin, piece.end, piece.x, piece.y);
    return z && (z->cwiseAbs().rowwise().sum().array() < levels_.array()).all();
  }

  template <typename Values>
  static Matrix Product(const Matrix& series, const Values& at) {
    if (series.rows() + series.cols() <= kSmallProduct) return series.lazyProduct(at);
    return series * at;
  }

  OutputEvaluator evaluator_;
  Vector levels_;
  ResolvedCells cells_;
  Vector largest_;  // the largest size of each output so far
  std::vector<CurvePiece> curves_;
};

}  // namespace

absl::StatusOr<std::vector<CurvePiece>> OutputCurves(const Problem& problem, const Solution& solution,
                                                     const std::vector<Index>& outputs, const Vector& levels) {
  auto evaluator = OutputEvaluator::Create(problem, outputs);
  if (!evaluator.ok()) return evaluator.status();
  CurveMaker maker(problem, *std::move(evaluator), levels);
  if (solution.pieces.empty()) {
    maker.AddLines(solution);
  } else {
    for (const TrajectoryPiece& piece : solution.pieces) {
      if (piece.end > piece.begin) maker.Add(piece);
    }
  }
  return maker.Take();
}

}  // namespace dlcs
