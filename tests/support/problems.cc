// SPDX-License-Identifier: Apache-2.0

#include "tests/support/problems.h"

#include <cmath>

namespace dlcs::testing {
namespace {

Problem FourVariable(std::vector<std::string> g) {
  Problem problem;
  problem.A.MutableDense().resize(3, 3);
  problem.A.MutableDense() << -2, 1, 0, 1, -2, 1.5, 0, -1, -2;
  problem.A.MutableDense() /= 2;
  problem.B.MutableDense().resize(3, 4);
  problem.B.MutableDense() << -1, -4, -2, 0, -3, -2, -2, 0, -3, -3, 0, 3;
  problem.B.MutableDense() /= 2;
  problem.N.MutableDense().resize(4, 3);
  problem.N.MutableDense() << 0, 0, -1, -2, -2, 1.5, -0.5, -1, -0.5, 1, 2.5, 1.5;
  problem.M.MutableDense().resize(4, 4);
  problem.M.MutableDense() << 2.0 / 3, -1, -1.0 / 3, -5.0 / 3,  //
      -2.0 / 3, 1.0 / 3, -2.0 / 3, -4.0 / 3,                    //
      -2.0 / 3, -1.0 / 30, 0, -5.0 / 3,                         //
      -1, 0, -5.0 / 3, 1.0 / 3;
  problem.f = TimeFunction::Formulas({"sqrt(abs(1-cos(t**2)))", "3*cos(3*pi*t)", "sqrt(abs(1-cos(3*t**2)))"});
  problem.g = TimeFunction::Formulas(std::move(g));
  problem.x0 = Vector::Zero(3);
  problem.x0 << 0, -0.5, -0.5;
  problem.horizon = 1;
  return problem;
}

}  // namespace

Problem ExampleFourOne() {
  Problem problem;
  problem.A = Matrix(Vector{{-1, -2}}.asDiagonal());
  problem.B.MutableDense().resize(2, 4);
  problem.B.MutableDense() << -3, 0, 0, 3, 0, 1.3, 1.3, 0;
  problem.N.MutableDense().resize(4, 2);
  problem.N.MutableDense() << -1, 0, 0, 1, 0, 1, 1, 0;
  problem.M.MutableDense().resize(4, 4);
  problem.M.MutableDense() << 1, 0, 0, 0, 0, 0, -1, 0, 0, -1, 0, 0, 0, 0, 0, 1;
  problem.f = TimeFunction::Formulas({"1.2*sin(10*t)", "0"});
  problem.g = TimeFunction::Zero(4);
  problem.x0 = Vector{{0, 1}};
  problem.horizon = 1;
  return problem;
}

Vector ExampleFourOneExact(double t) {
  return Vector{
      {(4.8 * std::sin(10 * t) - 12 * std::cos(10 * t)) / 116 + 3.0 / 29 * std::exp(-4 * t), std::exp(-2 * t)}};
}

Problem FourVariableHard() {
  return FourVariable({"2 - t*exp(-t/2)", "2 + t*exp(-t/2)", "2 + t*exp(-t/2)", "2 - t*exp(-t/2)"});
}

Problem FourVariableEasy() {
  return FourVariable({"3 + t*exp(-t/2)", "1.5 + t*exp(-t/2)", "2 + t*exp(-t/2)", "1.5 + t*exp(-t/2)"});
}

Problem Scalar(double a, double g, double x0, double horizon) {
  Problem problem;
  problem.A = Matrix::Constant(1, 1, a);
  problem.B = problem.N = problem.M = Matrix::Ones(1, 1);
  problem.f = TimeFunction::Zero(1);
  problem.g = TimeFunction::Constant(Vector::Constant(1, g));
  problem.x0 = Vector::Constant(1, x0);
  problem.horizon = horizon;
  return problem;
}

Problem Relays(const Matrix& A, const Matrix& C, const Matrix& D, const Vector& x0, double horizon) {
  const Index m = A.rows();
  const Index k = D.rows();
  Problem problem;
  problem.A = A;
  problem.B = Matrix::Zero(m, 2 * k);
  problem.B.MutableDense().leftCols(k) = C;
  problem.N = Matrix::Zero(2 * k, m);
  problem.N.MutableDense().topRows(k) = D;
  problem.M = Matrix::Zero(2 * k, 2 * k);
  problem.M.MutableDense().topRightCorner(k, k).setIdentity();
  problem.M.MutableDense().bottomLeftCorner(k, k) = -Matrix::Identity(k, k);
  problem.f = TimeFunction::Constant(-C * Vector::Ones(k));
  Vector g = Vector::Zero(2 * k);
  g.tail(k).setConstant(2);
  problem.g = TimeFunction::Constant(g);
  problem.x0 = x0;
  problem.horizon = horizon;
  return problem;
}

}  // namespace dlcs::testing
