// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/pencil_form.h"

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/linalg/balance.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/decompositions.h"
#include "core/linalg/equilibration.h"
#include "core/linalg/graded_schur.h"
#include "core/linalg/norms.h"
#include "core/linalg/panel_lu.h"
#include "core/linalg/schur_form.h"
#include "core/linalg/structural_zeros.h"

namespace dlcs {
namespace {

// F - σE with columns in `units`, its rows scaled to size one, and the factors of that.
struct Shifted {
  double shift = 0;
  double condition = 0;  // the reciprocal
  Vector row_scale;
  std::optional<PanelLu> factors;
};

// The shift for which F - σE is the best conditioned.
Shifted ChooseShift(const Matrix& E, const Matrix& F, double duration) {
  Shifted best;
  for (const double times : {4.0, -4.0, 64.0}) {
    const double shift = times / duration;
    Matrix matrix = F - shift * E;
    const Vector scale = RowMaxAbs(matrix).unaryExpr([](double size) { return 1 / PowerOfTwo(size); });
    matrix = scale.asDiagonal() * matrix;
    PanelLu factors(std::move(matrix));
    const double condition = factors.ReciprocalCondition();
    if (!(condition > 4 * best.condition)) continue;  // the first one unless another is clearly better
    best = {shift, condition, scale, std::move(factors)};
  }
  return best;
}

// Joins the blocks in which `rows` have entries, and those between them. Balance() scales blocks against each other by
// their couplings alone, by 2^55 if a block is zero. Rows that differ in such a block would then be equal up to
// rounding, so the block gets units in which they differ. Returns the joined block, or -1 if there are no entries.
Index JoinBlocksOf(const Matrix& rows, BalancedMatrix& balanced) {
  // Half of the 53 bits: what stays loses no more than those, and what is scaled costs the others no more. A factor of
  // 4 moves two bits from one to the other.
  constexpr double kLost = 0x1p-26;
  std::vector<Index>& begins = balanced.begins;
  Matrix sizes = rows.cwiseAbs();
  for (Index k = 0; k < sizes.cols(); ++k) sizes.col(k) *= std::ldexp(1.0, balanced.exponents[k]);
  const Vector largest = RowMaxAbs(sizes);
  Index first = -1, last = -1;
  for (Index b = 0; b < balanced.num_blocks(); ++b) {
    const Vector of_block = RowMaxAbs(sizes.middleCols(begins[b], balanced.size_of_block(b)));
    if (of_block.isZero(0)) continue;
    if (first < 0) first = b;
    last = b;
    const double part = (largest.array() > 0).select(of_block.cwiseQuotient(largest), 0).maxCoeff();
    if (part >= kLost) continue;
    for (Index k = begins[b]; k < begins[b + 1]; ++k) balanced.exponents[k] -= std::ilogb(part);
  }
  if (first >= 0) begins.erase(begins.begin() + first + 1, begins.begin() + last + 1);
  return first;
}

}  // namespace

std::optional<PencilForm> ComputeExplicitForm(const Matrix& A, double duration) {
  std::optional<GradedSchurForm> form = ComputeGradedSchurForm(A, duration);
  if (!form) return std::nullopt;
  return PencilForm{{}, std::move(form->triangle), std::move(form->vectors), std::move(form->inverse), {}};
}

std::optional<PencilForm> ComputePencilForm(const Matrix& E, const Matrix& F, Index num_algebraic, const Vector& units,
                                            double duration) {
  if (!E.allFinite() || !F.allFinite()) return std::nullopt;
  const Index m = E.rows();
  Matrix E_in_units = E * units.asDiagonal(), F_in_units = F * units.asDiagonal();
  const Shifted shifted = ChooseShift(E_in_units, F_in_units, duration);
  if (!(shifted.condition > 0)) return std::nullopt;
  Matrix inverse_in_units = shifted.factors->Solve(Matrix(shifted.row_scale.asDiagonal()));
  ClearStructuralZeros(F_in_units - shifted.shift * E_in_units, inverse_in_units);
  Matrix G = inverse_in_units * E_in_units;
  if (!G.allFinite()) return std::nullopt;
  // Entries that are only the rounding of their terms are left out of the balancing. A coupling of 1e-30 between two
  // blocks would be scaled to the size of the blocks, and vectors would lose all digits.
  const BoundedSums<Matrix> sums{G, inverse_in_units.cwiseAbs() * E_in_units.cwiseAbs()};
  BalancedMatrix balanced = Balance(sums.WithoutRounding(RoundingOf(1)));
  const std::vector<Index>& order = balanced.order;
  const Matrix algebraic = F.bottomRows(num_algebraic)(Eigen::all, order);
  const Index constrained = JoinBlocksOf(F_in_units.bottomRows(num_algebraic)(Eigen::all, order), balanced);
  if (num_algebraic > 0 && constrained < 0) return std::nullopt;
  Vector further(m);
  for (Index k = 0; k < m; ++k) further[k] = std::ldexp(1.0, balanced.exponents[k]);
  const Vector scale = units(order).cwiseProduct(further);
  G = InUnitsOf(balanced, G);

  // Unitary coordinates of each block; in that of the algebraic rows the last ones are along these rows.
  Eigen::MatrixXcd U = Eigen::MatrixXcd::Zero(m, m);
  Matrix of_algebraic(num_algebraic, num_algebraic);
  Vector size_of_algebraic(num_algebraic);
  Index first_algebraic = m;
  for (Index b = 0; b < balanced.num_blocks(); ++b) {
    const Index begin = balanced.begins[b], size = balanced.size_of_block(b);
    const auto range = Eigen::seqN(begin, size);
    G.bottomRows(m - begin - size).middleCols(begin, size).setZero();
    Index rest = size;
    Matrix Q = Matrix::Identity(size, size);
    if (b == constrained) {
      rest = size - num_algebraic;
      if (rest < 0) return std::nullopt;
      first_algebraic = begin + rest;
      const Matrix rows = algebraic(Eigen::all, range) * scale(range).asDiagonal();
      size_of_algebraic = RowMaxAbs(rows).unaryExpr([](double entry) { return 1 / PowerOfTwo(entry); });
      const Eigen::ColPivHouseholderQR<Matrix> qr(rows.transpose() * size_of_algebraic.asDiagonal());
      const Matrix whole = qr.householderQ();
      Q << whole.rightCols(rest), whole.leftCols(num_algebraic);
      of_algebraic = size_of_algebraic.asDiagonal() * (rows * Q.rightCols(num_algebraic));
    }
    U(range, range) = Q.cast<std::complex<double>>();
    if (rest == 0) continue;
    const Matrix block = Q.transpose() * G(range, range) * Q;
    std::optional<SchurForm> schur = ComputeSchurForm(block.topLeftCorner(rest, rest));
    if (!schur) return std::nullopt;
    U.block(begin, begin, size, rest) = Q.leftCols(rest) * schur->vectors;
  }
  PencilForm form;
  form.slope_triangle = (U.adjoint() * G * U).eval().triangularView<Eigen::Upper>();
  form.slope_triangle.middleRows(first_algebraic, num_algebraic).setZero();
  form.triangle = Eigen::MatrixXcd::Identity(m, m) + shifted.shift * form.slope_triangle;
  form.vectors.resize(m, m);
  form.vectors(order, Eigen::all) = scale.asDiagonal() * U;
  form.inverse.resize(m, m);
  form.inverse(Eigen::all, order) = U.adjoint() * scale.cwiseInverse().asDiagonal();
  form.left = U.adjoint() * (further.cwiseInverse().asDiagonal() * inverse_in_units(order, Eigen::all));
  if (num_algebraic > 0) {
    auto rows = form.left.middleRows(first_algebraic, num_algebraic);
    rows.setZero();
    rows.rightCols(num_algebraic) =
        PanelLu(of_algebraic).Solve(Matrix(size_of_algebraic.asDiagonal())).cast<std::complex<double>>();
  }
  if (!form.left.allFinite()) return std::nullopt;
  return form;
}

}  // namespace dlcs
