// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/basis/polish.h"

#include <cmath>
#include <vector>

#include "core/lcp/basis/solution_function.h"
#include "core/lcp/basis/tolerance.h"
#include "core/linalg/equilibration.h"
#include "core/linalg/panel_lu.h"

namespace dlcs {
namespace {

// In units in which entries of matrices are of size one, rounding may explain components that are smaller than this
// beside the largest one, and a basis with a smaller reciprocal condition may be singular.
constexpr double kNoise = kWorkingPrecision;

long double ImageOfRow(const Matrix& M, const Vector& q, Index i, const Vector& y) {
  long double w = q[i];
  for (Index j = 0; j < y.size(); ++j) w += static_cast<long double>(M(i, j)) * static_cast<long double>(y[j]);
  return w;
}

bool IsSolution(const Matrix& M, const Vector& q, const Vector& y) {
  const Vector size = q.cwiseAbs() + M.cwiseAbs() * y;
  for (Index i = 0; i < y.size(); ++i) {
    const auto w = static_cast<double>(ImageOfRow(M, q, i, y));
    if (!(y[i] >= 0) || !(w >= -kRowRounding * size[i]) || (y[i] > 0 && !(w <= kRowRounding * size[i]))) return false;
  }
  return true;
}

// Returns y with its smallest components set to zero if that is a solution too. In units in which the entries of M are
// of size one, these components are so much smaller than the others that they may be zeros with rounding errors.
Vector WithoutNoise(const Matrix& M, const Vector& q, const Vector& y) {
  const Vector scaled = y.cwiseQuotient(EquilibrateRowsAndColumns(M).column);
  const double noise = kNoise * scaled.lpNorm<Eigen::Infinity>();
  if (!(scaled.array() > 0 && scaled.array() <= noise).any()) return y;
  const Vector cut = (scaled.array() <= noise).select(0, y);
  return IsSolution(M, q, cut) ? cut : y;
}

// y_J := y_J - M_JJ⁻¹ w_J, a few times. False where M_JJ is nearly singular.
bool SolveAgain(const Matrix& M, const Vector& q, const std::vector<Index>& J, Vector& y) {
  constexpr int kRounds = 3;
  const Equilibration scale = EquilibrateRowsAndColumns(M(J, J));
  const PanelLu lu(Scaled(M(J, J), scale));
  if (!(lu.ReciprocalCondition() > kNoise)) return false;
  Vector residual(static_cast<Index>(J.size()));
  for (int round = 0; round < kRounds; ++round) {
    for (Index p = 0; p < residual.size(); ++p)
      residual[p] = scale.row[p] * static_cast<double>(ImageOfRow(M, q, J[static_cast<std::size_t>(p)], y));
    y(J) -= scale.column.cwiseProduct(lu.Solve(residual).col(0));
  }
  return y.allFinite();
}

}  // namespace

void PolishSolution(const Matrix& M, const Vector& q, Vector& y) {
  y = WithoutNoise(M, q, y);
  const std::vector<Index> J = FindIndexSets(M, q, y).J;
  Vector polished = Vector::Zero(y.size());
  for (const Index i : J) polished[i] = y[i];
  if (!J.empty() && !SolveAgain(M, q, J, polished)) return;
  for (const Index i : J) {
    if (!(std::abs(polished[i] - y[i]) <= kClearDifference * y[i])) return;
  }
  if (IsSolution(M, q, polished)) y = polished;
}

}  // namespace dlcs
