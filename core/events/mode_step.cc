// SPDX-License-Identifier: Apache-2.0

#include "core/events/mode_step.h"

#include <array>
#include <complex>

namespace dlcs {
namespace {

using Complex = std::complex<double>;
using ComplexRow = Eigen::Matrix<Complex, 1, kLegendreSize>;

// The coefficients of the Radau polynomial of x' = z x + r on s in [-1, 1], x(-1) = start.
//
// With v = z x + r + τ (P_K - P_{K-1}) of degree K - 1, which is x', the integral of P_k gives
//     c_k = v_{k-1}/(2k-1) - v_{k+1}/(2k+3),   k = 1 ... K.
// Elimination from k = K down expresses each c_k by c_{k-1}, as c_k = offset_k + ratio_k c_{k-1}; then
// Σ(-1)^k c_k = start.
ComplexRow SolveScalar(Complex z, const ComplexRow& r, Complex start) {
  constexpr Index K = kLegendreDegree;
  const auto odd = [](Index k) { return static_cast<double>(2 * k + 1); };
  std::array<Complex, kLegendreSize> offset, ratio;

  const Complex pivot = 1.0 - z / odd(K - 1);
  ratio[K] = z / odd(K - 1) / pivot;
  offset[K] = (r[K - 1] + r[K]) / odd(K - 1) / pivot;
  ratio[K - 1] = z / odd(K - 2);
  offset[K - 1] = r[K - 2] / odd(K - 2);
  // What z multiplies in v_{k+1}, as a function of c_k; for k + 1 = K - 1 that is c_{K-1} + c_K = offset_K +
  // c_{K-1} / pivot.
  Complex next_offset = offset[K] + offset[K - 1] / pivot;
  Complex next_ratio = ratio[K - 1] / pivot;
  Complex next_source = r[K - 1] + r[K];
  for (Index k = K - 2; k >= 1; --k) {
    const Complex divisor = 1.0 + z * next_ratio / odd(k + 1);
    ratio[k] = z / odd(k - 1) / divisor;
    offset[k] = (r[k - 1] / odd(k - 1) - (z * next_offset + next_source) / odd(k + 1)) / divisor;
    next_offset = offset[k];
    next_ratio = ratio[k];
    next_source = r[k];
  }

  // c_k = fixed + factor · c_0.
  Complex fixed = 0, factor = 1, sum_fixed = 0, sum_factor = 1;
  for (Index k = 1; k <= K; ++k) {
    fixed = offset[k] + ratio[k] * fixed;
    factor *= ratio[k];
    sum_fixed += k % 2 ? -fixed : fixed;
    sum_factor += k % 2 ? -factor : factor;
  }
  ComplexRow c;
  c[0] = (start - sum_fixed) / sum_factor;
  Complex at_start = c[0];
  for (Index k = 1; k <= K; ++k) {
    c[k] = offset[k] + ratio[k] * c[k - 1];
    at_start += k % 2 ? -c[k] : c[k];
  }
  // For large |z| the rounding of c_{K-2} comes back in c_{K-1} = -c_K, times |z|: a multiple of P_K -
  // P_{K-1}, which no collocation point sees, and the start does.
  const Complex missing = (start - at_start) / 2.0;
  c[K] += missing;
  c[K - 1] -= missing;
  return c;
}

}  // namespace

LegendreSeries StepMode(const Mode& mode, const Eigen::Ref<const Vector>& start, const LegendreSeries& source,
                        double length) {
  using ComplexSeries = Eigen::Matrix<Complex, Eigen::Dynamic, kLegendreSize>;
  const Eigen::MatrixXcd& T = mode.triangle;
  const Index m = T.rows();
  const double half = length / 2;
  ComplexSeries r = half * (mode.vectors.adjoint() * source);
  const Eigen::VectorXcd from = mode.vectors.adjoint() * start;
  ComplexSeries c(m, kLegendreSize);
  for (Index j = m - 1; j >= 0; --j) {
    c.row(j) = SolveScalar(half * T(j, j), r.row(j), from[j]);
    for (Index i = 0; i < j; ++i) r.row(i) += half * T(i, j) * c.row(j);
  }
  return (mode.vectors * c).real();
}

}  // namespace dlcs
