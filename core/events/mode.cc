// SPDX-License-Identifier: Apache-2.0

#include "core/events/mode.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>
#include <optional>
#include <utility>

#include "core/linalg/balance.h"
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
// they act on a fast state most: T = P R⁻¹ by the QR factorization B_S P = Q R with column pivots. A row of B_S T is
// formed from that row of B_S alone, so that it has the rounding of its own entries. T is the identity where columns of
// B_S are dependent.
class Coordinates {
 public:
  explicit Coordinates(const Matrix& B_S) : columns_(B_S) {
    if (B_S.rows() < B_S.cols() || B_S.cols() == 0) return;
    const Vector scale = Equilibrate(B_S).columns;
    const Eigen::ColPivHouseholderQR<Matrix> qr(B_S * scale.asDiagonal());
    const Matrix R = qr.matrixR().topRows(B_S.cols()).triangularView<Eigen::Upper>();
    if (!(std::abs(R(R.rows() - 1, R.cols() - 1)) > kSingular * std::abs(R(0, 0)))) return;
    order_ = scale.asDiagonal() * Matrix(qr.colsPermutation());
    R_ = R;
    columns_ = Of(B_S);
  }

  // B_S T.
  const Matrix& columns() const { return columns_; }
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
};

// B y of a mode, and |B||y.state| where no smaller numbers serve.
struct Forces {
  LinearOutput y;
  Matrix size;
};

// What y_S is, or nothing where it is not determined.
std::optional<Forces> DetermineMultipliers(const Problem& problem, Mode& mode) {
  const std::vector<Index>& S = mode.active;
  const Matrix selector = Selector(problem.num_constraints(), S);
  const Matrix M_SS = problem.M.Dense()(S, S);
  const Matrix N_S = problem.N.Dense()(S, Eigen::all);
  Forces forces;
  if (const auto inverse = NegativeInverse(M_SS)) {
    const Matrix map = Product(selector, *inverse);
    mode.y.state = Product(map, N_S);
    mode.y.g = Product(map, selector.transpose());
    forces.y.state = problem.B * mode.y.state;
    forces.y.g = problem.B * mode.y.g;
    forces.size = problem.B.Dense().cwiseAbs() * mode.y.state.cwiseAbs();
    return forces;
  }
  const RowSpaces rows = SplitRows(M_SS);
  const Coordinates coordinates(problem.B.Dense()(Eigen::all, S));
  const Matrix& B_S = coordinates.columns();
  const Index rank = rows.range.rows();
  const Index size = static_cast<Index>(S.size());
  Matrix system(size, size);
  system << rows.range * coordinates.Of(M_SS), rows.null * N_S * B_S;
  const auto inverse = NegativeInverse(system);
  if (!inverse) return std::nullopt;
  const Matrix of_range = inverse->leftCols(rank) * rows.range;
  const Matrix of_null = inverse->rightCols(size - rank) * rows.null;
  const LinearOutput z{.state = of_range * N_S + of_null * N_S * problem.A.Dense(),
                       .f = of_null * N_S,
                       .g = of_range * selector.transpose(),
                       .slope = of_null * selector.transpose()};
  const auto in_y = [&](const Matrix& of_z) { return Matrix(selector * coordinates.Back(of_z)); };
  mode.y = {.state = in_y(z.state), .f = in_y(z.f), .g = in_y(z.g), .slope = in_y(z.slope)};
  forces.y = {.state = B_S * z.state, .f = B_S * z.f, .g = B_S * z.g, .slope = B_S * z.slope};
  forces.size = B_S.cwiseAbs() * z.state.cwiseAbs();
  mode.rows = rows.null * N_S;
  mode.rows_g = rows.null * selector.transpose();
  // Along B_S in directions that M_SS does not feel: the columns of the inverse that belong to the null rows.
  mode.correction = -B_S * inverse->rightCols(size - rank);
  return forces;
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
  std::optional<Forces> forces = DetermineMultipliers(problem, *mode);
  if (!forces) return nullptr;
  mode->guard = MakeGuard(problem, *mode);
  mode->dynamics = problem.A.Dense() + forces->y.state;
  mode->dynamics_size = problem.A.Dense().cwiseAbs() + forces->size;
  if (!mode->active.empty()) mode->source_g = std::move(forces->y.g);
  if (mode->differentiated()) {
    const Index m = problem.num_states();
    mode->source_f = Matrix::Identity(m, m) + forces->y.f;
    mode->source_slope = std::move(forces->y.slope);
  }
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
