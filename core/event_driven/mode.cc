// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/mode.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>
#include <utility>

#include "core/linalg/balance.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/decompositions.h"
#include "core/linalg/double_double.h"
#include "core/linalg/equilibration.h"
#include "core/linalg/norms.h"
#include "core/linalg/panel_product.h"
#include "core/linalg/refined_inverse.h"
#include "core/linalg/structural_zeros.h"

namespace dlcs {
namespace {

// Zeros that follow from those of the matrix are exact.
ScaledInverse Invert(const Matrix& scaled, Vector row, Vector column) {
  ScaledInverse result{RefinedInverse(scaled), std::move(row), std::move(column)};
  Matrix inverse = result.inverse.value();
  ClearStructuralZeros(scaled, inverse);
  result.inverse.SetZeroWhere(inverse.array() == 0);
  return result;
}

// Absent where the matrix is singular to working precision, in units in which rows and columns are of size one.
std::optional<ScaledInverse> Invert(const Matrix& matrix) {
  if (matrix.size() == 0) return Invert(matrix, Vector(0), Vector(0));
  const Equilibration scale = EquilibrateRowsAndColumns(matrix);
  const Matrix scaled = Scaled(matrix, scale);
  ScaledInverse result = Invert(scaled, scale.row, scale.column);
  if (!(InfinityNorm(scaled) * InfinityNorm(result.inverse.value()) * kSingularY < 1)) return std::nullopt;
  return result;
}

// Sets the entries of an inverse to zero that one ulp of the entries of `matrix` moves by as much: unknowns that depend
// on a right-hand side by rounding alone. A large right-hand side there would give them a sign.
void ClearRounding(const Matrix& matrix, RefinedInverse& inverse) {
  const Matrix sizes = inverse.value().cwiseAbs();
  const Matrix moved = RoundingOf(8) * (sizes * (matrix.cwiseAbs() * sizes));
  inverse.SetZeroWhere(sizes.array() <= moved.array());
}

// Columns S of an identity: selects, and puts back.
Matrix ColumnsOfIdentity(Index n, const std::vector<Index>& S) {
  Matrix selector = Matrix::Zero(n, static_cast<Index>(S.size()));
  for (std::size_t p = 0; p < S.size(); ++p) selector(S[p], static_cast<Index>(p)) = 1;
  return selector;
}

// left - quotient · right, whose entries are zero where they are the rounding of their terms. The voltage of an open
// switch may be the difference of terms 1e12 times its size.
Matrix RestWithoutRounding(const Matrix& left, const Matrix& quotient, const Matrix& terms_of_quotient,
                           const Matrix& right) {
  const Matrix rest = left - quotient * right;
  const Matrix terms = left.cwiseAbs() + terms_of_quotient * right.cwiseAbs();
  return (rest.array().abs() > RoundingOf(16) * terms.array()).select(rest, 0);
}

// y_S by the rows of a nonsingular M_SS, and the equation of the states. Absent where M_SS is singular.
std::optional<Multipliers> SubstituteMultipliers(const Problem& problem, Mode& mode) {
  const std::vector<Index>& S = mode.active;
  const Matrix M_SS = problem.M.Dense()(S, S);
  auto inverse = Invert(M_SS);
  if (!inverse) return std::nullopt;
  ClearRounding(Scaled(M_SS, {inverse->row, inverse->column}), inverse->inverse);
  const Matrix N_S = problem.N.Dense()(S, Eigen::all);
  const Matrix selector = ColumnsOfIdentity(problem.num_constraints(), S);
  const Matrix quotient = inverse->Quotient(problem.B.Dense()(Eigen::all, S));
  mode.F = problem.A.Dense() - Product(quotient, N_S);
  mode.F_terms = problem.A.Dense().cwiseAbs() + quotient.cwiseAbs() * N_S.cwiseAbs();
  if (!S.empty()) mode.source_g = -quotient * selector.transpose();
  return Multipliers{*std::move(inverse), M_SS, N_S, selector.transpose(), {}};
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

// y on S, and w = N x + g + M y elsewhere; w_i + w_j where j is in S, so that w_j = 0, and its row is the opposite. Of
// the two slacks of an open switch, w and -w, rounding would be left.
LinearOutput MakeGuard(const Problem& problem, const std::vector<Index>& opposite, const std::vector<Index>& S,
                       const Multipliers& multipliers) {
  const Index n = problem.num_constraints();
  Matrix of_x = problem.N.Dense(), of_g = Matrix::Identity(n, n), of_y = problem.M.Dense()(Eigen::all, S);
  for (Index i = 0; i < n; ++i) {
    const Index j = opposite[static_cast<std::size_t>(i)];
    if (j < 0 || !std::binary_search(S.begin(), S.end(), j)) continue;
    of_x.row(i).setZero();
    of_g(i, j) = 1;
    of_y.row(i) += problem.M.Dense()(j, S);
  }
  for (std::size_t p = 0; p < S.size(); ++p) {
    of_x.row(S[p]).setZero();
    of_g.row(S[p]).setZero();
    of_y.row(S[p]) = Vector::Unit(of_y.cols(), static_cast<Index>(p)).transpose();
  }
  return multipliers.Substitute(of_x, of_g, of_y);
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
  double rounding = kSingularY;
  for (const Index i : own) {
    const double size = factors(i, driving).cwiseAbs().maxCoeff();
    if (size == 0) continue;
    rows.push_back(i);
    rounding = std::max(rounding, kSingularY * summed(i, driving).maxCoeff() / size);
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
  // The rows of M_SS, which keep the equations of the states as they are. ModeTest fails without.
  constexpr double kPreferred = 4096;
  const double kFirst = std::sqrt(std::numeric_limits<double>::max());  // above all others
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
    if (!(std::abs(lu.matrixLU()(p, p)) > kSingularY * size)) return std::nullopt;
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
PivotElimination EliminatePivots(const ScaledFactors& scaled, const PivotRows& chosen, const RefinedInverse& inverse) {
  const auto& [pivots, others] = chosen;
  const Index m = static_cast<Index>(others.size()), k = static_cast<Index>(pivots.size());
  const Matrix of_others = scaled.matrix(others, Eigen::all);
  PivotElimination elimination;
  Matrix& factors = elimination.factors;
  factors = inverse.Quotient(of_others);
  const Matrix summed = of_others.cwiseAbs() * inverse.value().cwiseAbs();
  std::vector<Index> own, driving;  // rows of M_SS among the others, differential equations among the pivots
  for (Index i = 0; i < m; ++i) {
    if (others[static_cast<std::size_t>(i)] >= m) own.push_back(i);
  }
  for (Index p = 0; p < k && pivots[static_cast<std::size_t>(p)] < m; ++p) driving.push_back(p);
  // What M_SS leaves of differential equations in its own rows where it is singular is rounding.
  for (const Index i : own) {
    for (const Index p : driving) {
      if (std::abs(factors(i, p)) <= kSingularY * summed(i, p)) factors(i, p) = 0;
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

// y_S by the chosen pivots, and the equations of the states that remain. Absent where E is singular.
std::optional<Multipliers> Eliminate(const ModeEquations& equations, const ScaledFactors& scaled,
                                     const PivotRows& chosen, Mode& mode) {
  const std::vector<Index>&pivots = chosen.pivots, &others = chosen.others;
  const Index m = equations.of_x.cols();
  ScaledInverse inverse = Invert(scaled.matrix(pivots, Eigen::all), scaled.row(pivots), scaled.column);
  const PivotElimination elimination = EliminatePivots(scaled, chosen, inverse.inverse);
  mode.num_algebraic = elimination.num_algebraic;
  mode.row_of_state.assign(static_cast<std::size_t>(m), -1);
  for (Index row = 0; row < m; ++row) {
    const Index i = others[static_cast<std::size_t>(elimination.order[static_cast<std::size_t>(row)])];
    if (i < m) mode.row_of_state[static_cast<std::size_t>(i)] = row;
  }
  mode.E = elimination.Rest(equations.slope, chosen);
  mode.F = elimination.Rest(equations.of_x, chosen);
  mode.source_g = elimination.Rest(equations.of_g, chosen);
  mode.E_terms = elimination.TermsOfRest(equations.slope, chosen);
  mode.F_terms = elimination.TermsOfRest(equations.of_x, chosen);

  mode.of_slope = mode.E;
  mode.of_slope.bottomRows(mode.num_algebraic) = mode.algebraic_rows();
  const auto slope = Invert(mode.of_slope);
  if (!slope) return std::nullopt;
  mode.solve_slope = slope->Value();
  mode.correction = mode.solve_slope.rightCols(mode.num_algebraic);
  const Index rest = m - mode.num_algebraic;
  mode.dynamics = mode.solve_slope.leftCols(rest) * mode.F.topRows(rest);
  return Multipliers{std::move(inverse), equations.of_y(pivots, Eigen::all), equations.of_x(pivots, Eigen::all),
                     equations.of_g(pivots, Eigen::all), equations.slope(pivots, Eigen::all)};
}

std::vector<std::complex<double>> Eigenvalues(const PencilForm& form) {
  const Index m = form.triangle.rows();
  double largest = 0;
  for (Index j = 0; j < m; ++j) largest = std::max(largest, std::abs(form.Slope(j, j)));
  std::vector<std::complex<double>> eigenvalues;
  for (Index j = 0; j < m; ++j) {
    const std::complex<double> slope = form.Slope(j, j);
    if (std::abs(slope) > RoundingOf(128) * largest) eigenvalues.push_back(form.triangle(j, j) / slope);
  }
  return eigenvalues;
}

Eigen::VectorXcd SlowestLeftVector(const PencilForm& form, const std::vector<std::complex<double>>& eigenvalues) {
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
    const double smallest = kUlp * (above.cwiseAbs().maxCoeff() + std::abs(form.triangle(k, k)));
    const std::complex<double> pivot = shifted(k, k);
    const std::complex<double> sum = (vector.head(k).transpose() * above)(0);
    if (sum != 0.0) vector[k] = -sum / (std::abs(pivot) < smallest ? smallest : pivot);
  }
  return (vector.transpose() * (form.left.size() > 0 ? form.left : form.inverse)).transpose();
}

}  // namespace

Matrix ScaledInverse::Quotient(const Matrix& rows) const {
  return inverse.Quotient(rows * column.asDiagonal()) * row.asDiagonal();
}

Matrix ScaledInverse::TermsOfQuotient(const Matrix& rows, const Matrix& quotient) const {
  const Matrix of_scaled = quotient * row.cwiseInverse().asDiagonal();
  return inverse.TermsOfQuotient(rows * column.asDiagonal(), of_scaled) * row.asDiagonal();
}

LinearOutput Multipliers::Substitute(const Matrix& of_states, const Matrix& of_sources,
                                     const Matrix& of_multipliers) const {
  const Matrix quotient = inverse.Quotient(of_multipliers), terms = inverse.TermsOfQuotient(of_multipliers, quotient);
  LinearOutput output;
  output.state = RestWithoutRounding(of_states, quotient, terms, of_x);
  output.g = RestWithoutRounding(of_sources, quotient, terms, of_g);
  if (slope.size() == 0) return output;
  output.slope = quotient * slope;
  output.f = -output.slope;
  return output;
}

void Multipliers::Refine(const std::vector<Index>& S, const LegendreSeries& x, const LegendreSeries& x_slope,
                         const LegendreSeries& f, const LegendreSeries& g, LegendreSeries& y) const {
  LegendreSeries residual(of_y.rows(), kLegendreSize);
  for (Index p = 0; p < residual.rows(); ++p) {
    for (Index k = 0; k < kLegendreSize; ++k) {
      DoubleDouble sum = 0;
      const auto add = [&sum](double factor, const DoubleDouble& value) {
        if (factor != 0) sum = sum + DoubleDouble(factor) * value;
      };
      for (std::size_t q = 0; q < S.size(); ++q) add(of_y(p, static_cast<Index>(q)), y(S[q], k));
      for (Index i = 0; i < x.rows(); ++i) add(of_x(p, i), x(i, k));
      for (Index i = 0; i < g.rows(); ++i) add(of_g(p, i), g(i, k));
      for (Index i = 0; i < slope.cols(); ++i) add(-slope(p, i), DoubleDouble(x_slope(i, k)) - f(i, k));
      residual(p, k) = sum.Rounded();
    }
  }
  y(S, Eigen::all) -= inverse.Solve(residual);
}

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

// Gaussian elimination of y_S with complete pivoting, each equation relative to the size of its other terms. Absent
// where y_S is not determined; `mode` has no E where its pivots are the rows of M_SS.
std::unique_ptr<Mode> ModeMaker::MakeEquations(std::vector<Index> active, const DataSizes& sizes) const {
  auto result = std::make_unique<Mode>();
  Mode& mode = *result;
  mode.active = std::move(active);
  const std::vector<Index>& S = mode.active;
  const Index m = problem_.num_states(), n = problem_.num_constraints();
  std::optional<Multipliers> multipliers;
  if (S.empty()) {
    multipliers = SubstituteMultipliers(problem_, mode);
  } else {
    const ModeEquations equations = EquationsOf(S);
    const ScaledFactors scaled = ScaleFactors(equations, sizes, problem_.horizon);
    const auto chosen = ChoosePivots(scaled.matrix);
    if (!chosen) return nullptr;
    if (chosen->pivots.front() >= m) multipliers = SubstituteMultipliers(problem_, mode);
    if (!multipliers) multipliers = Eliminate(equations, scaled, *chosen, mode);
    if (!multipliers) return nullptr;
  }
  mode.y = multipliers->Substitute(Matrix::Zero(n, m), Matrix::Zero(n, n), ColumnsOfIdentity(n, S));
  mode.guard = MakeGuard(problem_, opposite_, S, *multipliers);
  if (const Outputs& given = problem_.outputs; given.shown() > 0) {
    const Index p = given.shown();
    mode.outputs_of_y = given.D.Dense().topRows(p)(Eigen::all, S);
    mode.outputs = multipliers->Substitute(given.C.Dense().topRows(p), Matrix::Zero(p, n), mode.outputs_of_y);
  }
  if (mode.is_explicit()) mode.dynamics = mode.F;
  for (LinearOutput* output : {&mode.guard, &mode.outputs}) {
    if (mode.num_algebraic == 0 || output->slope.size() == 0) continue;
    output->slope_g = -output->slope * mode.correction * mode.algebraic_g();
  }
  if (multipliers->inverse.inverse.is_refined()) mode.refinement = std::move(multipliers);
  return result;
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
