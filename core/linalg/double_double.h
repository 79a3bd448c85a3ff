// SPDX-License-Identifier: Apache-2.0
// Real and complex numbers of 32 digits, as sums of two doubles.

#ifndef DLCS_CORE_LINALG_DOUBLE_DOUBLE_H_
#define DLCS_CORE_LINALG_DOUBLE_DOUBLE_H_

#include <cmath>
#include <complex>

namespace dlcs {

// high + low, |low| at most half an ulp of high. Errors of + - * / and Sqrt(): some 2⁻¹⁰⁴ of the result, as long as all
// magnitudes are in [1e-290, 1e290]. Requires IEEE arithmetic without contraction (CMakeLists.txt). Cost: 20 to 60
// operations. Source: [Dekker 1971] A floating-point technique for extending the available precision. Numerische
// Mathematik 18, 224-242.
struct DoubleDouble {
  double high = 0;
  double low = 0;

  DoubleDouble() = default;
  DoubleDouble(double value) : high(value) {}
  DoubleDouble(double h, double l) : high(h), low(l) {}
  double Rounded() const { return high; }
};

namespace double_double_internal {

// a + b and a · b to the last bit.
inline DoubleDouble Sum(double a, double b) {
  const double sum = a + b, of_b = sum - a;
  return {sum, (a - (sum - of_b)) + (b - of_b)};
}
inline DoubleDouble SumOfLargerFirst(double a, double b) {
  const double sum = a + b;
  return {sum, b - (sum - a)};
}
inline DoubleDouble Product(double a, double b) {
  constexpr double kSplit = 0x1p27 + 1;
  const double a_split = kSplit * a, b_split = kSplit * b;
  const double a_high = a_split - (a_split - a), b_high = b_split - (b_split - b);
  const double a_low = a - a_high, b_low = b - b_high;
  const double product = a * b;
  return {product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low};
}

}  // namespace double_double_internal

inline DoubleDouble operator-(const DoubleDouble& a) { return {-a.high, -a.low}; }
inline DoubleDouble operator+(const DoubleDouble& a, const DoubleDouble& b) {
  using namespace double_double_internal;
  const DoubleDouble highs = Sum(a.high, b.high), lows = Sum(a.low, b.low);
  const DoubleDouble sum = SumOfLargerFirst(highs.high, highs.low + lows.high);
  return SumOfLargerFirst(sum.high, sum.low + lows.low);
}
inline DoubleDouble operator-(const DoubleDouble& a, const DoubleDouble& b) { return a + -b; }
inline DoubleDouble operator*(const DoubleDouble& a, const DoubleDouble& b) {
  using namespace double_double_internal;
  const DoubleDouble product = Product(a.high, b.high);
  return SumOfLargerFirst(product.high, product.low + (a.high * b.low + a.low * b.high));
}
inline DoubleDouble operator/(const DoubleDouble& a, const DoubleDouble& b) {
  using namespace double_double_internal;
  const double first = a.high / b.high;
  const DoubleDouble left = a - b * DoubleDouble(first);
  const double second = left.high / b.high;
  const double third = (left - b * DoubleDouble(second)).high / b.high;
  return SumOfLargerFirst(first, second) + DoubleDouble(third);
}
inline DoubleDouble Sqrt(const DoubleDouble& a) {
  if (!(a.high > 0)) return a.high;
  const double root = std::sqrt(a.high);
  const DoubleDouble left = a - double_double_internal::Product(root, root);
  return double_double_internal::SumOfLargerFirst(root, left.high / (2 * root));
}

struct DoubleDoubleComplex {
  DoubleDouble real;
  DoubleDouble imag;

  std::complex<double> Rounded() const { return {real.Rounded(), imag.Rounded()}; }
  // |real| + |imag|, in double.
  double Size() const { return std::abs(real.high) + std::abs(imag.high); }
};

inline DoubleDoubleComplex operator+(const DoubleDoubleComplex& a, const DoubleDoubleComplex& b) {
  return {a.real + b.real, a.imag + b.imag};
}
inline DoubleDoubleComplex operator-(const DoubleDoubleComplex& a, const DoubleDoubleComplex& b) {
  return {a.real - b.real, a.imag - b.imag};
}
inline DoubleDoubleComplex operator*(const DoubleDoubleComplex& a, const DoubleDoubleComplex& b) {
  return {a.real * b.real - a.imag * b.imag, a.real * b.imag + a.imag * b.real};
}
inline DoubleDoubleComplex operator*(const DoubleDouble& a, const DoubleDoubleComplex& b) {
  return {a * b.real, a * b.imag};
}
inline DoubleDoubleComplex Conjugate(const DoubleDoubleComplex& a) { return {a.real, -a.imag}; }

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_DOUBLE_DOUBLE_H_
