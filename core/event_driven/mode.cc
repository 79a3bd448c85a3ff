// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/mode.h"

#include <cmath>
#include <optional>
#include <utility>

#include "core/linalg/balance.h"
#include "core/linalg/decompositions.h"
#include "core/linalg/norms.h"
#include "core/linalg/panel_lu.h"
#include "core/linalg/panel_product.h"

namespace dlcs {
namespace {

// Below this reciprocal condition number a matrix does not determine y.
constexpr double kSingular = 1e-12;

// Powers of two that make the largest entries of the rows and columns of rows · matrix · columns nearly one: rows and
// columns have units of their own. Where a row or column is zero, its scale is one.
struct Equilibrium {
  Vector rows;
  Vector columns;
};

Equilibrium Equilibrate(const Matrix& matrix) {
  constexpr int kRounds = 4;
  Equilibrium scale{Vector::Ones(matrix.rows()), Vector::Ones(matrix.cols())};
  const auto root = [](double size) { return size > 0 ? std::exp2(-std::round(std::log2(size) / 2)) : 1.0; };
  for (int round = 0; round < kRounds; ++round) {
    const Matrix scaled = (scale.rows.asDiagonal() * matrix * scale.columns.asDiagonal()).cwiseAbs();
    for (Index i = 0; i < scaled.rows(); ++i) scale.rows[i] *= root(scaled.row(i).maxCoeff());
    for (Index j = 0; j < scaled.cols(); ++j) scale.columns[j] *= root(scaled.col(j).maxCoeff());
  }
  return scale;
}

// -matrix⁻¹, absent where it is singular to working precision, in units in which rows and columns are of size one.
std::optional<Matrix> NegativeInverse(const Matrix& matrix) {
  const Index size = matrix.rows();
  if (size == 0) return Matrix(0, 0);
  const auto [rows, columns] = Equilibrate(matrix);
  const Matrix scaled = rows.asDiagonal() * matrix * columns.asDiagonal();
  const Matrix inverse = PanelLu(scaled).Solve(Matrix::Identity(size, size));
  if (!(InfinityNorm(scaled) * InfinityNorm(inverse) * kSingular < 1)) return std::nullopt;
  return -(columns.asDiagonal() * inverse * rows.asDiagonal());
}

// The rows U₁ᵀ and U₀ᵀ of a matrix, orthogonal but for the units of rows, with U₀ᵀ M_SS = 0 and U₁ᵀ M_SS of full rank.
struct RowSpaces {
  Matrix range;
  Matrix null;
};

RowSpaces SplitRows(const Matrix& M_SS) {
  const auto [of_rows, of_columns] = Equilibrate(M_SS);
  const Matrix scaled = of_rows.asDiagonal() * M_SS * of_columns.asDiagonal();
  const Eigen::JacobiSVD<Matrix> svd(scaled, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vector& values = svd.singularValues();
  Index rank = 0;
  while (rank < values.size() && values[rank] > kSingular * values[0]) ++rank;
  const Matrix range = svd.matrixU().leftCols(rank).transpose();
  Matrix null = svd.matrixU().rightCols(M_SS.rows() - rank).transpose();
  // Small entries have the rounding of large ones, and stand before large terms: one step of refinement.
  const Matrix left = (null.cast<long double>() * scaled.cast<long double>()).cast<double>();
  null -= left * svd.matrixV().leftCols(rank) * values.head(rank).cwiseInverse().asDiagonal() * range;
  return {range * of_rows.asDiagonal(), null * of_rows.asDiagonal()};
}

// Columns S of an identity: selects, and puts back.
Matrix Selector(Index n, const std::vector<Index>& S) {
  Matrix selector = Matrix::Zero(n, static_cast<Index>(S.size()));
  for (std::size_t p = 0; p < S.size(); ++p) selector(S[p], static_cast<Index>(p)) = 1;
  return selector;
}

// Coordinates z of y_S = T z in which the columns of B_S are of one size and not nearly dependent, as they are where
// they act on a fast state most: T = P R⁻¹ by the QR factorization D B_S P = Q R with column pivots, where D weighs the
// states as N_S does. A row of B_S T is formed from that row of B_S alone, so that it has the rounding of its own
// entries. `pivots` are as many rows of B_S T, far from dependent. Where columns of B_S are dependent T is the
// identity, and there are no pivots.
class Coordinates {
 public:
  Coordinates(const Matrix& B_S, const Matrix& N_S) : columns_(B_S) {
    if (B_S.rows() < B_S.cols() || B_S.cols() == 0) return;
    const Vector weight = Equilibrate(N_S).columns.cwiseInverse();
    Matrix weighed = weight.asDiagonal() * B_S;
    for (Index i = 0; i < weighed.rows(); ++i) {
      if (N_S.col(i).isZero(0)) weighed.row(i).setZero();
    }
    const Vector scale = Equilibrate(weighed).columns;
    const Eigen::ColPivHouseholderQR<Matrix> qr(weighed * scale.asDiagonal());
    const Matrix R = qr.matrixR().topRows(B_S.cols()).triangularView<Eigen::Upper>();
    if (!(std::abs(R(R.rows() - 1, R.cols() - 1)) > kSingular * std::abs(R(0, 0)))) return;
    order_ = scale.asDiagonal() * Matrix(qr.colsPermutation());
    R_ = R;
    columns_ = Of(B_S);
    const Eigen::FullPivLU<Matrix> lu(Of(weighed));
    const auto& position = lu.permutationP().indices();
    pivots_.resize(static_cast<std::size_t>(B_S.cols()));
    for (Index i = 0; i < position.size(); ++i) {
      if (position[i] < B_S.cols()) pivots_[static_cast<std::size_t>(position[i])] = i;
    }
  }

  // B_S T.
  const Matrix& columns() const { return columns_; }
  const std::vector<Index>& pivots() const { return pivots_; }
  // X T and T Z.
  Matrix Of(const Matrix& X) const {
    return R_.size() > 0 ? Matrix(R_.triangularView<Eigen::Upper>().solve<Eigen::OnTheRight>(X * order_)) : X;
  }
  Matrix Back(const Matrix& Z) const {
    return R_.size() > 0 ? Matrix(order_ * R_.triangularView<Eigen::Upper>().solve(Z)) : Z;
  }

 private:
  Matrix order_, R_;
  Matrix columns_;
  std::vector<Index> pivots_;
};

// y_S where M_SS is regular, and the equation of the states.
void SubstituteMultipliers(const Problem& problem, const Matrix& N_S, const Matrix& inverse, Mode& mode) {
  const Matrix selector = Selector(problem.num_constraints(), mode.active);
  const Matrix map = Product(selector, inverse);
  mode.y.state = Product(map, N_S);
  mode.y.g = Product(map, selector.transpose());
  mode.dynamics = problem.A.Dense() + problem.B * mode.y.state;
  mode.dynamics_size = problem.A.Dense().cwiseAbs() + problem.B.Dense().cwiseAbs() * mode.y.state.cwiseAbs();
  if (!mode.active.empty()) mode.source_g = problem.B * mode.y.g;
}

// The same where M_SS is singular. False where y_S is not determined.
bool DifferentiateConstraints(const Problem& problem, const Matrix& M_SS, const Matrix& N_S, Mode& mode) {
  const std::vector<Index>& S = mode.active;
  const Matrix& A = problem.A.Dense();
  const Index m = A.rows(), size = static_cast<Index>(S.size());
  const RowSpaces rows = SplitRows(M_SS);
  const Index rank = rows.range.rows();
  const Coordinates coordinates(problem.B.Dense()(Eigen::all, S), N_S);
  const Matrix& B_S = coordinates.columns();
  const Matrix M_T = coordinates.Of(M_SS);
  Matrix system(size, size);
  system << rows.range * M_T, rows.null * N_S * B_S;
  const auto inverse = NegativeInverse(system);
  if (!inverse) return false;

  // z = z' - of_A x - of_f f, so that the rows of the pivots vanish from what z' is made of: A - B_S of_A. Fast states
  // are such rows, and their large entries would take the digits of the others.
  const auto& pivots = coordinates.pivots();
  Matrix of_A = Matrix::Zero(size, m), of_f = Matrix::Zero(size, m);
  if (!pivots.empty()) {
    const Eigen::FullPivLU<Matrix> at_pivots(B_S(pivots, Eigen::all));
    of_A = at_pivots.solve(A(pivots, Eigen::all));
    of_f = at_pivots.solve(Matrix::Identity(m, m)(pivots, Eigen::all));
  }
  Matrix rest = A - B_S * of_A, rest_f = Matrix::Identity(m, m) - B_S * of_f;
  Matrix rest_size = A.cwiseAbs() + B_S.cwiseAbs() * of_A.cwiseAbs();
  for (Matrix* matrix : {&rest, &rest_f, &rest_size}) {
    for (const Index i : pivots) matrix->row(i).setZero();
  }

  const Matrix of_range = inverse->leftCols(rank) * rows.range;
  const Matrix of_null = inverse->rightCols(size - rank) * rows.null;
  const Matrix selector = Selector(problem.num_constraints(), S);
  const LinearOutput z{.state = of_range * (N_S - M_T * of_A) + of_null * N_S * rest,
                       .f = of_null * N_S * rest_f - of_range * M_T * of_f,
                       .g = of_range * selector.transpose(),
                       .slope = of_null * selector.transpose()};
  mode.dynamics = rest + B_S * z.state;
  const Matrix z_size = of_range.cwiseAbs() * (N_S.cwiseAbs() + M_T.cwiseAbs() * of_A.cwiseAbs()) +
                        of_null.cwiseAbs() * (N_S.cwiseAbs() * rest_size);
  mode.dynamics_size = rest_size + B_S.cwiseAbs() * z_size;
  mode.source_f = rest_f + B_S * z.f;
  mode.source_g = B_S * z.g;
  mode.source_slope = B_S * z.slope;
  const auto in_y = [&](const Matrix& of_z) { return Matrix(selector * coordinates.Back(of_z)); };
  mode.y = {.state = in_y(z.state - of_A), .f = in_y(z.f - of_f), .g = in_y(z.g), .slope = in_y(z.slope)};
  mode.rows = rows.null * N_S;
  mode.rows_g = rows.null * selector.transpose();
  // Along B_S in directions that M_SS does not feel: the columns of the inverse that belong to the null rows.
  mode.correction = -B_S * inverse->rightCols(size - rank);
  return true;
}

// y on S, and w = N x + g + M y elsewhere.
LinearOutput MakeGuard(const Problem& problem, const Mode& mode) {
  const Index n = problem.num_constraints();
  LinearOutput guard;
  guard.state = problem.N.Dense() + problem.M * mode.y.state;
  guard.g = Matrix::Identity(n, n) + problem.M * mode.y.g;
  if (mode.differentiated()) {
    guard.f = problem.M * mode.y.f;
    guard.slope = problem.M * mode.y.slope;
  }
  for (const Index i : mode.active) {
    guard.state.row(i) = mode.y.state.row(i);
    guard.g.row(i) = mode.y.g.row(i);
    if (!mode.differentiated()) continue;
    guard.f.row(i) = mode.y.f.row(i);
    guard.slope.row(i) = mode.y.slope.row(i);
  }
  return guard;
}

// What is made of dynamics. False where that fails.
bool Complete(const Problem& problem, Mode& mode) {
  std::optional<GradedSchurForm> form = ComputeGradedSchurForm(mode.dynamics, problem.horizon);
  if (!form) return false;
  mode.form = *std::move(form);
  mode.rate = InfinityNorm(Balance(mode.dynamics).matrix);
  return true;
}

}  // namespace

std::unique_ptr<Mode> MakeMode(const Problem& problem, std::vector<Index> active) {
  auto mode = std::make_unique<Mode>();
  mode->active = std::move(active);
  const Matrix M_SS = problem.M.Dense()(mode->active, mode->active);
  const Matrix N_S = problem.N.Dense()(mode->active, Eigen::all);
  if (const auto inverse = NegativeInverse(M_SS)) {
    SubstituteMultipliers(problem, N_S, *inverse, *mode);
  } else if (!DifferentiateConstraints(problem, M_SS, N_S, *mode)) {
    return nullptr;
  }
  mode->guard = MakeGuard(problem, *mode);
  if (!Complete(problem, *mode)) return nullptr;
  return mode;
}

std::unique_ptr<Mode> DrawBack(const Problem& problem, const Mode& mode, const Vector& rates) {
  auto drawn = std::make_unique<Mode>(mode);
  const Matrix back = mode.correction * rates.asDiagonal();
  drawn->dynamics -= back * mode.rows;
  drawn->source_g -= back * mode.rows_g;
  drawn->dynamics_size += back.cwiseAbs() * mode.rows.cwiseAbs();
  if (!Complete(problem, *drawn)) return nullptr;
  return drawn;
}

}  // namespace dlcs
