// SPDX-License-Identifier: Apache-2.0
// Parts that do not act back, of any size, and cancellation.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/hostile/transforms.h"
#include "tests/plain/families.h"

namespace dlcs::plain {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd OscillatorMatrix(double rate, double damping) {
  MatrixXd A(2, 2);
  A << 0, 1, -rate * rate, -damping;
  return A;
}

}  // namespace

// Blocks of one to three states that do not know of each other, some at zero, some constant.
PlainSystem DecoupledAndZero(Random& random) {
  const int blocks = random.Integer(2, 4);
  int m = 0;
  MatrixXd A = MatrixXd::Zero(12, 12);
  VectorXd x0 = VectorXd::Zero(12), constant = x0, beside = x0;
  for (int b = 0; b < blocks; ++b) {
    const int size = random.Integer(1, 3), kind = random.Integer(0, 3);
    for (int i = m; i < m + size; ++i) {
      for (int j = m; j < m + size && kind > 0; ++j) A(i, j) = random.Normal() - (i == j ? 2 : 0);
      if (kind != 1) x0[i] = random.Normal();  // else zero for ever
      if (kind == 3) constant[i] = random.Normal();
      beside[i] = size > 1 && kind > 1 ? 1 : 0;
    }
    m += size;
  }
  return LinearSystem(A.topLeftCorner(m, m), x0.head(m), constant.head(m), LogUniform(random, 0.3, 10), beside.head(m));
}

PlainSystem UnreachedStates(Random& random) {
  PlainSystem result = DenseSystem(random);
  const int count = random.Integer(1, 3), before = result.system.num_states();
  result.system = random.Chance(0.7) ? hostile::WithUnreachableStates(result.system, count, 1, random)
                                     : hostile::WithUnobservableStates(result.system, count, 1, random);
  VectorXd beside = VectorXd::Ones(before + count);
  beside.tail(count).setZero();
  result.beside = beside;
  return result;
}

// A small decay beside an oscillator, into it, or fed by it.
PlainSystem SmallParts(Random& random) {
  const double rate = random.Uniform(0.5, 5), decay = random.Uniform(0.1, 3);
  const double small = LogUniform(random, 1e-15, 1e-6);
  MatrixXd A = MatrixXd::Zero(3, 3);
  A.topLeftCorner(2, 2) = OscillatorMatrix(rate, random.Chance(0.5) ? 0 : 0.1);
  A(2, 2) = -decay;
  VectorXd x0 = Eigen::Vector3d(random.Normal(), random.Normal(), small), beside = Eigen::Vector3d(1, 1, 0);
  const int kind = random.Integer(0, 3);
  if (kind == 1) A(1, 2) = 1;  // into it
  if (kind >= 2) {             // fed by it
    x0[2] = 0;
    A(2, 0) = small;
  }
  if (kind == 3) A(1, 2) = LogUniform(random, 1e-3, 1);  // and acts back
  constexpr const char* kNames[] = {"beside", "into", "fed", "fed, acts back"};
  PlainSystem result = LinearSystem(A, x0, VectorXd::Zero(3), LogUniform(random, 1, 30), beside);
  result.system.traits = kNames[kind];
  return result;
}

// The second one is small, and so are both couplings.
PlainSystem FeeblyCoupledOscillators(Random& random) {
  MatrixXd A = MatrixXd::Zero(4, 4);
  A.topLeftCorner(2, 2) = OscillatorMatrix(5, 0.1);
  A.bottomRightCorner(2, 2) = OscillatorMatrix(10, 0.2);
  A(1, 2) = LogUniform(random, 1e-33, 1e-16);
  A(3, 0) = LogUniform(random, 1e-33, 1e-16);
  const VectorXd x0 = Eigen::Vector4d(1, 0, LogUniform(random, 1e-14, 1e-8), 0);
  return LinearSystem(A, x0, VectorXd::Zero(4), LogUniform(random, 2, 40), Eigen::Vector4d(1, 5, 0, 0));
}

// Gains of 1e1 to 1e4 a stage from 1e-14.
PlainSystem GainsFromASmallSignal(Random& random) {
  const int m = random.Integer(2, 6);
  MatrixXd A = MatrixXd::Zero(m, m);
  for (int i = 0; i < m; ++i) {
    A(i, i) = -random.Uniform(0.3, 3);
    if (i > 0) A(i, i - 1) = LogUniform(random, 10, 1e4);
  }
  VectorXd x0 = VectorXd::Zero(m);
  x0[0] = 1e-14;
  return LinearSystem(A, x0, VectorXd::Zero(m), LogUniform(random, 1, 10), VectorXd::Zero(m));
}

// 1e±6 a stage, behind a wave.
PlainSystem Cascade(Random& random) {
  const int m = random.Integer(2, 6);
  MatrixXd A = MatrixXd::Zero(m, m);
  for (int i = 0; i < m; ++i) {
    A(i, i) = -random.Uniform(0.3, 3) * (random.Chance(0.2) ? 1e3 : 1);
    if (i > 0) A(i, i - 1) = LogUniform(random, 1e-6, 1e6);
  }
  PlainSystem result =
      LinearSystem(A, VectorXd::Zero(m), VectorXd::Zero(m), LogUniform(random, 1, 30), VectorXd::Zero(m));
  AddWave(result.system, 0, 1, random.Uniform(0.5, 5), random.Uniform(0, 3));
  return result;
}

// An undamped tank and the charge that has passed, for 50 to 500 periods.
PlainSystem ChargeCounter(Random& random) {
  const double rate = random.Uniform(0.5, 5);
  MatrixXd A = MatrixXd::Zero(3, 3);
  A(0, 1) = rate;
  A(1, 0) = -rate;
  A(2, 1) = random.Uniform(0.1, 10);
  return LinearSystem(A, Eigen::Vector3d(1, 0, 0), VectorXd::Zero(3),
                      2 * std::numbers::pi / rate * LogUniform(random, 50, 500), Eigen::Vector3d(1, 1, 0));
}

// x2' = -x2 + gain (x1 - x3), x1 = x3, with or without feedback.
PlainSystem GainOfADifference(Random& random) {
  MatrixXd A = MatrixXd::Zero(3, 3);
  const double decay = random.Uniform(0.3, 3), gain = LogUniform(random, 1e3, 1e8);
  A(0, 0) = A(2, 2) = -decay;
  A(1, 0) = gain;
  A(1, 2) = -gain;
  A(1, 1) = -1;
  if (random.Chance(0.6)) A(0, 1) = A(2, 1) = LogUniform(random, 1e-30, 1);
  const VectorXd constant = Eigen::Vector3d(decay, 0, decay);
  return LinearSystem(A, Eigen::Vector3d(0.5, random.Chance(0.5) ? 0 : 1, 0.5), constant, LogUniform(random, 1, 10),
                      Eigen::Vector3d(1, gain, 1));
}

// x1' = a x1 + x2 - x3, x2 = x3: zero, but for rounding that grows by e^12 to e^42; or x1 starts elsewhere.
PlainSystem GrowthOfADifference(Random& random) {
  MatrixXd A = MatrixXd::Zero(3, 3);
  const double decay = random.Uniform(0.1, 1), horizon = random.Uniform(2, 6);
  A(0, 0) = random.Uniform(12, 42) / horizon;
  A(0, 1) = 1;
  A(0, 2) = -1;
  A(1, 1) = A(2, 2) = -decay;
  const double start = random.Chance(0.5) ? 0 : random.Normal();
  return LinearSystem(A, Eigen::Vector3d(start, 1, 1), VectorXd::Zero(3), horizon, Eigen::Vector3d(1, 0, 0));
}

// (e^-at - e^-bt) / (b - a), as a state that follows it, and as an output.
PlainSystem NearlyEqualDecays(Random& random) {
  const double decay = random.Uniform(0.3, 2), apart = LogUniform(random, 1e-11, 1e-2), gain = 1 / apart;
  MatrixXd A = MatrixXd::Zero(3, 3);
  A(0, 0) = -decay;
  A(1, 1) = -(decay + apart);
  A(2, 0) = gain;
  A(2, 1) = -gain;
  A(2, 2) = -1;
  PlainSystem result =
      LinearSystem(A, Eigen::Vector3d(1, 1, 0), VectorXd::Zero(3), random.Uniform(1, 10), VectorXd::Zero(3));
  AddOutput(result.system, Eigen::Vector3d(gain, -gain, 0));
  return result;
}

// Two valves in series, each a limit `a` times a resistance: x is the small difference of their large terms.
PlainSystem ClosedSwitches(Random& random) {
  const double a = LogUniform(random, 1e3, 1e6);
  PlainSystem result =
      LinearSystem(-MatrixXd::Ones(1, 1), VectorXd::Zero(1), VectorXd::Constant(1, -800 * a), 5, VectorXd::Zero(1));
  System& system = result.system;
  system.M = MatrixXd(2, 2);
  system.M << a + 0.1, -a, -a, a + 0.02;
  system.B = MatrixXd(1, 2);
  system.B << -a, a;
  system.N = MatrixXd::Zero(2, 1);
  system.G = {Eigen::Vector2d(800 * a - 20, -800 * a - 25)};
  system.D = MatrixXd::Zero(0, 2);
  system.rank_matters = true;
  if (random.Chance(0.5)) {
    const double factor = LogUniform(random, 1e2, 1e7);
    system.M *= factor;
    system.G[0] *= factor;
  }
  if (random.Chance(0.3)) system.N.col(0) << 1e-3, -1e-3;
  return result;
}

// A coil into a node of 1e-16 to 1e-9 F, and one out of it.
PlainSystem CoilsAtAStrayNode(Random& random) {
  const double stray = LogUniform(random, 1e-16, 1e-9), first = LogUniform(random, 1e-3, 0.1);
  const double second = LogUniform(random, 1e-3, 0.1), resistance = LogUniform(random, 1, 100), leak = 1e3;
  MatrixXd A(3, 3);
  A << -resistance / first, 0, -1 / first, 0, -resistance / second, 1 / second, 1 / stray, -1 / stray,
      -1 / (leak * stray);
  const double volts = 10;
  VectorXd constant = VectorXd::Zero(3);
  if (random.Chance(0.5)) constant[0] = volts / first;
  PlainSystem result = LinearSystem(A, VectorXd::Zero(3), constant, LogUniform(random, 1e-3, 0.1),
                                    Eigen::Vector3d(volts / resistance, volts / resistance, volts));
  if (constant[0] == 0) AddWave(result.system, 0, volts / first, 2 * std::numbers::pi * 50, 0);
  return result;
}

PlainSystem DenseSystem(Random& random) {
  const int m = random.Integer(2, 8);
  MatrixXd A(m, m);
  VectorXd x0(m), constant(m);
  for (int i = 0; i < m; ++i) {
    for (int j = 0; j < m; ++j) A(i, j) = random.Normal() / std::sqrt(m) - (i == j ? 1.2 : 0);
    x0[i] = random.Normal();
    constant[i] = random.Normal();
  }
  return LinearSystem(A, x0, constant, LogUniform(random, 1, 30), VectorXd::Ones(m));
}

}  // namespace dlcs::plain
