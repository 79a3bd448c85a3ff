// SPDX-License-Identifier: Apache-2.0
#include "tests/hostile/double_double_exp.h"

namespace dlcs::hostile {

namespace {

struct SineAndCosine {
  Real sine, cosine;
};

// By quarters of a turn, then eighths of what remains, then Taylor's series.
SineAndCosine OfAngle(Real a) {
  const Real quarter = Pi() * Real(0.5);
  const double turns = std::nearbyint(ToDouble(a / quarter));
  const Real r = (a - quarter * Real(turns)) * Real(0.125);
  Real sine = r, cosine = 1, term = r;
  for (int k = 2; k < 30; ++k) {
    term = term * r / Real(k);
    (k % 2 == 0 ? cosine : sine) += k % 4 < 2 ? term : -term;
  }
  for (int doubling = 0; doubling < 3; ++doubling) {
    const Real twice = Real(2) * sine * cosine;
    cosine = Real(1) - Real(2) * sine * sine;
    sine = twice;
  }
  switch (static_cast<int>(turns - 4 * std::floor(turns / 4))) {
    case 0:
      return {sine, cosine};
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    default:
      return {-cosine, sine};
  }
}

}  // namespace

Real Sin(Real a) { return OfAngle(a).sine; }
Real Cos(Real a) { return OfAngle(a).cosine; }

Real Exp(Real a) {
  const Real log_of_two = {6.931471805599452862e-01, 2.319046813846299558e-17};
  const double power = std::nearbyint(ToDouble(a / log_of_two));
  const Real r = (a - log_of_two * Real(power)) * Real(1.0 / 64);
  Real sum = 0, term = 1;  // e^r - 1, whose doubling loses nothing
  for (int k = 1; k < 20; ++k) {
    term = term * r / Real(k);
    sum += term;
  }
  for (int doubling = 0; doubling < 6; ++doubling) sum = Real(2) * sum + sum * sum;
  return (sum + Real(1)) * Real(std::ldexp(1.0, static_cast<int>(power)));
}

DenseMatrix Identity(int size) {
  DenseMatrix result(size, size);
  for (int i = 0; i < size; ++i) result(i, i) = 1;
  return result;
}

DenseMatrix operator*(const DenseMatrix& a, const DenseMatrix& b) {
  DenseMatrix result(a.rows(), b.cols());
  for (int i = 0; i < a.rows(); ++i) {
    Real* out = result.row(i);
    for (int k = 0; k < a.cols(); ++k) {
      const Real factor = a(i, k);
      if (IsZero(factor)) continue;
      const Real* row = b.row(k);
      for (int j = 0; j < b.cols(); ++j) out[j] += factor * row[j];
    }
  }
  return result;
}

Real Dot(const Real* row, const Column& x) {
  Real sum = 0;
  for (size_t j = 0; j < x.size(); ++j) {
    if (!IsZero(row[j])) sum += row[j] * x[j];
  }
  return sum;
}

Real AbsoluteDot(const Real* row, const Column& x) {
  double sum = 0;
  for (size_t j = 0; j < x.size(); ++j) sum += std::abs(row[j].high() * x[j].high());
  return sum;
}

Column operator*(const DenseMatrix& a, const Column& x) {
  Column result(a.rows());
  for (int i = 0; i < a.rows(); ++i) result[i] = Dot(a.row(i), x);
  return result;
}

Column AbsoluteProduct(const DenseMatrix& a, const Column& x) {
  Column result(a.rows());
  for (int i = 0; i < a.rows(); ++i) result[i] = AbsoluteDot(a.row(i), x);
  return result;
}

}  // namespace dlcs::hostile
