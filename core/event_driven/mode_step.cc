// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/mode_step.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

constexpr Index K = kLegendreDegree;
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
ModeStepper::Scalar ModeStepper::Eliminate(Complex z) {
  Scalar scalar;
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

ModeStepper::ModeStepper(const Mode& mode, double length) : mode_(mode), half_(length / 2) {
  const Index size = mode.form.triangle.rows();
  scalars_.reserve(size);
  for (Index j = 0; j < size; ++j) scalars_.push_back(Eliminate(half_ * mode.form.triangle(j, j)));
}

void ModeStepper::SolveTriangle(ComplexSeries& c) const {
  using Row = Eigen::Matrix<Complex, 1, kLegendreSize>;
  const Eigen::MatrixXcd& triangle = mode_.form.triangle;
  for (Index j = c.rows() - 1; j >= 0; --j) {
    SolveScalar(scalars_[j], c.row(j).data());
    if (j == 0) break;
    const Row of_j = half_ * Integral<Row>(c.row(j));
    for (Index i = 0; i < j; ++i) {
      if (triangle(i, j) != 0.0) c.row(i) += triangle(i, j) * of_j;
    }
  }
}

LegendreSeries ModeStepper::SolveIntegrated(const LegendreSeries& integral) const {
  ComplexSeries c = mode_.form.inverse * integral;
  SolveTriangle(c);
  return (mode_.form.vectors * c).real();
}

ModeStepper::Solution ModeStepper::Solve(const Eigen::Ref<const Vector>& start, const LegendreSeries& source) const {
  constexpr double kRounding = 4 * std::numeric_limits<double>::epsilon();
  constexpr int kMostCorrections = 4;
  LegendreSeries integral = half_ * Integral(source);
  integral.col(0) = start;
  Solution solution{SolveIntegrated(integral), Vector::Zero(start.size())};
  LegendreSeries& c = solution.x;
  const Vector given = integral.cwiseAbs().rowwise().sum();
  for (int correction = 0; correction < kMostCorrections; ++correction) {
    LegendreSeries missing = integral + half_ * Integral<LegendreSeries>(mode_.dynamics * c) - c;
    Vector at_start = c.col(0);
    for (Index k = 1; k <= K; ++k) at_start += (k % 2 ? -1 : 1) * c.col(k);
    missing.col(0) = start - at_start;
    const Vector size = c.cwiseAbs().rowwise().sum();
    const Vector rounding = kRounding * (given + size + half_ * (mode_.dynamics_size * size));
    const auto is_more = missing.cwiseAbs().rowwise().maxCoeff().array() > rounding.array();
    if (!is_more.any()) {
      solution.uncertainty.setZero();
      break;
    }
    const LegendreSeries change = SolveIntegrated(missing);
    const Vector changed = change.cwiseAbs().rowwise().sum();
    // What does not converge is left as it is, and the step is too long for the form.
    if (!changed.allFinite() || (correction > 0 && (changed.array() > solution.uncertainty.array()).all())) break;
    c += change;
    solution.uncertainty = changed;
  }
  return solution;
}

Matrix ModeStepper::Respond(const Eigen::Ref<const Matrix>& starts, const Eigen::Ref<const Matrix>& sources,
                            const Eigen::Ref<const Matrix>& at) const {
  const Eigen::MatrixXcd from = mode_.form.inverse * starts, driven = mode_.form.inverse * (half_ * sources);
  Eigen::MatrixXcd values(starts.rows(), starts.cols() * at.cols());
  ComplexSeries c(starts.rows(), kLegendreSize);
  for (Index e = 0; e < starts.cols(); ++e) {
    c.setZero();
    c.col(0) = from.col(e);
    c.col(1) = driven.col(e);
    SolveTriangle(c);
    values.middleCols(e * at.cols(), at.cols()).noalias() = c * at;
  }
  return (mode_.form.vectors * values).real();
}

}  // namespace dlcs
