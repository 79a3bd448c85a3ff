// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/mode_step.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/linalg/abs_times.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

constexpr Index K = kLegendreDegree;
// A component with a larger |z| has a layer at the start of a step, and then follows the others. ModeStepTest feels it.
constexpr double kFast = 20 * K;
constexpr double Odd(Index k) { return static_cast<double>(2 * k + 1); }

// Column k > 0: what the integral of `series` has of P_k, by ∫P_k = (P_{k+1} - P_{k-1})/(2k+1), where the last
// coefficient is counted to the one before: at the Radau points P_K = P_{K-1}. Column 0 is zero.
template <typename Series>
Series Integral(const Series& series) {
  Series integral(series.rows(), kLegendreSize);
  integral.col(0).setZero();
  integral.col(K) = (series.col(K - 1) + series.col(K)) / Odd(K - 1);
  integral.col(K - 1) = series.col(K - 2) / Odd(K - 2);
  for (Index k = 1; k <= K - 2; ++k) {
    integral.col(k) = series.col(k - 1) / Odd(k - 1);
    if (k == K - 2) {
      integral.col(k) -= (series.col(K - 1) + series.col(K)) / Odd(K - 1);
    } else {
      integral.col(k) -= series.col(k + 1) / Odd(k + 1);
    }
  }
  return integral;
}

// Without the search for infinities that std::complex makes.
std::complex<double> Times(const std::complex<double>& a, const std::complex<double>& b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

// |z| within a factor of √2, without a root.
double SizeOf(const std::complex<double>& z) { return std::abs(z.real()) + std::abs(z.imag()); }
template <typename Derived>
auto SizesOf(const Eigen::MatrixBase<Derived>& matrix) {
  return matrix.unaryExpr([](const std::complex<double>& z) { return SizeOf(z); });
}

// Subtracts the multiples `layers` of P_K - P_{K-1}.
template <typename Layers, typename Series>
void Subtract(const Layers& layers, Series& series) {
  series.col(K) -= layers;
  series.col(K - 1) += layers;
}

// The values of the polynomials at the looks.
const Matrix& AtLooks() {
  static const Matrix at = [] {
    LegendreRows rows;
    LegendreValuesAt(Vector{{-0.9, -0.4, 0.3, 1}}, rows);
    return Matrix(rows.transpose());
  }();
  return at;
}

// `units` applied to the starts and the sources; no `sources` stand for zero.
Matrix Combine(const Matrix& units, const Eigen::Ref<const Matrix>& starts, const Eigen::Ref<const Matrix>& sources) {
  const Index m = units.rows();
  Matrix response = units.leftCols(m).lazyProduct(starts);
  if (sources.cols() > 0) response += units.rightCols(m).lazyProduct(sources);
  return response;
}

std::complex<double> Inverse(const std::complex<double>& z) {
  // Scaled, since the square of a large |z| overflows.
  const double size = std::max(std::abs(z.real()), std::abs(z.imag()));
  const double a = z.real() / size, b = z.imag() / size;
  const double over = 1 / (size * (a * a + b * b));
  return {a * over, -b * over};
}

}  // namespace

// With v = z x + r + τ (P_K - P_{K-1}) of degree K - 1, which is x', the integral of P_k gives
//     c_k = v_{k-1}/(2k-1) - v_{k+1}/(2k+3),   k = 1 ... K.
// Elimination from k = K down expresses each c_k by c_{k-1}, as c_k = offset_k + ratio_k c_{k-1}; then
// Σ(-1)^k c_k = start.
// slope c' = rate c; `half_rate`: rate times half the length. Algebraic equations are those of states that are too fast
// to be seen.
ModeStepper::Scalar ModeStepper::Eliminate(Complex slope, Complex half_rate) {
  constexpr double kUnseen = 1e-20;  // HostileSeeds feels a quarter of it
  if (std::abs(slope) <= kUnseen * std::abs(half_rate)) slope = -kUnseen * half_rate;
  Scalar scalar;
  scalar.over_slope = Inverse(slope);
  const Complex z = scalar.z = Times(half_rate, scalar.over_slope);
  scalar.over_pivot = Inverse(1.0 - z / Odd(K - 1));
  scalar.ratio[K] = Times(z / Odd(K - 1), scalar.over_pivot);
  scalar.ratio[K - 1] = z / Odd(K - 2);
  // What z multiplies in v_{k+1}, as a function of c_k; for k + 1 = K - 1 that is c_{K-1} + c_K = offset_K +
  // c_{K-1} / pivot.
  Complex next_ratio = Times(scalar.ratio[K - 1], scalar.over_pivot);
  for (Index k = K - 2; k >= 1; --k) {
    scalar.weight[k] = z / Odd(k + 1);
    scalar.over_divisor[k] = Inverse(1.0 + Times(scalar.weight[k], next_ratio));
    scalar.ratio[k] = Times(z / Odd(k - 1), scalar.over_divisor[k]);
    next_ratio = scalar.ratio[k];
  }
  Complex factor = 1, sum = 1;
  for (Index k = 1; k <= K; ++k) {
    factor = Times(factor, scalar.ratio[k]);
    sum += k % 2 ? -factor : factor;
  }
  scalar.over_sum = Inverse(sum);
  return scalar;
}

void ModeStepper::SolveScalar(const Scalar& scalar, Complex* c) {
  const Complex start = c[0];
  c[K] = Times(c[K], scalar.over_pivot);
  Complex next = c[K] + Times(c[K - 1], scalar.over_pivot);
  for (Index k = K - 2; k >= 1; --k) {
    next = c[k] = Times(c[k] - Times(scalar.weight[k], next), scalar.over_divisor[k]);
  }
  // c_k = fixed + factor · c_0.
  Complex fixed = 0, sum = 0;
  for (Index k = 1; k <= K; ++k) {
    fixed = c[k] + Times(scalar.ratio[k], fixed);
    sum += k % 2 ? -fixed : fixed;
  }
  c[0] = Times(start - sum, scalar.over_sum);
  Complex at_start = c[0];
  for (Index k = 1; k <= K; ++k) {
    c[k] += Times(scalar.ratio[k], c[k - 1]);
    at_start += k % 2 ? -c[k] : c[k];
  }
  // For large |z| the rounding of c_{K-2} comes back in c_{K-1} = -c_K, times |z|: a multiple of P_K -
  // P_{K-1}, which no collocation point sees, and the start does.
  const Complex missing = (start - at_start) / 2.0;
  c[K] += missing;
  c[K - 1] -= missing;
}

ModeStepper::ModeStepper(const Mode& mode, double length) : mode_(&mode), half_(length / 2) {
  const Index size = mode.form.triangle.rows();
  scalars_.reserve(size);
  for (Index j = 0; j < size; ++j) {
    scalars_.push_back(Eliminate(mode.form.Slope(j, j), half_ * mode.form.triangle(j, j)));
    has_fast_ = has_fast_ || std::abs(scalars_.back().z) > kFast;
  }
}

void ModeStepper::SolveTriangle(ComplexSeries& c) const {
  const PencilForm& form = mode_->form;
  for (Index j = c.rows() - 1; j >= 0; --j) {
    if (!form.is_explicit()) c.row(j).tail(K) *= scalars_[j].over_slope;
    SolveScalar(scalars_[j], c.row(j).data());
    if (j == 0) break;
    const ComplexRow of_j = half_ * Integral<ComplexRow>(c.row(j));
    for (Index i = 0; i < j; ++i) {
      if (form.triangle(i, j) != 0.0) c.row(i) += form.triangle(i, j) * of_j;
      if (!form.is_explicit() && form.slope_triangle(i, j) != 0.0) {
        c.row(i).tail(K) -= form.slope_triangle(i, j) * c.row(j).tail(K);
      }
    }
  }
}

ModeStepper::ComplexSeries ModeStepper::SolveIntegrated(const LegendreSeries& integral) const {
  const PencilForm& form = mode_->form;
  ComplexSeries c;
  if (form.is_explicit()) {
    c = form.inverse * integral;
  } else {
    c.resize(integral.rows(), kLegendreSize);
    c.col(0) = form.inverse * integral.col(0);
    c.rightCols(K) = form.left * integral.rightCols(K);
  }
  SolveTriangle(c);
  return c;
}

LegendreSeries ModeStepper::States(const ComplexSeries& c) const { return (mode_->form.vectors * c).real(); }

LegendreSeries ModeStepper::Missing(const LegendreSeries& x, const LegendreSeries& integral,
                                    const Eigen::Ref<const Vector>& start) const {
  LegendreSeries missing = integral + half_ * Integral(Apply(mode_->F, x));
  if (mode_->is_explicit()) {
    missing -= x;
  } else {
    missing -= Apply(mode_->E, x);
  }
  Vector at_start = x.col(0);
  for (Index k = 1; k <= K; ++k) at_start += (k % 2 ? -1 : 1) * x.col(k);
  missing.col(0) = start - at_start;
  return missing;
}

// At degree K an equation slope c' = rate c + r reads 0 = rate c_K + r_K + τ, where τ (P_K - P_{K-1}) is its
// residual and -τ/rate the layer. So what a smooth source makes of c_K and c_{K-1} is no layer.
Eigen::VectorXcd ModeStepper::LayersOf(const ComplexSeries& c, const Eigen::Ref<const Eigen::MatrixXcd>& source,
                                       OfRounding of_rounding) const {
  constexpr double kCancels = 1.0 / 8;  // HostileSeeds feels 4 times as much
  constexpr Index kOperations = 48;  // of the terms
  const PencilForm& form = mode_->form;
  Eigen::VectorXcd layer = Eigen::VectorXcd::Zero(c.rows());
  Eigen::MatrixX2cd last = c.rightCols<2>();  // without the layers
  bool has_layer = false;
  const Vector size = SizesOf(c).rowwise().maxCoeff();
  for (Index j = c.rows() - 1; j >= 0; --j) {
    const Index after = c.rows() - j - 1;
    if (std::abs(scalars_[j].z) > kFast) {
      const auto of_others = form.triangle.row(j).tail(after);
      const Complex rate = form.triangle(j, j);
      const Eigen::RowVector2cd smooth = -(source.row(j) + of_others * last.bottomRows(after)) / rate;
      const Eigen::RowVector2cd rough = last.row(j) - smooth;
      const Complex part = (rough[1] - rough[0]) / 2.0;
      const double terms = size[j] + SizesOf(of_others).dot(size.tail(after)) / std::abs(rate);
      const bool cancels = std::abs(rough[0] + rough[1]) <= kCancels * std::abs(part);
      if (cancels && (of_rounding == OfRounding::kToo || std::abs(part) > RoundingOf(kOperations) * terms))
        layer[j] = part;
    } else if (has_layer && !form.is_explicit()) {
      // Slow components move with the fast ones so that E x stays what it was.
      for (Index i = j + 1; i < c.rows(); ++i) layer[j] -= form.slope_triangle(j, i) * layer[i];
      layer[j] *= scalars_[j].over_slope;
    }
    last(j, 0) += layer[j];
    last(j, 1) -= layer[j];
    has_layer = has_layer || layer[j] != 0.0;
  }
  return layer;
}

std::vector<Index> ModeStepper::UnreachedStates(const Vector& start, const LegendreSeries& source) const {
  std::vector<Index> unreached;
  for (Index i = 0; i < start.size(); ++i) {
    const Index row = mode_->is_explicit() ? -1 : mode_->row_of_state[static_cast<std::size_t>(i)];
    if (row >= 0 && start[i] == 0 && (source.row(row).array() == 0).all()) unreached.push_back(i);
  }
  for (std::size_t before = start.size() + 1; !unreached.empty() && unreached.size() < before;) {
    before = unreached.size();
    std::vector<bool> reached(static_cast<std::size_t>(start.size()), true);
    for (const Index i : unreached) reached[static_cast<std::size_t>(i)] = false;
    std::erase_if(unreached, [&](Index i) {
      const Index row = mode_->row_of_state[static_cast<std::size_t>(i)];
      for (Index j = 0; j < start.size(); ++j) {
        if (reached[static_cast<std::size_t>(j)] && (mode_->F(row, j) != 0 || mode_->E(row, j) != 0)) return true;
      }
      return false;
    });
  }
  return unreached;
}

// By the equation itself; where that is mostly rounding, by the derivative of the polynomial.
void ModeStepper::AddSlope(const ComplexSeries& c, const LegendreSeries& source, const Vector& source_noise,
                           Solution& solution) const {
  const PencilForm& form = mode_->form;
  const Index m = c.rows();
  const ComplexSeries b = form.left * source;
  const Vector b_noise = SizesOf(form.left) * (kUlp * source.cwiseAbs().rowwise().sum() + source_noise);
  const Vector c_size = SizesOf(c).rowwise().sum();
  // Entries of the slope triangle have the rounding of the largest, of which a fast component's is a small part.
  const double of_triangle = kUlp * SizesOf(form.slope_triangle).maxCoeff();
  ComplexSeries slope(m, kLegendreSize);
  Vector slope_size(m), noise(m);
  for (Index j = m - 1; j >= 0; --j) {
    const Index after = m - 1 - j;
    const auto of_slopes = form.slope_triangle.row(j).tail(after);
    const auto of_states = form.triangle.row(j).tail(after + 1);
    const double over_slope = SizeOf(scalars_[j].over_slope);
    slope.row(j) = b.row(j) + of_states * c.bottomRows(after + 1) - of_slopes * slope.bottomRows(after);
    slope.row(j) *= scalars_[j].over_slope;
    slope_size[j] = SizesOf(slope.row(j)).sum();
    const double terms =
        SizesOf(of_states).dot(c_size.tail(after + 1)) + SizesOf(of_slopes).dot(slope_size.tail(after));
    const double by_equation = over_slope * (kUlp * terms + b_noise[j] + SizesOf(of_slopes).dot(noise.tail(after)) +
                                             of_triangle * slope_size.tail(after + 1).sum());
    // Of the source a component shows as much as it takes in on the step.
    const double of_source = half_ * b_noise[j] / (SizeOf(form.Slope(j, j)) + half_ * SizeOf(form.triangle(j, j)));
    const double by_derivative = kLegendreDegree * kLegendreDegree / half_ * (kUlp * c_size[j] + of_source);
    noise[j] = std::min(by_equation, by_derivative);
    if (by_equation <= by_derivative) continue;
    slope.row(j) = 1 / half_ * DerivativeOf<ComplexRow>(c.row(j));
    slope_size[j] = SizesOf(slope.row(j)).sum();
  }
  solution.slope = States(slope);
  solution.slope_noise = SizesOf(form.vectors) * noise;
}

// Components may be so large, and cancel so far in a state, that few digits of its slope are left. By the equations of
// the mode themselves, E x' = F x + b, of which the algebraic ones are differentiated, it has the rounding of their
// terms and, as often as fast states act in them, that of the states. Where no digit is left by either way, the
// derivative of its own polynomial, which was refined, has less. `x_noise`: the rounding of the states.
void ModeStepper::RefineSlope(const LegendreSeries& source, const Vector& source_noise, const SlopeOfSource& slope,
                              const Vector& x_noise, Solution& solution) const {
  const double of_derivative = kLegendreDegree * kLegendreDegree / half_;
  LegendreSeries rows = Apply(mode_->F, solution.x) + source;
  Vector noise = kUlp * (mode_->F_terms * SizeOfRows(solution.x) + SizeOfRows(source)) + source_noise;
  const Index first = rows.rows() - mode_->num_algebraic;
  Vector of_source = Vector::Zero(rows.rows());
  for (Index i = first; i < rows.rows(); ++i) {
    noise[i] = of_derivative * (kUlp * source.row(i).cwiseAbs().sum() + source_noise[i]);
    if (slope.noise.size() > 0 && slope.noise[i - first] < noise[i]) {
      rows.row(i) = -slope.values.row(i - first);
      noise[i] = slope.noise[i - first];
    } else {
      rows.row(i) = -1 / half_ * DerivativeOf(LegendreVector(source.row(i))).transpose();
      of_source[i] = noise[i];
    }
  }
  const LegendreSeries by_rows = Apply(mode_->solve_slope, rows);
  noise += kUlp * (mode_->E_terms * SizeOfRows(by_rows));
  // What the slopes by components miss of these equations is what the triangular form is off by, which they do not see.
  // In the last two coefficients states keep the rounding of layers, and components do not.
  LegendreSeries missing = rows - Apply(mode_->of_slope, solution.slope);
  missing.rightCols<2>().setZero();
  const Vector known = noise + AbsTimes(mode_->of_slope, solution.slope_noise) + AbsTimes(mode_->F, x_noise);
  solution.slope_noise += AbsTimes(mode_->solve_slope, (SizeOfRows(missing) - known).cwiseMax(0));
  noise = AbsTimes(mode_->solve_slope, noise) + AbsTimes(mode_->dynamics, x_noise);
  for (Index i = 0; i < noise.size(); ++i) {
    if (noise[i] < solution.slope_noise[i]) {
      solution.slope.row(i) = by_rows.row(i);
      solution.slope_noise[i] = noise[i];
    }
    const double by_polynomial = of_derivative * x_noise[i];
    const bool has_digits = solution.slope_noise[i] < solution.slope.row(i).cwiseAbs().sum();
    if (has_digits || !(by_polynomial < solution.slope_noise[i])) continue;
    solution.slope.row(i) = 1 / half_ * DerivativeOf(LegendreVector(solution.x.row(i))).transpose();
    solution.slope_noise[i] = by_polynomial;
  }
  solution.source_slope_noise = AbsTimes(mode_->solve_slope, of_source).cwiseMin(solution.slope_noise);
}

Vector ModeStepper::Stiffness(const Vector& size) const {
  const Vector change = half_ * AbsTimes(mode_->dynamics, size);
  Vector stiffness(size.size());
  for (Index i = 0; i < size.size(); ++i) stiffness[i] = change[i] > 0 ? std::min(Odd(K), change[i] / size[i]) : 0;
  return stiffness;
}

ModeStepper::Solution ModeStepper::Solve(const Eigen::Ref<const Vector>& start, const LegendreSeries& source,
                                         const Vector& source_noise, const SlopeOfSource& slope) const {
  constexpr Index kOperations = 8;
  constexpr int kMaxCorrections = 16;
  const bool is_explicit = mode_->is_explicit();
  LegendreSeries integral = half_ * Integral(source);
  integral.col(0) = start;
  ComplexSeries c = SolveIntegrated(integral);
  LegendreSeries x = States(c);
  // In the triangular form they have the rounding of others.
  Solution solution;
  solution.unreached = UnreachedStates(start, source);
  for (const Index i : solution.unreached) x.row(i).setZero();
  solution.uncertainty = Vector::Zero(start.size());
  const Vector given_to_rows = integral.rightCols(K).cwiseAbs().rowwise().sum();
  LegendreSeries missing = Missing(x, integral, start);
  for (int correction = 0; correction < kMaxCorrections; ++correction) {
    const Vector size = x.cwiseAbs().rowwise().sum();
    const Vector of_states = RoundingOf(kOperations) * (start.cwiseAbs() + size);
    const Vector of_rows =
        RoundingOf(kOperations) *
        (given_to_rows + (is_explicit ? size : Vector(mode_->E_terms * size)) + half_ * (mode_->F_terms * size));
    const auto starts = missing.col(0).array().abs();
    const Vector rows = RowMaxAbs(missing.rightCols(K));
    if ((starts <= of_states.array()).all() && (rows.array() <= of_rows.array()).all()) {
      solution.uncertainty.setZero();
      break;
    }
    // Once corrected, the rounding of large rows would leave the square of it in small ones however often it is solved
    // for.
    LegendreSeries corrected = missing;
    if (correction > 0) {
      corrected.col(0) = (starts > of_states.array()).select(missing.col(0), 0);
      for (Index i = 0; i < rows.size(); ++i) {
        if (rows[i] <= of_rows[i]) corrected.row(i).tail(K).setZero();
      }
    }
    const ComplexSeries c_change = SolveIntegrated(corrected);
    const LegendreSeries change = States(c_change);
    const Vector changed = change.cwiseAbs().rowwise().sum();
    // What does not converge is left as it is, and the step is too long for the form.
    if (!changed.allFinite() || (correction > 0 && (changed.array() > solution.uncertainty.array()).all())) break;
    c += c_change;
    x += change;
    for (const Index i : solution.unreached) x.row(i).setZero();
    missing = Missing(x, integral, start);
    solution.uncertainty = changed;
  }
  solution.left = States(SolveIntegrated(missing));
  for (const Index i : solution.unreached) solution.left.row(i).setZero();
  // The components have more rounding than the refined states, to which their differences would add it; in x' it counts
  // |z| times.
  solution.layer = solution.kept_layer = solution.last_noise = Vector::Zero(start.size());
  solution.x = x;
  if (has_fast_) {
    const Eigen::MatrixX2cd last_of_source =
        (is_explicit ? mode_->form.inverse : mode_->form.left) * source.rightCols<2>();
    solution.layer_parts = LayersOf(c, last_of_source, OfRounding::kNot);
    solution.layer = (mode_->form.vectors * solution.layer_parts).real();
    const Eigen::VectorXcd with_rounding = LayersOf(c, last_of_source, OfRounding::kToo);
    solution.kept_layer = ((mode_->form.vectors * with_rounding).real() - solution.layer).cwiseAbs();
    for (const Index i : solution.unreached) solution.layer[i] = 0;
    Subtract(solution.layer, solution.x);
    Subtract(with_rounding, c);
  }
  const Vector size = solution.x.cwiseAbs().rowwise().sum();
  const Vector last = RowMaxAbs(solution.x.rightCols<2>());
  solution.kept_layer = solution.kept_layer.cwiseMin(last);
  solution.stiffness = Stiffness(size);
  if (solution.IsStiff() && (last.array() > RoundingOf(2 * kOperations) * size.array()).any()) {
    solution.last_noise = RowMaxAbs(solution.left.rightCols<4>());
  }
  if (!is_explicit) {
    AddSlope(c, source, source_noise, solution);
    // Algebraic equations move states by the rounding of their sources.
    const Vector of_sources = kUlp * SizeOfRows(source) + source_noise;
    const Vector x_noise = RoundingOf(kOperations) * (start.cwiseAbs() + size) + solution.uncertainty +
                           solution.kept_layer + solution.last_noise +
                           AbsTimes(mode_->correction, of_sources.tail(mode_->num_algebraic));
    RefineSlope(source, source_noise, slope, x_noise, solution);
    for (const Index i : solution.unreached) solution.slope.row(i).setZero();
  }
  return solution;
}

ModeStepper::Response ModeStepper::Respond(const Eigen::Ref<const Matrix>& starts,
                                           const Eigen::Ref<const Matrix>& sources,
                                           const Eigen::Ref<const Matrix>& at) const {
  const PencilForm& form = mode_->form;
  const Eigen::MatrixXcd from = form.inverse * starts;
  Eigen::MatrixXcd driven;
  if (sources.cols() > 0) driven = (form.is_explicit() ? form.inverse : form.left) * (half_ * sources);
  Eigen::MatrixXcd values(starts.rows(), starts.cols() * at.cols()), slopes;
  Matrix slope_at;
  if (!form.is_explicit()) {
    slopes.resize(values.rows(), values.cols());
    slope_at.resize(kLegendreSize, at.cols());
    for (Index j = 0; j < at.cols(); ++j) slope_at.col(j) = 1 / half_ * LegendreSlopes(at.col(j));
  }
  ComplexSeries c(starts.rows(), kLegendreSize);
  const Eigen::MatrixX2cd no_source = Eigen::MatrixX2cd::Zero(starts.rows(), 2);  // at degrees K - 1 and K
  for (Index e = 0; e < starts.cols(); ++e) {
    c.setZero();
    c.col(0) = from.col(e);
    if (sources.cols() > 0) c.col(1) = driven.col(e);
    SolveTriangle(c);
    if (has_fast_) Subtract(LayersOf(c, no_source, OfRounding::kToo), c);
    values.middleCols(e * at.cols(), at.cols()).noalias() = c.lazyProduct(at);
    if (!form.is_explicit()) slopes.middleCols(e * at.cols(), at.cols()).noalias() = c.lazyProduct(slope_at);
  }
  Response response{(form.vectors * values).real(), {}};
  if (!form.is_explicit()) response.slopes = (form.vectors * slopes).real();
  return response;
}

ModeStepper::Response ModeStepper::RespondAt(double s, const Eigen::Ref<const Matrix>& starts,
                                             const Eigen::Ref<const Matrix>& sources) const {
  if (!units_ || s != 1) return Respond(starts, sources, LegendreValues(s));
  Response response{Combine(units_->values.back(), starts, sources), {}};
  if (!mode_->is_explicit()) response.slopes = Combine(units_->slopes, starts, sources);
  return response;
}

Matrix ModeStepper::RespondAtLooks(const Eigen::Ref<const Matrix>& starts,
                                   const Eigen::Ref<const Matrix>& sources) const {
  if (!units_) return Respond(starts, sources, AtLooks()).values;
  Matrix values(starts.rows(), starts.cols() * kLooks);
  for (Index look = 0; look < kLooks; ++look) {
    values(Eigen::all, Eigen::seqN(look, starts.cols(), Eigen::fix<kLooks>)) =
        Combine(units_->values[static_cast<std::size_t>(look)], starts, sources);
  }
  return values;
}

template <typename Visit>
void ModeStepper::SolveStarts(const Eigen::Ref<const Matrix>& starts, const Visit& visit) const {
  const Eigen::MatrixXcd from = mode_->form.inverse * starts;
  ComplexSeries c(starts.rows(), kLegendreSize);
  for (Index e = 0; e < starts.cols(); ++e) {
    c.setZero();
    c.col(0) = from.col(e);
    SolveTriangle(c);
    visit(c);
  }
}

Vector ModeStepper::LastOfStarts(const Eigen::Ref<const Matrix>& starts) const {
  Vector largest = Vector::Zero(starts.rows());
  SolveStarts(starts, [&](const ComplexSeries& c) {
    largest = largest.cwiseMax(RowMaxAbs((mode_->form.vectors * c.rightCols<2>()).real()));
  });
  return largest;
}

Eigen::VectorXcd ModeStepper::SlopesOfLayers(const Eigen::VectorXcd& parts, const Eigen::Ref<const Vector>& start,
                                             const Eigen::Ref<const Matrix>& errors) const {
  const PencilForm& form = mode_->form;
  const Eigen::MatrixX2cd no_source = Eigen::MatrixX2cd::Zero(parts.size(), 2);
  Vector of_errors = kUlp * (SizesOf(form.inverse) * start.cwiseAbs());
  SolveStarts(errors, [&](const ComplexSeries& c) {
    of_errors = of_errors.cwiseMax(LayersOf(c, no_source, OfRounding::kToo).cwiseAbs());
  });
  Eigen::VectorXcd slopes = Eigen::VectorXcd::Zero(parts.size());
  for (Index j = 0; j < parts.size(); ++j) {
    const double size = std::abs(parts[j]);
    if (form.Slope(j, j) == 0.0 || size <= of_errors[j]) continue;
    // P_K - P_{K-1} is 2 at the start.
    slopes[j] = scalars_[j].z / half_ * (2 * (1 - of_errors[j] / size)) * parts[j];
  }
  return slopes;
}

void ModeStepper::KeepResponses() {
  constexpr Index kMost = 8;
  const Index m = mode_->F.rows();
  if (units_ || has_fast_ || m > kMost) return;
  Matrix starts = Matrix::Zero(m, 2 * m), sources = starts;
  starts.leftCols(m).setIdentity();
  sources.rightCols(m).setIdentity();
  const Response all = Respond(starts, sources, AtLooks());
  units_.emplace();
  for (Index look = 0; look < kLooks; ++look) {
    units_->values[static_cast<std::size_t>(look)] =
        all.values(Eigen::all, Eigen::seqN(look, 2 * m, Eigen::fix<kLooks>));
  }
  if (!mode_->is_explicit()) {
    units_->slopes = all.slopes(Eigen::all, Eigen::seqN(kLooks - 1, 2 * m, Eigen::fix<kLooks>));
  }
}

}  // namespace dlcs
