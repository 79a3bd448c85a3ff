// SPDX-License-Identifier: Apache-2.0
// At rest, but for rounding: what starts where it stays.

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "tests/plain/families.h"

namespace dlcs::plain {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kGravity = 9.81;

}  // namespace

// A stack of boxes, springs between them and below: x'' = -g + (spring forces) / mass, at the rounded equilibrium.
PlainSystem BoxesOnSprings(Random& random) {
  const int boxes = random.Integer(1, 3);
  const double damping = random.Chance(0.5) ? LogUniform(random, 1e-3, 0.3) : 0;
  MatrixXd A = MatrixXd::Zero(2 * boxes, 2 * boxes);
  VectorXd mass(boxes), stiffness(boxes), constant = VectorXd::Zero(2 * boxes), x0 = constant, beside(2 * boxes);
  for (int i = 0; i < boxes; ++i) {
    mass[i] = random.Uniform(0.5, 5);
    stiffness[i] = LogUniform(random, 1e3, 1e6);
  }
  double height = 0;
  for (int i = 0; i < boxes; ++i) {
    const double damper = 2 * damping * std::sqrt(stiffness[i] * mass[i]);
    const auto add = [&](int box, double sign) {
      const int row = 2 * box + 1;
      A(row, 2 * i) -= sign * stiffness[i] / mass[box];
      A(row, 2 * i + 1) -= sign * damper / mass[box];
      if (i == 0) return;
      A(row, 2 * i - 2) += sign * stiffness[i] / mass[box];
      A(row, 2 * i - 1) += sign * damper / mass[box];
    };
    add(i, 1);
    if (i > 0) add(i - 1, -1);
    A(2 * i, 2 * i + 1) = 1;
    constant[2 * i + 1] = -kGravity;
    const double weight = kGravity * mass.tail(boxes - i).sum();
    height -= weight / stiffness[i];
    x0[2 * i] = height;
    beside[2 * i] = -height;
    beside[2 * i + 1] = -height * std::sqrt(stiffness.minCoeff() / mass.maxCoeff());
  }
  return LinearSystem(A, x0, constant, LogUniform(random, 0.3, 10), beside);
}

// The same with floors that only push: y the forces, 0 <= y ⟂ gap + (damper/stiffness) gap' + y/stiffness >= 0.
PlainSystem BoxesOnFloors(Random& random) {
  const int boxes = random.Integer(1, 3);
  const double damping = random.Chance(0.6) ? LogUniform(random, 1e-3, 1) : 0;
  const VectorXd zero = VectorXd::Zero(2 * boxes);
  PlainSystem result =
      LinearSystem(MatrixXd::Zero(2 * boxes, 2 * boxes), zero, zero, LogUniform(random, 0.3, 10), zero);
  System& system = result.system;
  system.B = MatrixXd::Zero(2 * boxes, boxes);
  system.N = MatrixXd::Zero(boxes, 2 * boxes);
  system.M = MatrixXd::Zero(boxes, boxes);
  system.G = {MatrixXd::Zero(boxes, 1)};
  system.D = MatrixXd::Zero(0, boxes);
  VectorXd mass(boxes);
  for (double& m : mass) m = random.Uniform(0.5, 5);
  const double air = random.Chance(0.3) ? random.Uniform(0, 0.5) : 0;
  double height = 0;
  for (int i = 0; i < boxes; ++i) {
    const double stiffness = LogUniform(random, 1e3, 1e6);
    const double delay = 2 * damping * std::sqrt(mass[i] / stiffness);
    system.A(2 * i, 2 * i + 1) = 1;
    system.A(2 * i + 1, 2 * i + 1) = -air;
    system.F[0](2 * i + 1, 0) = -kGravity;
    system.M(i, i) = 1 / stiffness;
    system.N(i, 2 * i) = 1;
    system.N(i, 2 * i + 1) = delay;
    system.B(2 * i + 1, i) = 1 / mass[i];
    if (i > 0) {
      system.N(i, 2 * i - 2) = -1;
      system.N(i, 2 * i - 1) = -delay;
      system.B(2 * i - 1, i) = -1 / mass[i - 1];
    }
    height -= kGravity * mass.tail(boxes - i).sum() / stiffness;
    system.x0[2 * i] = height;
    result.beside[2 * i] = -height;
    result.beside[2 * i + 1] = -height * std::sqrt(stiffness / mass[i]);
  }
  return result;
}

// Capacitors at two to five nodes, resistors and coils between them, constant sources; starts at solve(A, -f).
PlainSystem NetworkAtItsOperatingPoint(Random& random) {
  const int nodes = random.Integer(2, 5), coils = random.Integer(1, nodes);
  const bool is_real = random.Chance(0.5);  // else in seconds, ohms and farads about 1
  const int m = nodes + coils;
  MatrixXd A = MatrixXd::Zero(m, m);
  VectorXd constant = VectorXd::Zero(m);
  MatrixXd conductance = MatrixXd::Zero(nodes, nodes);
  const double unit = is_real ? 1e-3 : 1;
  const auto any_conductance = [&] { return unit * LogUniform(random, 0.1, 10); };
  for (int i = 0; i < nodes; ++i) {
    conductance(i, i) += any_conductance();
    if (i == 0) continue;
    const int j = random.Integer(0, i - 1);
    const double between = any_conductance();
    conductance(i, i) += between;
    conductance(j, j) += between;
    conductance(i, j) -= between;
    conductance(j, i) -= between;
  }
  MatrixXd incidence = MatrixXd::Zero(nodes, coils);
  for (int k = 0; k < coils; ++k) {
    const int from = random.Integer(0, nodes - 1), to = random.Integer(-1, nodes - 1);
    incidence(from, k) += 1;
    if (to >= 0) incidence(to, k) -= 1;
  }
  for (int i = 0; i < nodes; ++i) {
    const double capacity = is_real ? LogUniform(random, 1e-8, 1e-5) : LogUniform(random, 0.1, 10);
    A.row(i).head(nodes) = -conductance.row(i) / capacity;
    A.row(i).tail(coils) = -incidence.row(i) / capacity;
    if (random.Chance(0.6)) constant[i] = 10 * random.Normal() * unit / capacity;
  }
  for (int k = 0; k < coils; ++k) {
    const double inductance = is_real ? LogUniform(random, 1e-3, 1) : LogUniform(random, 0.1, 10);
    A.row(nodes + k).head(nodes) = incidence.col(k).transpose() / inductance;
    A(nodes + k, nodes + k) = -(is_real ? 10 : 1) * LogUniform(random, 0.01, 1) / inductance;
  }
  VectorXd beside = VectorXd::Constant(m, 10);
  beside.tail(coils) *= unit;
  return LinearSystem(A, A.fullPivLu().solve(-constant), constant, unit * LogUniform(random, 1, 100), beside);
}

// x' = A (x - xe), a third of xe zero, from xe, or a part of it from elsewhere.
PlainSystem Equilibrium(Random& random) {
  const int m = random.Integer(1, 12);
  MatrixXd A(m, m);
  VectorXd rest(m);
  for (int i = 0; i < m; ++i) {
    for (int j = 0; j < m; ++j) A(i, j) = random.Normal() / std::sqrt(m) - (i == j ? 1.5 : 0);
    rest[i] = random.Chance(0.3) ? 0 : random.Normal();
  }
  VectorXd x0 = rest;
  if (random.Chance(0.3)) x0[random.Integer(0, m - 1)] += random.Normal();
  return LinearSystem(A, x0, -A * rest, LogUniform(random, 1, 100), VectorXd::Constant(m, m > 1 ? 1 : 0));
}

// An undamped coil and capacitor at rest under their source for 1e3 to 1e5 times their time.
PlainSystem TankAtRest(Random& random) {
  const double rate = random.Uniform(0.5, 2), rest = random.Normal();
  MatrixXd A(2, 2);
  A << 0, rate, -rate, 0;
  return LinearSystem(A, Eigen::Vector2d(rest, 0), Eigen::Vector2d(0, rate * rest), LogUniform(random, 1e3, 3e4),
                      VectorXd::Constant(2, std::abs(rest)));
}

}  // namespace dlcs::plain
