// SPDX-License-Identifier: Apache-2.0
// f and g of a nonlinear problem, compiled, with their Jacobians.

#ifndef DLCS_CORE_NONLINEAR_FUNCTIONS_H_
#define DLCS_CORE_NONLINEAR_FUNCTIONS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/problem/formula.h"
#include "core/problem/nonlinear_problem.h"
#include "core/types.h"

namespace dlcs {

// Where a formula has no value the result is not finite; the caller decides what that means. Not safe to share between
// threads: a formula holds its variables.
class NonlinearFunctions {
 public:
  // Errors: InvalidArgument where a formula does not parse. Cost: about 5 µs per formula.
  static absl::StatusOr<NonlinearFunctions> Create(const NonlinearProblem& problem);

  Vector F(double t, const Vector& x, const Vector& y) { return Values(f_, t, x, y); }
  Vector G(double t, const Vector& x, const Vector& y) { return Values(g_, t, x, y); }

  // The Jacobians f_x (m × m), f_y (m × n), g_x (n × m), g_y (n × n), by central differences with steps of ε^{1/3}:
  // about ten digits, which is enough to steer Newton's method and the splitting. One-sided where the formula has no
  // value on the other side (sqrt(y1) at 0). An entry whose variable does not occur is exactly 0. Cost: two values of a
  // formula for every variable in it.
  Matrix FByX(double t, const Vector& x, const Vector& y) { return Jacobian(f_, true, t, x, y); }
  Matrix FByY(double t, const Vector& x, const Vector& y) { return Jacobian(f_, false, t, x, y); }
  Matrix GByX(double t, const Vector& x, const Vector& y) { return Jacobian(g_, true, t, x, y); }
  Matrix GByY(double t, const Vector& x, const Vector& y) { return Jacobian(g_, false, t, x, y); }

  // The y_i, counted from 0, that occur in no formula of g.
  std::vector<Index> ConstraintsAbsentFromG() const;

 private:
  static Vector Values(std::vector<Formula>& formulas, double t, const Vector& x, const Vector& y);
  static Matrix Jacobian(std::vector<Formula>& formulas, bool by_x, double t, Vector x, Vector y);

  std::vector<Formula> f_;
  std::vector<Formula> g_;
};

// The first entry of `values` that is not finite, as `f[1], "log(x1)", is -inf at t = 0.25`; empty where all
// are finite. `formulas` are those the values come from, `name` is what they are called.
std::string DescribeNonFinite(const std::string& name, const std::vector<std::string>& formulas, const Vector& values,
                              double t);

}  // namespace dlcs

#endif  // DLCS_CORE_NONLINEAR_FUNCTIONS_H_
