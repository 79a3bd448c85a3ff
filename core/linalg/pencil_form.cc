// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/pencil_form.h"

#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/linalg/balance.h"
#include "core/linalg/decompositions.h"
#include "core/linalg/graded_schur.h"
#include "core/linalg/norms.h"
#include "core/linalg/panel_lu.h"
#include "core/linalg/schur_form.h"

namespace dlcs {
namespace {

double PowerOfTwo(double size) { return size > 0 && std::isfinite(size) ? std::ldexp(1.0, std::ilogb(size)) : 1.0; }

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

}  // namespace

std::optional<PencilForm> ComputeExplicitForm(const Matrix& A, double duration) {
  std::optional<GradedSchurForm> form = ComputeGradedSchurForm(A, duration);
  if (!form) return std::nullopt;
  return PencilForm{{}, std::move(form->triangle), std::move(form->vectors), std::move(form->inverse), {}};
}

std::optional<PencilForm> ComputePencilForm(const Matrix& E, const Matrix& F, Index num_algebraic, const Vector& units,
                                            double duration) {
  constexpr double kRounding = std::numeric_limits<double>::epsilon() / 2;
  if (!E.allFinite() || !F.allFinite()) return std::nullopt;
  const Index m = E.rows(), rest = m - num_algebraic;
  Matrix E_in_units = E * units.asDiagonal(), F_in_units = F * units.asDiagonal();
  const Shifted shifted = ChooseShift(E_in_units, F_in_units, duration);
  if (!(shifted.condition > 0)) return std::nullopt;
  const Matrix inverse_in_units = shifted.factors->Solve(Matrix(shifted.row_scale.asDiagonal()));
  Matrix G = inverse_in_units * E_in_units;
  if (!G.allFinite()) return std::nullopt;
  // Balanced without differences that are only the rounding of their terms: a coupling of 1e-30 between two blocks is
  // scaled to the size of the blocks, which makes vectors without a digit.
  const Matrix terms = inverse_in_units.cwiseAbs() * E_in_units.cwiseAbs();
  const BalancedMatrix balanced = Balance((G.array().abs() <= kRounding * terms.array()).select(0, G));
  Vector further(m);
  for (Index k = 0; k < m; ++k) further[balanced.order[k]] = std::ldexp(1.0, balanced.exponents[k]);
  G = further.cwiseInverse().asDiagonal() * G * further.asDiagonal();
  const Vector scale = units.cwiseProduct(further);

  // Orthogonal coordinates, the last ones along the algebraic rows.
  Matrix Q = Matrix::Identity(m, m), of_algebraic(num_algebraic, num_algebraic);
  Vector size_of_algebraic(num_algebraic);
  if (num_algebraic > 0) {
    const Matrix rows = F.bottomRows(num_algebraic) * scale.asDiagonal();
    const Vector sizes = RowMaxAbs(rows).unaryExpr([](double size) { return 1 / PowerOfTwo(size); });
    const Eigen::ColPivHouseholderQR<Matrix> qr(rows.transpose() * sizes.asDiagonal());
    const Matrix whole = qr.householderQ();
    Q << whole.rightCols(rest), whole.leftCols(num_algebraic);
    size_of_algebraic = sizes;
    of_algebraic = sizes.asDiagonal() * (rows * Q.rightCols(num_algebraic));
  }
  const Matrix G_Q = Q.transpose() * G * Q;
  Eigen::MatrixXcd U = Eigen::MatrixXcd::Identity(m, m);
  PencilForm form;
  form.slope_triangle = Eigen::MatrixXcd::Zero(m, m);
  if (rest > 0) {
    std::optional<SchurForm> schur = ComputeSchurForm(G_Q.topLeftCorner(rest, rest));
    if (!schur) return std::nullopt;
    form.slope_triangle.topLeftCorner(rest, rest) = schur->triangle.triangularView<Eigen::Upper>();
    form.slope_triangle.topRightCorner(rest, num_algebraic) =
        schur->vectors.adjoint() * G_Q.topRightCorner(rest, num_algebraic);
    U.topLeftCorner(rest, rest) = std::move(schur->vectors);
  }
  form.triangle = Eigen::MatrixXcd::Identity(m, m) + shifted.shift * form.slope_triangle;
  form.vectors = scale.asDiagonal() * (Q * U);
  form.inverse = (U.adjoint() * Q.transpose()) * scale.cwiseInverse().asDiagonal();
  form.left = (U.adjoint() * Q.transpose()) * (further.cwiseInverse().asDiagonal() * inverse_in_units);
  if (num_algebraic > 0) {
    form.left.bottomRows(num_algebraic).setZero();
    form.left.bottomRightCorner(num_algebraic, num_algebraic) =
        PanelLu(of_algebraic).Solve(Matrix(size_of_algebraic.asDiagonal())).cast<std::complex<double>>();
  }
  if (!form.left.allFinite()) return std::nullopt;
  return form;
}

}  // namespace dlcs
