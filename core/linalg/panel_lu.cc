// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/panel_lu.h"

#include <Eigen/LU>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/linalg/norms.h"
#include "core/linalg/panel_product.h"

namespace dlcs {
namespace {

// Eigen's own elimination takes some milliseconds up to here.
constexpr Index kWhole = 256;
constexpr Index kPanel = 32;

void ExchangeRows(Eigen::Ref<Matrix> matrix, Index one, Index other, std::vector<Index>& source) {
  if (one == other) return;
  matrix.row(one).swap(matrix.row(other));
  std::swap(source[static_cast<std::size_t>(one)], source[static_cast<std::size_t>(other)]);
}

// Eliminates the columns [begin, end) of what is below the rows done, without touching the columns behind.
void FactorPanel(Eigen::Ref<Matrix> matrix, Index begin, Index end, std::vector<Index>& source) {
  const Index size = matrix.rows();
  for (Index p = begin; p < end; ++p) {
    const Index below = size - p - 1;
    Index pivot_row = 0;
    matrix.col(p).tail(below + 1).cwiseAbs().maxCoeff(&pivot_row);
    ExchangeRows(matrix, p, p + pivot_row, source);
    if (matrix(p, p) == 0) continue;
    matrix.col(p).tail(below) /= matrix(p, p);
    matrix.block(p + 1, p + 1, below, end - p - 1).noalias() -=
        matrix.col(p).tail(below) * matrix.row(p).segment(p + 1, end - p - 1);
  }
}

}  // namespace

void FactorInPanels(Eigen::Ref<Matrix> matrix, std::vector<Index>& source) {
  const Index size = matrix.rows();
  source.resize(static_cast<std::size_t>(size));
  if (size <= kWhole) {
    const Eigen::PartialPivLU<Eigen::Ref<Matrix>> in_place(matrix);
    const auto& target = in_place.permutationP().indices();  // row i went to row target[i]
    for (Index i = 0; i < size; ++i) source[static_cast<std::size_t>(target[i])] = i;
    return;
  }
  std::iota(source.begin(), source.end(), Index{0});
  for (Index begin = 0; begin < size; begin += kPanel) {
    LookForStop();
    const Index end = std::min(size, begin + kPanel), width = end - begin, behind = size - end;
    FactorPanel(matrix, begin, end, source);
    if (behind == 0) break;
    auto upper = matrix.block(begin, end, width, behind);
    matrix.block(begin, begin, width, width).triangularView<Eigen::UnitLower>().solveInPlace(upper);
    matrix.bottomRightCorner(behind, behind).noalias() -= matrix.block(end, begin, behind, width) * upper;
  }
}

PanelLu::PanelLu(Matrix matrix) : norm_(InfinityNorm(matrix.transpose())), lu_(std::move(matrix)) {
  FactorInPanels(lu_, source_);
}

Vector PanelLu::SolveTransposed(Vector x) const {
  lu_.transpose().triangularView<Eigen::Lower>().solveInPlace(x);
  lu_.transpose().triangularView<Eigen::UnitUpper>().solveInPlace(x);
  Vector solution(x.size());
  for (Index p = 0; p < x.size(); ++p) solution[source_[static_cast<std::size_t>(p)]] = x[p];
  return solution;
}

double PanelLu::ReciprocalCondition() const {
  constexpr int kMaxSteps = 5;
  const Index size = lu_.rows();
  if (size == 0) return 1;
  double norm_of_inverse = 0;
  Vector x = Vector::Constant(size, 1 / static_cast<double>(size));
  for (int step = 0; step < kMaxSteps; ++step) {
    const Vector y = Solve(x);
    const double norm = y.lpNorm<1>();
    if (!std::isfinite(norm)) return 0;
    if (norm <= norm_of_inverse) break;
    norm_of_inverse = norm;
    // The slope of ‖matrix⁻¹ x‖₁; its largest entry names the unit vector where the norm may be larger still.
    const Vector slope = SolveTransposed(y.unaryExpr([](double value) { return value < 0 ? -1.0 : 1.0; }));
    Index largest = 0;
    if (!(slope.cwiseAbs().maxCoeff(&largest) > slope.dot(x))) break;
    x = Vector::Unit(size, largest);
  }
  const double condition = norm_ * norm_of_inverse;
  return std::isfinite(condition) && condition > 0 ? 1 / condition : 0;
}

Matrix PanelLu::Solve(const Eigen::Ref<const Matrix>& columns) const {
  Matrix solution(columns.rows(), columns.cols());
  for (Index p = 0; p < columns.rows(); ++p) solution.row(p) = columns.row(source_[static_cast<std::size_t>(p)]);
  ForPanels(columns.cols(), lu_.size(), [&](Index begin, Index count) {
    auto panel = solution.middleCols(begin, count);
    lu_.triangularView<Eigen::UnitLower>().solveInPlace(panel);
    lu_.triangularView<Eigen::Upper>().solveInPlace(panel);
  });
  return solution;
}

}  // namespace dlcs
