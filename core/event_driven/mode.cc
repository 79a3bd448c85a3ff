// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/mode.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>
#include <utility>

#include "core/linalg/balance.h"
#include "core/linalg/decompositions.h"
#include "core/linalg/equilibration.h"
#include "core/linalg/norms.h"
#include "core/linalg/panel_product.h"
#include "core/linalg/refined_inverse.h"
#include "core/linalg/structural_zeros.h"

namespace dlcs {
namespace {

// Below this reciprocal condition number a matrix does not determine y.
constexpr double kSingular = 1e-12;

// -matrix⁻¹, absent where it is singular to working precision, in units in which rows and columns are of size one.
std::optional<Matrix> NegativeInverse(const Matrix& matrix) {
  const Index size = matrix.rows();
  if (size == 0) return Matrix(0, 0);
  const Equilibration scale = EquilibrateRowsAndColumns(matrix);
  const Matrix scaled = Scaled(matrix, scale);
  Matrix inverse = RefinedInverse(scaled);
  ClearStructuralZeros(scaled, inverse);
  if (!(InfinityNorm(scaled) * InfinityNorm(inverse) * kSingular < 1)) return std::nullopt;
  return -(scale.column.asDiagonal() * inverse * scale.row.asDiagonal());
}

// Sets the entries of a -matrix⁻¹ to zero that one ulp of the entries of `matrix` moves by as much: unknowns that
// depend on a right-hand side by rounding alone. A large right-hand side there would give them a sign.
void ClearRounding(const Matrix& matrix, Matrix& negative_inverse) {
  constexpr double kUlps = 4 * std::numeric_limits<double>::epsilon();
  const Matrix sizes = negative_inverse.cwiseAbs();
  const Matrix moved = kUlps * (sizes * (matrix.cwiseAbs() * sizes));
  negative_inverse = (sizes.array() > moved.array()).select(negative_inverse, 0);
}

// Columns S of an identity: selects, and puts back.
Matrix ColumnsOfIdentity(Index n, const std::vector<Index>& S) {
  Matrix selector = Matrix::Zero(n, static_cast<Index>(S.size()));
  for (std::size_t p = 0; p < S.size(); ++p) selector(S[p], static_cast<Index>(p)) = 1;
  return selector;
}

// y_S by the rows of a nonsingular M_SS, and the equation of the states. False where M_SS is singular.
bool SubstituteMultipliers(const Problem& problem, Mode& mode) {
  const Matrix& M = problem.M.Dense();
  const Matrix M_SS = M(mode.active, mode.active);
  auto inverse = NegativeInverse(M_SS);
  if (!inverse) return false;
  ClearRounding(M_SS, *inverse);
  const Matrix selector = ColumnsOfIdentity(problem.num_constraints(), mode.active);
  const Matrix map = Product(selector, *inverse);
  mode.y.state = Product(map, problem.N.Dense()(mode.active, Eigen::all));
  mode.y.g = Product(map, selector.transpose());
  mode.F = problem.A.Dense() + problem.B * mode.y.state;
  mode.F_terms = problem.A.Dense().cwiseAbs() + problem.B.Dense().cwiseAbs() * mode.y.state.cwiseAbs();
  if (!mode.active.empty()) mode.source_g = problem.B * mode.y.g;
  return true;
}

// For each w_i = N_i x + g_i + M_i y another one whose row is the opposite: N_j = -N_i, and of M_i + M_j less is left
// than half of M_i. -1 if there is none.
std::vector<Index> OppositeRows(const Problem& problem) {
  const Index n = problem.num_constraints(), m = problem.num_states();
  const Matrix N = problem.N.Dense().transpose(), M = problem.M.Dense().transpose();
  std::vector<Index> opposite(static_cast<std::size_t>(n), -1);
  for (Index i = 0; i < n; ++i) {
    Index least = ((M.col(i).array() != 0).count() + 1) / 2;
    for (Index j = 0; j < n; ++j) {
      Index k = 0;
      while (k < m && N(k, i) == -N(k, j)) ++k;
      if (j == i || k < m) continue;
      const Index left = ((M.col(i) + M.col(j)).array() != 0).count();
      if (left >= least) continue;
      least = left;
      opposite[static_cast<std::size_t>(i)] = j;
    }
  }
  return opposite;
}

// left + map * right, whose entries are zero where they are the rounding of their terms. The voltage of an open switch
// may be the difference of terms 1e12 times its size.
Matrix SumWithoutRounding(const Matrix& left, const Matrix& map, const Matrix& right) {
  constexpr double kRoundingOfTerms = 8 * std::numeric_limits<double>::epsilon();
  const Matrix sum = left + map * right;
  const Matrix terms = left.cwiseAbs() + map.cwiseAbs() * right.cwiseAbs();
  return (sum.array().abs() > kRoundingOfTerms * terms.array()).select(sum, 0);
}

// y on S, and w = N x + g + M y elsewhere; w_i + w_j where j is in S, so that w_j = 0, and its row is the opposite. Of
// the two slacks of an open switch, w and -w, rounding would be left.
LinearOutput MakeGuard(const Problem& problem, const std::vector<Index>& opposite, const Mode& mode) {
  const Index n = problem.num_constraints(), m = problem.num_states();
  Matrix of_x = problem.N.Dense(), of_g = Matrix::Identity(n, n), of_y = problem.M.Dense();
  for (Index i = 0; i < n; ++i) {
    const Index j = opposite[static_cast<std::size_t>(i)];
    if (j < 0 || !std::binary_search(mode.active.begin(), mode.active.end(), j)) continue;
    of_x.row(i).setZero();
    of_g(i, j) = 1;
    of_y.row(i) += problem.M.Dense().row(j);
  }
  LinearOutput guard;
  guard.state = SumWithoutRounding(of_x, of_y, mode.y.state);
  guard.g = SumWithoutRounding(of_g, of_y, mode.y.g);
  if (!mode.is_explicit()) {
    guard.slope = SumWithoutRounding(Matrix::Zero(n, m), of_y, mode.y.slope);
    guard.f = SumWithoutRounding(Matrix::Zero(n, m), of_y, mode.y.f);
  }
  for (const Index i : mode.active) {
    guard.state.row(i) = mode.y.state.row(i);
    guard.g.row(i) = mode.y.g.row(i);
    if (mode.is_explicit()) continue;
    guard.slope.row(i) = mode.y.slope.row(i);
    guard.f.row(i) = mode.y.f.row(i);
  }
  return guard;
}

LinearOutput MakeOutputs(const Outputs& given, const Mode& mode) {
  const Index p = given.shown(), m = given.C.cols(), n = given.D.cols();
  const Matrix D = given.D.Dense().topRows(p);
  LinearOutput outputs;
  outputs.state = SumWithoutRounding(given.C.Dense().topRows(p), D, mode.y.state);
  outputs.g = SumWithoutRounding(Matrix::Zero(p, n), D, mode.y.g);
  if (mode.is_explicit()) return outputs;
  outputs.slope = SumWithoutRounding(Matrix::Zero(p, m), D, mode.y.slope);
  outputs.f = SumWithoutRounding(Matrix::Zero(p, m), D, mode.y.f);
  return outputs;
}

// Row rows[p] becomes Σ steps(p, q) row rows[q]. No rows: all stay.
struct RowCombination {
  std::vector<Index> rows;
  Matrix steps;
};

Matrix Combined(Matrix matrix, const std::vector<Index>& rows, const Matrix& steps) {
  if (rows.empty()) return matrix;
  const Matrix chosen = matrix(rows, Eigen::all);
  matrix(rows, Eigen::all) = steps * chosen;
  return matrix;
}

// Rows `own` of `factors` may depend on each other in the columns `driving`: then a combination of them is an algebraic
// equation. Replaces rows of `factors` by such combinations, with exact zeros in these columns, and returns how; mostly
// there are none. `summed`: the sizes that the factors were summed from.
RowCombination CombineDependentRows(const std::vector<Index>& own, const std::vector<Index>& driving,
                                    const Matrix& summed, Matrix& factors) {
  if (driving.empty()) return {};
  std::vector<Index> rows;
  double rounding = kSingular;
  for (const Index i : own) {
    const double size = factors(i, driving).cwiseAbs().maxCoeff();
    if (size == 0) continue;
    rows.push_back(i);
    rounding = std::max(rounding, kSingular * summed(i, driving).maxCoeff() / size);
  }
  if (rows.size() < 2) return {};
  const Index count = static_cast<Index>(rows.size());
  const Matrix given = factors(rows, driving);
  const Equilibration scale = EquilibrateRowsAndColumns(given);
  const Eigen::FullPivLU<Matrix> lu(Scaled(given, scale));
  Index rank = 0;
  while (rank < std::min(count, given.cols()) && std::abs(lu.matrixLU()(rank, rank)) > rounding) ++rank;
  if (rank == count) return {};
  Matrix lower = Matrix::Identity(count, count);
  lower.leftCols(rank) += lu.matrixLU().leftCols(rank).triangularView<Eigen::StrictlyLower>();
  const Matrix permuted = lu.permutationP() * Matrix(scale.row.asDiagonal());
  RowCombination combination{std::move(rows), lower.triangularView<Eigen::UnitLower>().solve(permuted)};
  factors = Combined(std::move(factors), combination.rows, combination.steps);
  for (Index p = rank; p < count; ++p) {
    factors(combination.rows[static_cast<std::size_t>(p)], driving).setZero();
  }
  return combination;
}

// The factors of y_S, row.asDiagonal() · of_y · column.asDiagonal(), in units in which their sizes can be compared.
struct ScaledFactors {
  Vector row, column;
  Matrix matrix;
};

// Each equation relative to its other terms.
ScaledFactors ScaleFactors(const ModeEquations& equations, const DataSizes& sizes, double horizon) {
  constexpr double kPreferred = 4096;  // the rows of M_SS, which keep the equations of the states as they are
  constexpr double kFirst = 0x1p200;   // above all others
  const Index m = equations.of_x.cols(), k = equations.of_y.cols();
  const Vector terms = equations.of_x.cwiseAbs() * sizes.x + equations.of_g.cwiseAbs() * sizes.g +
                       equations.slope.cwiseAbs() * (sizes.f + sizes.x / horizon);
  const auto inverse = [](double size) { return 1 / PowerOfTwo(size); };
  ScaledFactors scaled;
  scaled.row = terms.unaryExpr(inverse);
  scaled.row.tail(k) *= kPreferred;
  // y that sources alone determine, such as the current that an open switch allows, is exactly theirs: by another row
  // it would be a difference of large terms.
  for (Index i = m; i < m + k; ++i) {
    const auto factors = equations.of_y.row(i);
    if (equations.of_x.row(i).isZero(0) && (factors.array() != 0).count() == 1)
      scaled.row[i] = kFirst / factors.cwiseAbs().maxCoeff();
  }
  scaled.column = RowMaxAbs((scaled.row.asDiagonal() * equations.of_y).transpose()).unaryExpr(inverse);
  scaled.matrix = scaled.row.asDiagonal() * equations.of_y * scaled.column.asDiagonal();
  return scaled;
}

// The rows that determine y_S, and those that remain; both increase.
struct PivotRows {
  std::vector<Index> pivots, others;
};

// By complete pivoting. Absent where rounding is all that is left of a row: it does not determine y_S.
std::optional<PivotRows> ChoosePivots(const Matrix& factors) {
  const Eigen::FullPivLU<Matrix> lu(factors);
  const Index k = factors.cols();
  PivotRows rows{std::vector<Index>(static_cast<std::size_t>(k)), {}};
  for (Index i = 0; i < factors.rows(); ++i) {
    const Index position = lu.permutationP().indices()[i];
    if (position < k) {
      rows.pivots[static_cast<std::size_t>(position)] = i;
    } else {
      rows.others.push_back(i);
    }
  }
  for (Index p = 0; p < k; ++p) {
    const double size = factors.row(rows.pivots[static_cast<std::size_t>(p)]).cwiseAbs().maxCoeff();
    if (!(std::abs(lu.matrixLU()(p, p)) > kSingular * size)) return std::nullopt;
  }
  std::sort(rows.pivots.begin(), rows.pivots.end());
  return rows;
}

// How the rows that remain become free of y_S: some are combined first, then `factors` times the pivots are subtracted.
struct PivotElimination {
  Matrix factors;
  RowCombination combination;
  std::vector<Index> order;  // of the results: differential equations, then algebraic ones
  Index num_algebraic = 0;

  // What it leaves of a matrix with a row for each equation, ...
  Matrix Rest(const Matrix& rows, const PivotRows& chosen) const {
    const Matrix left = Combined(rows(chosen.others, Eigen::all), combination.rows, combination.steps);
    return Matrix(left - factors * rows(chosen.pivots, Eigen::all))(order, Eigen::all);
  }
  // ... and the sums of the absolute values of the terms of that.
  Matrix TermsOfRest(const Matrix& rows, const PivotRows& chosen) const {
    const Matrix left =
        Combined(rows(chosen.others, Eigen::all).cwiseAbs(), combination.rows, combination.steps.cwiseAbs());
    return Matrix(left + factors.cwiseAbs() * rows(chosen.pivots, Eigen::all).cwiseAbs())(order, Eigen::all);
  }
};

// `inverse`: that of the pivots of `scaled`. The first rows are the differential equations, as many as others remain.
PivotElimination EliminatePivots(const ScaledFactors& scaled, const PivotRows& chosen, const Matrix& inverse) {
  const auto& [pivots, others] = chosen;
  const Index m = static_cast<Index>(others.size()), k = static_cast<Index>(pivots.size());
  const Matrix of_others = scaled.matrix(others, Eigen::all);
  PivotElimination elimination;
  Matrix& factors = elimination.factors;
  factors = RefinedQuotient(of_others, scaled.matrix(pivots, Eigen::all), inverse);
  const Matrix summed = of_others.cwiseAbs() * inverse.cwiseAbs();
  std::vector<Index> own, driving;  // rows of M_SS among the others, differential equations among the pivots
  for (Index i = 0; i < m; ++i) {
    if (others[static_cast<std::size_t>(i)] >= m) own.push_back(i);
  }
  for (Index p = 0; p < k && pivots[static_cast<std::size_t>(p)] < m; ++p) driving.push_back(p);
  // What M_SS leaves of differential equations in its own rows where it is singular is rounding.
  for (const Index i : own) {
    for (const Index p : driving) {
      if (std::abs(factors(i, p)) <= kSingular * summed(i, p)) factors(i, p) = 0;
    }
  }
  elimination.combination = CombineDependentRows(own, driving, summed, factors);
  std::vector<Index> algebraic;
  for (Index i = 0; i < m; ++i) {
    const bool has_slope = others[static_cast<std::size_t>(i)] < m || (factors(i, driving).array() != 0).any();
    (has_slope ? elimination.order : algebraic).push_back(i);
  }
  elimination.order.insert(elimination.order.end(), algebraic.begin(), algebraic.end());
  elimination.num_algebraic = static_cast<Index>(algebraic.size());
  // From scaled rows to those of the equations.
  const Vector scale_of_pivots = scaled.row(pivots), scale_of_others = scaled.row(others);
  factors = scale_of_others.cwiseInverse().asDiagonal() * factors * scale_of_pivots.asDiagonal();
  const Vector combined = scale_of_others(elimination.combination.rows);
  Matrix& steps = elimination.combination.steps;
  steps = combined.cwiseInverse().asDiagonal() * steps * combined.asDiagonal();
  return elimination;
}

std::vector<std::complex<double>> Eigenvalues(const PencilForm& form) {
  constexpr double kUndetermined = 64 * std::numeric_limits<double>::epsilon();
  const Index m = form.triangle.rows();
  double largest = 0;
  for (Index j = 0; j < m; ++j) largest = std::max(largest, std::abs(form.Slope(j, j)));
  std::vector<std::complex<double>> eigenvalues;
  for (Index j = 0; j < m; ++j) {
    const std::complex<double> slope = form.Slope(j, j);
    if (std::abs(slope) > kUndetermined * largest) eigenvalues.push_back(form.triangle(j, j) / slope);
  }
  return eigenvalues;
}

Eigen::VectorXcd SlowestLeftVector(const PencilForm& form, const std::vector<std::complex<double>>& eigenvalues) {
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
  const auto slower = [](std::complex<double> a, std::complex<double> b) { return a.real() < b.real(); };
  const auto slowest = std::max_element(eigenvalues.begin(), eigenvalues.end(), slower);
  const Index m = form.triangle.rows();
  if (slowest == eigenvalues.end()) return Eigen::VectorXcd::Zero(m);
  Eigen::MatrixXcd shifted = form.triangle;
  for (Index j = 0; j < m; ++j) {
    for (Index i = 0; i <= j; ++i) shifted(i, j) -= *slowest * form.Slope(i, j);
  }
  Index of_slowest = 0;
  shifted.diagonal().cwiseAbs().minCoeff(&of_slowest);
  Eigen::VectorXcd vector = Eigen::VectorXcd::Zero(m);
  vector[of_slowest] = 1;
  for (Index k = of_slowest + 1; k < m; ++k) {
    const auto above = shifted.col(k).head(k);
    const double smallest = kEpsilon * (above.cwiseAbs().maxCoeff() + std::abs(form.triangle(k, k)));
    const std::complex<double> pivot = shifted(k, k);
    const std::complex<double> sum = (vector.head(k).transpose() * above)(0);
    if (sum != 0.0) vector[k] = -sum / (std::abs(pivot) < smallest ? smallest : pivot);
  }
  return (vector.transpose() * (form.left.size() > 0 ? form.left : form.inverse)).transpose();
}

}  // namespace

ModeMaker::ModeMaker(const Problem& problem)
    : problem_(problem),
      units_(problem.num_states()),
      rows_(Matrix::Identity(problem.num_states(), problem.num_states())),
      rows_A_(problem.A.Dense()),
      rows_B_(problem.B.Dense()),
      opposite_(OppositeRows(problem)) {
  const BalancedMatrix balanced = Balance(rows_A_);
  for (Index k = 0; k < units_.size(); ++k) units_[balanced.order[k]] = std::ldexp(1.0, balanced.exponents[k]);
}

ModeEquations ModeMaker::EquationsOf(const std::vector<Index>& S) const {
  const Index m = problem_.num_states(), n = problem_.num_constraints(), k = static_cast<Index>(S.size());
  ModeEquations equations{Matrix(m + k, m), Matrix(m + k, m), Matrix(m + k, k), Matrix(m + k, n)};
  equations.slope << rows_, Matrix::Zero(k, m);
  equations.of_x << rows_A_, problem_.N.Dense()(S, Eigen::all);
  equations.of_y << rows_B_(Eigen::all, S), problem_.M.Dense()(S, S);
  equations.of_g << Matrix::Zero(m, n), ColumnsOfIdentity(n, S).transpose();
  return equations;
}

// Gaussian elimination of y_S with complete pivoting, each equation relative to the size of its other terms. False
// where y_S is not determined; `mode` has no E where its pivots are the rows of M_SS.
bool ModeMaker::Eliminate(const DataSizes& sizes, Mode& mode) const {
  const std::vector<Index>& S = mode.active;
  const Index m = problem_.num_states(), n = problem_.num_constraints();
  if (S.empty()) return SubstituteMultipliers(problem_, mode);
  const ModeEquations equations = EquationsOf(S);
  const ScaledFactors scaled = ScaleFactors(equations, sizes, problem_.horizon);
  const auto chosen = ChoosePivots(scaled.matrix);
  if (!chosen) return false;
  const std::vector<Index>&pivots = chosen->pivots, &others = chosen->others;
  if (pivots.front() >= m && SubstituteMultipliers(problem_, mode)) return true;

  Matrix inverse = RefinedInverse(scaled.matrix(pivots, Eigen::all));
  ClearStructuralZeros(scaled.matrix(pivots, Eigen::all), inverse);
  const PivotElimination elimination = EliminatePivots(scaled, *chosen, inverse);
  mode.num_algebraic = elimination.num_algebraic;
  mode.row_of_state.assign(static_cast<std::size_t>(m), -1);
  for (Index row = 0; row < m; ++row) {
    const Index i = others[static_cast<std::size_t>(elimination.order[static_cast<std::size_t>(row)])];
    if (i < m) mode.row_of_state[static_cast<std::size_t>(i)] = row;
  }
  mode.E = elimination.Rest(equations.slope, *chosen);
  mode.F = elimination.Rest(equations.of_x, *chosen);
  mode.source_g = elimination.Rest(equations.of_g, *chosen);
  mode.E_terms = elimination.TermsOfRest(equations.slope, *chosen);
  mode.F_terms = elimination.TermsOfRest(equations.of_x, *chosen);

  const Vector scale_of_pivots = scaled.row(pivots);
  const Matrix solve =
      -(ColumnsOfIdentity(n, S) * (scaled.column.asDiagonal() * inverse * scale_of_pivots.asDiagonal()));
  mode.y.state = solve * equations.of_x(pivots, Eigen::all);
  mode.y.slope = -(solve * equations.slope(pivots, Eigen::all));
  mode.y.f = -mode.y.slope;
  mode.y.g = solve * equations.of_g(pivots, Eigen::all);

  Matrix nonsingular = mode.E;
  nonsingular.bottomRows(mode.num_algebraic) = mode.algebraic_rows();
  const auto negative_inverse = NegativeInverse(nonsingular);
  if (!negative_inverse) return false;
  mode.solve_slope = -*negative_inverse;
  mode.correction = mode.solve_slope.rightCols(mode.num_algebraic);
  const Index rest = m - mode.num_algebraic;
  mode.dynamics = mode.solve_slope.leftCols(rest) * mode.F.topRows(rest);
  return true;
}

std::unique_ptr<Mode> ModeMaker::MakeEquations(std::vector<Index> active, const DataSizes& sizes) const {
  auto mode = std::make_unique<Mode>();
  mode->active = std::move(active);
  if (!Eliminate(sizes, *mode)) return nullptr;
  mode->guard = MakeGuard(problem_, opposite_, *mode);
  if (problem_.outputs.shown() > 0) mode->outputs = MakeOutputs(problem_.outputs, *mode);
  if (mode->is_explicit()) mode->dynamics = mode->F;
  return mode;
}

std::unique_ptr<Mode> ModeMaker::Make(std::vector<Index> active, const DataSizes& sizes) const {
  std::unique_ptr<Mode> mode = MakeEquations(std::move(active), sizes);
  if (!mode) return nullptr;
  const double horizon = problem_.horizon;
  std::optional<PencilForm> form;
  if (mode->is_explicit()) {
    form = ComputeExplicitForm(mode->F, horizon);
  } else {
    form = ComputePencilForm(mode->E, mode->F, mode->num_algebraic, units_, horizon);
  }
  if (!form) return nullptr;
  mode->form = *std::move(form);
  mode->eigenvalues = Eigenvalues(mode->form);
  mode->slowest = SlowestLeftVector(mode->form, mode->eigenvalues);
  mode->rate = InfinityNorm(Balance(mode->dynamics).matrix);
  return mode;
}

}  // namespace dlcs
