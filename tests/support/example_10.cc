// SPDX-License-Identifier: Apache-2.0
#include "tests/support/example_10.h"

#include <cmath>

namespace dlcs {
namespace {

constexpr double kHead = 1e-9;

Index ActiveIn(int phase) { return (phase % 3 + 3) % 3; }

// v(a 2^phase): s/7 of the component that becomes active, 4s/7 of the one before it, 2s/7 of the third.
Vector AtSwitch(double s, int phase) {
  Vector v(3);
  v[ActiveIn(phase)] = s / 7;
  v[ActiveIn(phase - 1)] = 4 * s / 7;
  v[ActiveIn(phase - 2)] = 2 * s / 7;
  return v;
}

PiecewiseLinearPath Line(const Vector& end, double horizon) {
  PiecewiseLinearPath path{{0, horizon}, Matrix::Zero(end.size(), 2)};
  path.values.col(1) = end;
  return path;
}

}  // namespace

DcpProblem ExampleTenDcp(double horizon) {
  return {Matrix{{1, 3, 0}, {0, 1, 3}, {3, 0, 1}}, Line(Vector::Constant(3, -horizon), horizon)};
}

PiecewiseLinearPath ExampleTenEvenSolution(double horizon) { return Line(Vector::Constant(3, horizon / 4), horizon); }

PiecewiseLinearPath ExampleTenSwitchingSolution(double a, double horizon) {
  PiecewiseLinearPath path{{0}, Matrix::Zero(3, 1)};
  const auto append = [&](double time, const Vector& v) {
    path.times.push_back(time);
    path.values.conservativeResize(3, path.values.cols() + 1);
    path.values.rightCols(1) = v;
  };
  int phase = static_cast<int>(std::floor(std::log2(kHead * horizon / a)));
  for (; std::ldexp(a, phase) < horizon; ++phase) append(std::ldexp(a, phase), AtSwitch(std::ldexp(a, phase), phase));
  Vector end = path.values.rightCols(1);
  end[ActiveIn(phase - 1)] += horizon - path.times.back();
  append(horizon, end);
  return path;
}

}  // namespace dlcs
