// SPDX-License-Identifier: Apache-2.0
// Numbers of 106 bits as unevaluated sums of two doubles, and small dense matrices of them: the arithmetic of the
// reference of this suite. A sum or product is right to about 2^-104 of its size, which leaves 16 digits where double
// has none.
//
// Source: [Dekker 1971] T. J. Dekker. A floating-point technique for extending the available precision. Numerische
// Mathematik 18,
//         224-242. Needs round to nearest, and a compiler that neither reorders nor contracts.

#ifndef DLCS_TESTS_HOSTILE_DOUBLE_DOUBLE_EXP_H_
#define DLCS_TESTS_HOSTILE_DOUBLE_DOUBLE_EXP_H_

#include <cmath>
#include <vector>

namespace dlcs::hostile {

class Real {
 public:
  constexpr Real() = default;
  constexpr Real(double value) : high_(value) {}  // NOLINT: exact
  constexpr Real(double high, double low) : high_(high), low_(low) {}

  double high() const { return high_; }
  double low() const { return low_; }

  friend Real operator-(Real a) { return {-a.high_, -a.low_}; }
  friend Real operator+(Real a, Real b) {
    const Real s = TwoSum(a.high_, b.high_), t = TwoSum(a.low_, b.low_);
    const Real u = QuickTwoSum(s.high_, s.low_ + t.high_);
    return QuickTwoSum(u.high_, u.low_ + t.low_);
  }
  friend Real operator-(Real a, Real b) { return a + (-b); }
  friend Real operator*(Real a, Real b) {
    const Real p = TwoProduct(a.high_, b.high_);
    return QuickTwoSum(p.high_, p.low_ + (a.high_ * b.low_ + a.low_ * b.high_));
  }
  friend Real operator/(Real a, Real b) {
    const double first = a.high_ / b.high_;
    Real rest = a - b * Real(first);
    const double second = rest.high_ / b.high_;
    rest = rest - b * Real(second);
    return QuickTwoSum(first, second) + Real(rest.high_ / b.high_);
  }
  Real& operator+=(Real b) { return *this = *this + b; }
  Real& operator-=(Real b) { return *this = *this - b; }
  Real& operator*=(Real b) { return *this = *this * b; }

  friend bool operator<(Real a, Real b) { return a.high_ < b.high_ || (a.high_ == b.high_ && a.low_ < b.low_); }
  friend bool operator>(Real a, Real b) { return b < a; }
  friend bool operator<=(Real a, Real b) { return a.high_ < b.high_ || (a.high_ == b.high_ && a.low_ <= b.low_); }
  friend bool operator>=(Real a, Real b) { return b <= a; }
  friend bool operator==(Real a, Real b) { return a.high_ == b.high_ && a.low_ == b.low_; }

 private:
  static Real QuickTwoSum(double a, double b) {
    const double sum = a + b;
    return {sum, b - (sum - a)};
  }
  static Real TwoSum(double a, double b) {
    const double sum = a + b;
    const double part = sum - a;
    return {sum, (a - (sum - part)) + (b - part)};
  }
  static Real TwoProduct(double a, double b) {
    const double product = a * b;
    constexpr double kSplit = 134217729;  // 2^27 + 1
    const double s = kSplit * a, t = kSplit * b;
    const double a_high = s - (s - a), b_high = t - (t - b);
    const double a_low = a - a_high, b_low = b - b_high;
    return {product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low};
  }

  double high_ = 0;
  double low_ = 0;
};

inline double ToDouble(Real a) { return a.high(); }
inline Real Abs(Real a) { return a.high() < 0 ? -a : a; }
inline bool IsZero(Real a) { return a.high() == 0; }
inline Real Max(Real a, Real b) { return a < b ? b : a; }

inline Real Pi() { return {3.141592653589793116e+00, 1.224646799147353207e-16}; }

// Right to about 2^-98 of max(1, |a|) for |a| < 1e6.
Real Sin(Real a);
Real Cos(Real a);
Real Exp(Real a);

using Column = std::vector<Real>;

class DenseMatrix {
 public:
  DenseMatrix() = default;
  DenseMatrix(int rows, int cols) : rows_(rows), cols_(cols), entries_(static_cast<size_t>(rows) * cols) {}

  int rows() const { return rows_; }
  int cols() const { return cols_; }
  Real& operator()(int i, int j) { return entries_[static_cast<size_t>(i) * cols_ + j]; }
  const Real& operator()(int i, int j) const { return entries_[static_cast<size_t>(i) * cols_ + j]; }
  Real* row(int i) { return entries_.data() + static_cast<size_t>(i) * cols_; }
  const Real* row(int i) const { return entries_.data() + static_cast<size_t>(i) * cols_; }

 private:
  int rows_ = 0, cols_ = 0;
  std::vector<Real> entries_;
};

DenseMatrix Identity(int size);
DenseMatrix operator*(const DenseMatrix& a, const DenseMatrix& b);
Column operator*(const DenseMatrix& a, const Column& x);
// |a| |x|.
Column AbsoluteProduct(const DenseMatrix& a, const Column& x);
Real Dot(const Real* row, const Column& x);
Real AbsoluteDot(const Real* row, const Column& x);

}  // namespace dlcs::hostile

#endif  // DLCS_TESTS_HOSTILE_DOUBLE_DOUBLE_EXP_H_
