// SPDX-License-Identifier: Apache-2.0
// Bounds of all Taylor coefficients of a formula over an interval of time: from them follows by which polynomial it can
// be replaced there.

#ifndef DLCS_CORE_PROBLEM_FORMULA_MAJORANT_H_
#define DLCS_CORE_PROBLEM_FORMULA_MAJORANT_H_

#include <array>
#include <vector>

#include "core/problem/formula_enclosure.h"
#include "core/problem/formula_tree.h"

namespace dlcs {

// Bounds of the absolute values of Taylor coefficients.
struct TaylorBounds {
  static constexpr int kOrder = 24;

  double operator[](int k) const { return c[static_cast<std::size_t>(k)]; }
  double& operator[](int k) { return c[static_cast<std::size_t>(k)]; }

  std::array<double, kOrder + 1> c{};
  int degree = 0;  // the last one that is not 0
};

// Interval arithmetic of Taylor coefficients (Moore, Methods and Applications of Interval Analysis, chapter 3), whose
// value is an interval and whose higher coefficients are bounds of absolute values: they need no directed rounding,
// since all that is asked is how far the formula may be from a polynomial.
class FormulaMajorant {
 public:
  // Keeps a reference to `tree`, a formula in t alone.
  explicit FormulaMajorant(const FormulaTree& tree);

  // Bounds the coefficients over [lo, hi], in which the formula has no break point. Cost: 0.1 µs for each step of the
  // tree, and up to three times that if it is not linear in a polynomial of low degree.
  void Evaluate(double lo, double hi);

  // Entry j bounds |u^(j)(t) / j!| r^j for all t of the interval of half length r, up to rounding: the polynomial of
  // degree j - 1 that meets u at the Chebyshev points misses it by at most 2^(1 - j) times that. Infinite or NaN where
  // an operation may have no finite derivatives.
  const TaylorBounds& bounds() const { return bounds_.back(); }
  // A bound of |u| at the middle of the interval.
  double value_at_middle() const;

 private:
  TaylorBounds BoundsOf(int step, double radius) const;
  TaylorBounds BoundsOfPower(const FormulaStep& step, const TaylorBounds& u, double largest) const;

  const FormulaTree& tree_;
  FormulaEnclosure enclosure_;
  std::vector<TaylorBounds> bounds_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_FORMULA_MAJORANT_H_
