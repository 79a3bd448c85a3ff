// SPDX-License-Identifier: Apache-2.0
// Symmetric systems, whose differences are zero or small, and coordinates that were computed in doubles.

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "tests/plain/families.h"

namespace dlcs::plain {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kPhase = 2 * std::numbers::pi / 3;

// What one part of a symmetric system is multiplied by.
double Imbalance(Random& random) { return random.Chance(2.0 / 3) ? 1 : 1 + LogUniform(random, 3e-14, 1e-8); }

// A mode of `size` states, damped, that is no faster than 5.
MatrixXd DampedMatrix(Random& random, int size) {
  MatrixXd result(size, size);
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j < size; ++j) result(i, j) = random.Normal() / std::sqrt(size) - (i == j ? 1.5 : 0);
  }
  return result;
}

}  // namespace

// Three R-L loads at three phases, with a neutral coil: i_a, i_b, i_c and their sum as an output; or i_a, i_b and the
// neutral current as states; or a stray capacitor at the star point, whose voltage and coil are states.
PlainSystem BalancedStar(Random& random) {
  const double resistance = LogUniform(random, 1, 20), inductance = LogUniform(random, 1e-3, 0.1);
  const double of_neutral = LogUniform(random, 0.01, 1), coil_of_neutral = LogUniform(random, 1e-5, 1e-3);
  const double amplitude = 325, rate = 2 * std::numbers::pi * 50, odd = Imbalance(random);
  const double current = amplitude / std::hypot(resistance, rate * inductance);
  const double horizon = LogUniform(random, 0.02, 0.3);
  const auto add_phases = [&](PlainSystem& star, const MatrixXd& gains) {
    for (int phase = 0; phase < 3; ++phase) {
      for (Index row = 0; row < gains.rows(); ++row) {
        if (gains(row, phase) == 0) continue;
        AddWave(star.system, static_cast<int>(row), amplitude * gains(row, phase), rate, -kPhase * phase);
      }
    }
  };
  const int kind = random.Integer(0, 2);
  if (kind == 2) {  // i_a, i_b, i_c, v, i_n
    const double stray = LogUniform(random, 1e-15, 1e-10), leak = 1e3;
    MatrixXd A = MatrixXd::Zero(5, 5);
    for (int k = 0; k < 3; ++k) {
      A(k, k) = -resistance * (k == 2 ? odd : 1) / inductance;
      A(k, 3) = -1 / inductance;
      A(3, k) = 1 / stray;
    }
    A(3, 3) = -1 / (leak * stray);
    A(3, 4) = -1 / stray;
    A(4, 3) = 1 / coil_of_neutral;
    A(4, 4) = -of_neutral / coil_of_neutral;
    VectorXd beside = VectorXd::Constant(5, current);
    beside[3] = amplitude;
    PlainSystem star = LinearSystem(A, VectorXd::Zero(5), VectorXd::Zero(5), horizon, beside);
    MatrixXd gains = MatrixXd::Zero(5, 3);
    gains.topRows(3) = MatrixXd::Identity(3, 3) / inductance;
    add_phases(star, gains);
    star.system.traits = "neutral behind a stray node";
    return star;
  }
  VectorXd resistances = VectorXd::Constant(3, resistance);
  resistances[2] *= odd;
  const MatrixXd inductances = inductance * MatrixXd::Identity(3, 3) + coil_of_neutral * MatrixXd::Ones(3, 3);
  const MatrixXd inverse = inductances.inverse();
  MatrixXd A = -inverse * (MatrixXd(resistances.asDiagonal()) + of_neutral * MatrixXd::Ones(3, 3));
  MatrixXd gains = inverse;
  if (kind == 1) {  // (i_a, i_b, i_n) = P (i_a, i_b, i_c)
    MatrixXd P = MatrixXd::Identity(3, 3), back = P;
    P.row(2).setOnes();
    back.row(2) << -1, -1, 1;
    A = P * A * back;
    gains = P * gains;
  }
  PlainSystem star = LinearSystem(A, VectorXd::Zero(3), VectorXd::Zero(3), horizon, VectorXd::Constant(3, current));
  add_phases(star, gains);
  if (kind == 0) AddOutput(star.system, VectorXd::Ones(3));
  star.system.traits = kind == 0 ? "neutral as an output" : "neutral as a state";
  return star;
}

// +V and -V behind R and L feed a node with a capacitor, a resistor and a coil: i_1, i_2, v, i.
PlainSystem SplitSupply(Random& random) {
  const double volts = random.Uniform(5, 50), resistance = LogUniform(random, 0.1, 10);
  const double inductance = LogUniform(random, 1e-4, 1e-2), capacity = LogUniform(random, 1e-7, 1e-4);
  const double load = LogUniform(random, 1, 1e3), coil = LogUniform(random, 1e-4, 1e-2);
  MatrixXd A = MatrixXd::Zero(4, 4);
  A(0, 0) = -resistance * Imbalance(random) / inductance;
  A(1, 1) = -resistance / inductance;
  A(0, 2) = -1 / inductance;
  A(1, 2) = 1 / inductance;
  A(2, 0) = 1 / capacity;
  A(2, 1) = -1 / capacity;
  A(2, 2) = -1 / (load * capacity);
  A(2, 3) = -1 / capacity;
  A(3, 2) = 1 / coil;
  A(3, 3) = -0.1 * resistance / coil;
  VectorXd constant = VectorXd::Zero(4), x0 = constant;
  constant.head(2).setConstant(volts / inductance);
  if (random.Chance(0.5)) x0.head(2).setConstant(volts / resistance);
  VectorXd beside = VectorXd::Constant(4, volts / resistance);
  beside[2] = volts;
  return LinearSystem(A, x0, constant, inductance / resistance * LogUniform(random, 1, 30), beside);
}

// Two dividers of resistors with capacitors in the middle, and a coil between these: v_a, v_b, i. The second divider is
// the first in another unit of admittance, so that the coil has no current.
PlainSystem BalancedBridge(Random& random) {
  const double upper = LogUniform(random, 10, 1e3), lower = LogUniform(random, 10, 1e3), ratio = random.Uniform(0.3, 3);
  const double capacity = LogUniform(random, 1e-7, 1e-5), coil = LogUniform(random, 1e-3, 0.1), volts = 10;
  MatrixXd A = MatrixXd::Zero(3, 3);
  VectorXd from_source = VectorXd::Zero(3);
  const double odd = Imbalance(random);
  for (int side = 0; side < 2; ++side) {
    const double admittance = side == 0 ? 1 : ratio;
    const double up = admittance / upper, down = admittance / lower * (side == 0 ? 1 : odd);
    A(side, side) = -(up + down) / (admittance * capacity);
    A(side, 2) = (side == 0 ? -1 : 1) / (admittance * capacity);
    from_source[side] = up / (admittance * capacity);
  }
  A(2, 0) = 1 / coil;
  A(2, 1) = -1 / coil;
  A(2, 2) = -random.Uniform(1, 100) / coil;
  const bool at_rest = random.Chance(0.3), has_wave = !at_rest && random.Chance(0.5);
  const double time = capacity * upper * lower / (upper + lower);
  VectorXd beside = VectorXd::Constant(3, volts), x0 = VectorXd::Zero(3);
  beside[2] = volts / upper;
  if (at_rest) x0.head(2).setConstant(volts * lower / (upper + lower));
  PlainSystem bridge =
      LinearSystem(A, x0, has_wave ? x0 : VectorXd(volts * from_source), time * LogUniform(random, 1, 30), beside);
  if (!has_wave) return bridge;
  const double rate = random.Uniform(0.3, 3) / time;
  for (int side = 0; side < 2; ++side) AddWave(bridge.system, side, volts * from_source[side], rate, 0);
  return bridge;
}

// Two equal parts x' = P x + Q x_other + f, in sums and differences, or rotated by a quarter of a right angle in
// doubles, from the same state.
PlainSystem SwappedPair(Random& random) {
  const int k = random.Integer(1, 4);
  const MatrixXd P = DampedMatrix(random, k), Q = 0.3 * DampedMatrix(random, k);
  MatrixXd A(2 * k, 2 * k);
  A << P, Q, Q, P;
  VectorXd start(2 * k), constant(2 * k);
  for (int i = 0; i < k; ++i) {
    start[i] = start[k + i] = random.Normal();
    constant[i] = constant[k + i] = random.Normal();
  }
  const bool is_rotated = random.Chance(0.6);
  const double c = is_rotated ? std::sqrt(0.5) : 1, back = is_rotated ? c : 0.5;
  const MatrixXd one = MatrixXd::Identity(k, k);
  MatrixXd turn(2 * k, 2 * k);
  turn << one, one, one, -one;
  if (random.Chance(0.3)) A.topLeftCorner(k, k) *= Imbalance(random);
  PlainSystem result = LinearSystem((c * turn) * A * (back * turn), (c * turn) * start, (c * turn) * constant,
                                    LogUniform(random, 1, 30), VectorXd::Constant(2 * k, 1));
  result.system.traits = is_rotated ? "rotated" : "sums and differences";
  return result;
}

// Two equal oscillators or loads; the difference passes a filter of first or second order, and is an output.
PlainSystem DifferenceOfSensors(Random& random) {
  const int k = random.Integer(1, 3), order = random.Integer(1, 2), m = 2 * k + order;
  const MatrixXd P = DampedMatrix(random, k);
  MatrixXd A = MatrixXd::Zero(m, m);
  VectorXd x0 = VectorXd::Zero(m), constant = x0, output = x0, beside = x0;
  A.topLeftCorner(k, k) = P;
  A.block(k, k, k, k) = P;
  for (int i = 0; i < k; ++i) {
    x0[i] = x0[k + i] = random.Normal();
    constant[i] = constant[k + i] = random.Normal();
  }
  beside.head(2 * k).setConstant(k > 1 ? 1 : 0);
  const double gain = LogUniform(random, 1e-3, 1e3), rate = random.Uniform(0.5, 5);
  beside.tail(order).setConstant(gain / rate);  // of its terms: what is zero has no other size
  A(m - order, 0) = gain;
  A(m - order, k) = -gain;
  A(m - order, m - order) = -rate;
  if (order == 2) {
    A(m - 1, m - 2) = rate;
    A(m - 1, m - 1) = -rate;
    A(m - 2, m - 1) = random.Chance(0.5) ? -rate : 0;
  }
  output[0] = 1;
  output[k] = -1;
  PlainSystem result = LinearSystem(A, x0, constant, LogUniform(random, 1, 30), beside);
  AddOutput(result.system, output);
  return result;
}

// Three states that follow three phases, a fourth that follows their sum, as a star of resistors does when it is
// eliminated; the sum is an output too.
PlainSystem SumOfThreePhases(Random& random) {
  const double rate = random.Uniform(0.5, 10), decay = random.Uniform(0.3, 3), odd = Imbalance(random);
  MatrixXd A = MatrixXd::Zero(4, 4);
  for (int k = 0; k < 3; ++k) {
    A(k, k) = -decay * (k == 2 ? odd : 1);
    A(3, k) = decay / 3;
  }
  A(3, 3) = -decay;
  const bool acts_back = random.Chance(0.5);
  if (acts_back) A.col(3).head(3).setConstant(0.3 * decay);
  VectorXd beside = VectorXd::Constant(4, acts_back ? 1 : 0);
  // A state that only receives has its own size, unless that is zero.
  if (odd == 1) beside[3] = 1;
  PlainSystem result = LinearSystem(A, VectorXd::Zero(4), VectorXd::Zero(4), LogUniform(random, 1, 100) / rate, beside);
  for (int k = 0; k < 3; ++k) AddWave(result.system, k, decay, rate, -kPhase * k);
  AddOutput(result.system, Eigen::Vector4d(1, 1, 1, 0));
  return result;
}

// A chain of two to six masses in the coordinates of its modes, computed in doubles; one mode moves.
PlainSystem ModalCoordinates(Random& random) {
  const int k = random.Integer(2, 6);
  MatrixXd stiffness = MatrixXd::Zero(k, k);
  for (int i = 0; i < k; ++i) {
    stiffness(i, i) = 2;
    if (i > 0) stiffness(i, i - 1) = stiffness(i - 1, i) = -1;
  }
  stiffness *= LogUniform(random, 1, 1e4);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> modes(stiffness);
  MatrixXd A = MatrixXd::Zero(2 * k, 2 * k);
  A.topRightCorner(k, k).setIdentity();
  A.bottomLeftCorner(k, k) = -(modes.eigenvectors().transpose() * stiffness * modes.eigenvectors());
  const double rate = std::sqrt(modes.eigenvalues()[0]);
  if (random.Chance(0.5)) A.bottomRightCorner(k, k).diagonal().setConstant(-rate * random.Uniform(0.01, 0.5));
  VectorXd x0 = VectorXd::Zero(2 * k), beside = VectorXd::Ones(2 * k);
  x0[random.Integer(0, k - 1)] = random.Normal();
  beside.tail(k) *= rate;
  return LinearSystem(A, x0, VectorXd::Zero(2 * k), LogUniform(random, 1, 100) / rate, beside);
}

}  // namespace dlcs::plain
