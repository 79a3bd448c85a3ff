// SPDX-License-Identifier: Apache-2.0
#include "core/outputs/monotone_parts.h"

#include <boost/math/tools/toms748_solve.hpp>
#include <cstdint>
#include <utility>

#include "core/outputs/output_curves.h"

namespace dlcs {
namespace {

// C(n, 0) ... C(n, n).
Vector Binomials(Index n) {
  Vector row = Vector::Ones(n + 1);
  for (Index k = 1; k < n; ++k) row[k] = row[k - 1] * static_cast<double>(n - k + 1) / static_cast<double>(k);
  return row;
}

// The Bernstein coefficients on [-1, 1] of the product of the rows.
Vector BernsteinProduct(const LegendreSeries& factors) {
  static const Vector of_factor = Binomials(kLegendreDegree);
  Vector product = GetLegendreBasis().to_bernstein.transpose() * factors.row(0).transpose();
  for (Index row = 1; row < factors.rows(); ++row) {
    const Index degree = product.size() - 1;
    const Vector left = product.cwiseProduct(Binomials(degree));
    const LegendreVector right =
        (GetLegendreBasis().to_bernstein.transpose() * factors.row(row).transpose()).cwiseProduct(of_factor);
    product.setZero(degree + kLegendreSize);
    for (Index j = 0; j < kLegendreSize; ++j) product.segment(j, degree + 1) += right[j] * left;
    product.array() /= Binomials(product.size() - 1).array();
  }
  return product;
}

// De Casteljau: the coefficients on the halves of the interval of `b`.
std::pair<Vector, Vector> Halves(const Vector& b) {
  Vector left(b.size()), right = b;
  left[0] = b[0];
  for (Index level = 1; level < b.size(); ++level) {
    const Index count = b.size() - level;
    for (Index i = 0; i < count; ++i) right[i] = (right[i] + right[i + 1]) / 2;
    left[level] = right[0];
  }
  return {std::move(left), std::move(right)};
}

// Where on the interval, from 0 to 1, `slope` changes sign, if its coefficients do so once, from that of `first` to
// that of `last`.
double ChangeOfSign(Vector slope, double first, double last) {
  slope.array() *= Binomials(slope.size() - 1).array();
  const auto value = [&](double part) {
    double sum = slope[0], power = 1;
    for (Index i = 1; i < slope.size(); ++i) {
      power *= part;
      sum = sum * (1 - part) + slope[i] * power;
    }
    return sum;
  };
  std::uintmax_t most = 100;
  const auto [from, to] = boost::math::tools::toms748_solve(value, 0.0, 1.0, first, last,
                                                            boost::math::tools::eps_tolerance<double>(), most);
  return from + (to - from) / 2;
}

class Cutter {
 public:
  Cutter(ValueRange range, double flat) : range_(range), flat_(flat) {}

  // Appends the cuts inside (begin, end), where the polynomial has the coefficients `b`.
  void Cut(const Vector& b, double begin, double end) {
    const double least = b.minCoeff(), most = b.maxCoeff();
    if (most - least <= flat_ || most < range_.low || least > range_.high) return;
    const Vector slope = b.tail(b.size() - 1) - b.head(b.size() - 1);
    double first = 0, last = 0;
    int changes = 0;
    for (const double one : slope) {
      if (one == 0) continue;
      if (first == 0) first = one;
      if (last * one < 0) ++changes;
      last = one;
    }
    const double middle = begin + (end - begin) / 2;
    if (changes == 0 || !(begin < middle && middle < end)) return;
    if (changes == 1) {
      const double turn = begin + (end - begin) * ChangeOfSign(slope, first, last);
      if (begin < turn && turn < end) cuts_.push_back(turn);
      return;
    }
    const auto [left, right] = Halves(b);
    Cut(left, begin, middle);
    cuts_.push_back(middle);  // may be a turning point
    Cut(right, middle, end);
  }

  std::vector<double> Take() {
    cuts_.push_back(1);
    return std::move(cuts_);
  }

 private:
  ValueRange range_;
  double flat_;
  std::vector<double> cuts_{-1};
};

}  // namespace

std::vector<double> MonotoneParts(const LegendreSeries& factors, ValueRange range) {
  const Vector b = BernsteinProduct(factors);
  Cutter cutter(range, kCurveAccuracy * b.cwiseAbs().maxCoeff());
  if (b.allFinite()) cutter.Cut(b, -1, 1);
  return cutter.Take();
}

}  // namespace dlcs
