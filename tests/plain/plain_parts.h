// SPDX-License-Identifier: Apache-2.0
// A plain system, and what the families build theirs with.

#ifndef DLCS_TESTS_PLAIN_PLAIN_PARTS_H_
#define DLCS_TESTS_PLAIN_PLAIN_PARTS_H_

#include <Eigen/Core>
#include <string>

#include "tests/hostile/system.h"

namespace dlcs::plain {

using hostile::Random;
using hostile::System;

struct PlainSystem {
  System system;
  std::string family;
  // What the states stand beside, in their units: the size of a state that acts back on this one. Zero where a state
  // only feeds or only receives: its own size alone counts.
  Eigen::VectorXd beside;
};

double LogUniform(Random& random, double low, double high);

// x' = A x + constant on [0, horizon], x(0) = x0, with one pair that nothing touches, since a problem has one at least.
PlainSystem LinearSystem(const Eigen::MatrixXd& A, const Eigen::VectorXd& x0, const Eigen::VectorXd& constant,
                         double horizon, const Eigen::VectorXd& beside);
// Adds amplitude · sin(rate t + phase) to the factors of f, or, with `row` >= m, of g.
void AddWave(System& system, int row, double amplitude, double rate, double phase);
// Adds the output `of_x` x.
void AddOutput(System& system, const Eigen::VectorXd& of_x);
// Both, side by side. `gains` x_first + constants enter the states of the second.
PlainSystem Beside(const PlainSystem& first, const PlainSystem& second, const Eigen::MatrixXd& gains);

}  // namespace dlcs::plain

#endif  // DLCS_TESTS_PLAIN_PLAIN_PARTS_H_
