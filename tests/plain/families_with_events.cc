// SPDX-License-Identifier: Apache-2.0
// Events beside parts that are at rest or symmetric.

#include <cmath>
#include <numbers>

#include "tests/plain/families.h"

namespace dlcs::plain {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

PlainSystem AnyAtRest(Random& random) {
  switch (random.Integer(0, 3)) {
    case 0:
      return Equilibrium(random);
    case 1:
      return BoxesOnFloors(random);
    case 2:
      return SwappedPair(random);
    default:
      return DecoupledAndZero(random);
  }
}

PlainSystem BesideWithoutCoupling(const PlainSystem& first, const PlainSystem& second, double horizon) {
  PlainSystem result = Beside(first, second, MatrixXd::Zero(second.system.num_states(), first.system.num_states()));
  result.system.horizon = horizon;
  return result;
}

// One state and the pairs of N, M and g, which push it by B.
PlainSystem WithPairs(PlainSystem plain, const MatrixXd& B, const MatrixXd& N, const MatrixXd& M, const VectorXd& g) {
  System& system = plain.system;
  system.B = B;
  system.N = N;
  system.M = M;
  system.G = {g};
  system.D = MatrixXd::Zero(0, M.rows());
  return plain;
}

// Half-wave: a capacitor with a load behind a diode, 0 <= y ⟂ v + R y - V sin >= 0.
PlainSystem Rectifier(Random& random, double rate, double volts, double horizon) {
  const double capacity = LogUniform(random, 0.1, 10) / (100 * rate), load = 100,
               resistance = LogUniform(random, 0.5, 10);
  PlainSystem result = WithPairs(LinearSystem(MatrixXd::Constant(1, 1, -1 / (load * capacity)), VectorXd::Zero(1),
                                              VectorXd::Zero(1), horizon, VectorXd::Constant(1, volts)),
                                 MatrixXd::Constant(1, 1, 1 / capacity), MatrixXd::Ones(1, 1),
                                 MatrixXd::Constant(1, 1, resistance), VectorXd::Zero(1));
  AddWave(result.system, 1, -volts, rate, 0);
  return result;
}

}  // namespace

// From 0.05 to 1 above an elastic, damped floor; it comes to rest, or not quite.
PlainSystem BoxDropsOnFloor(Random& random) {
  PlainSystem result = BoxesOnFloors(random);
  System& system = result.system;
  const double height = random.Uniform(0.05, 1), damping = LogUniform(random, 0.05, 1);
  const double gravity = -system.F[0](1, 0);
  for (int i = 0; i < system.num_pairs(); ++i) {
    system.x0[2 * i] += height;
    const double stiffness = 1 / system.M(i, i), mass = 1 / system.B(2 * i + 1, i);
    system.N(i, 2 * i + 1) = 2 * damping * std::sqrt(mass / stiffness);
    if (i > 0) system.N(i, 2 * i - 1) = -system.N(i, 2 * i + 1);
  }
  result.beside = result.beside.cwiseMax(height);
  for (int i = 1; i < system.num_states(); i += 2) result.beside[i] = std::sqrt(2 * gravity * height);
  system.horizon = std::sqrt(2 * height / gravity) * LogUniform(random, 2, 20);
  return result;
}

PlainSystem RectifierBesideBalancedPart(Random& random) {
  const PlainSystem balanced = random.Chance(0.5) ? BalancedStar(random) : SplitSupply(random);
  const double rate = 2 * std::numbers::pi * random.Integer(1, 4) / balanced.system.horizon;
  const PlainSystem rectifier = Rectifier(random, rate, random.Uniform(10, 300), balanced.system.horizon);
  return random.Chance(0.5) ? BesideWithoutCoupling(rectifier, balanced, balanced.system.horizon)
                            : BesideWithoutCoupling(balanced, rectifier, balanced.system.horizon);
}

// The voltage behind the diode is the source of the bridge.
PlainSystem RectifierFeedsBridge(Random& random) {
  PlainSystem bridge = BalancedBridge(random);
  System& system = bridge.system;
  const double volts = 10, rate = 2 * std::numbers::pi * random.Integer(1, 4) / system.horizon;
  VectorXd from_source = VectorXd::Zero(3);
  for (int side = 0; side < 2; ++side) {  // of the constant, or of its wave
    from_source[side] = system.F[0].row(side).sum() / volts;
  }
  system.functions = {{}};
  system.F = {VectorXd::Zero(3)};
  system.G = {MatrixXd::Ones(1, 1)};
  const PlainSystem rectifier = Rectifier(random, rate, volts, system.horizon);
  return Beside(rectifier, bridge, MatrixXd(from_source));
}

// An oscillator that hits an elastic stop at 1/2: 0 <= y ⟂ 1/2 - x + y/stiffness >= 0.
PlainSystem StopBesideRest(Random& random) {
  const double rate = random.Uniform(1, 5), stiffness = LogUniform(random, 1e2, 1e5);
  MatrixXd A(2, 2);
  A << 0, 1, -rate * rate, -random.Uniform(0, 0.5);
  const double horizon = random.Uniform(1, 4) * 2 * std::numbers::pi / rate;
  const PlainSystem oscillator = WithPairs(LinearSystem(A, Eigen::Vector2d(-random.Uniform(0.3, 2), 0),
                                                        VectorXd::Zero(2), horizon, Eigen::Vector2d(1, rate)),
                                           Eigen::Vector2d(0, -1), Eigen::RowVector2d(-1, 0),
                                           MatrixXd::Constant(1, 1, 1 / stiffness), VectorXd::Constant(1, 0.5));
  return BesideWithoutCoupling(oscillator, AnyAtRest(random), horizon);
}

// x' = -a x + c - b sign(x - level), as a relay: y1 = 1 + sign ⟂ y2 - s, y2 ⟂ 2 - y1. It may slide.
PlainSystem RelayBesideRest(Random& random) {
  const double decay = random.Uniform(0.2, 2), level = random.Uniform(-1, 1), push = random.Uniform(1, 4);
  const double horizon = random.Uniform(1, 10) / decay;
  MatrixXd skew(2, 2);
  skew << 0, 1, -1, 0;
  PlainSystem relay =
      WithPairs(LinearSystem(MatrixXd::Constant(1, 1, -decay), VectorXd::Constant(1, 2 * random.Normal()),
                             VectorXd::Constant(1, push + random.Normal()), horizon, VectorXd::Ones(1)),
                Eigen::RowVector2d(-push, 0), Eigen::Vector2d(-1, 0), skew, Eigen::Vector2d(level, 2));
  relay.system.is_lipschitz = false;
  relay.system.rank_matters = true;
  return BesideWithoutCoupling(relay, AnyAtRest(random), horizon);
}

// A mass on a spring with dry friction, until it sticks; v' = -k x - d v - friction sign(v).
PlainSystem FrictionThatSticks(Random& random) {
  const double rate = random.Uniform(1, 5), friction = random.Uniform(0.05, 0.5);
  MatrixXd A(2, 2), skew(2, 2);
  A << 0, 1, -rate * rate, -random.Uniform(0, 0.5);
  skew << 0, 1, -1, 0;
  MatrixXd B = MatrixXd::Zero(2, 2), N = MatrixXd::Zero(2, 2);
  B(1, 0) = -friction;
  N(0, 1) = -1;
  const double start = random.Chance(0.2) ? 0.3 * friction / (rate * rate) : random.Uniform(0.3, 2);
  PlainSystem result =
      WithPairs(LinearSystem(A, Eigen::Vector2d(start, 0), Eigen::Vector2d(0, friction),
                             random.Uniform(1, 6) * 2 * std::numbers::pi / rate, Eigen::Vector2d(start, start * rate)),
                B, N, skew, Eigen::Vector2d(0, 2));
  result.system.is_lipschitz = false;
  result.system.rank_matters = true;
  return result;
}

}  // namespace dlcs::plain
