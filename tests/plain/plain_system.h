// SPDX-License-Identifier: Apache-2.0
// Systems as people write them: networks, machines and loads, most of them at rest or symmetric, so that some component
// is zero, small, or the difference of large ones. Everything is a function of the seed.

#ifndef DLCS_TESTS_PLAIN_PLAIN_SYSTEM_H_
#define DLCS_TESTS_PLAIN_PLAIN_SYSTEM_H_

#include <Eigen/Core>
#include <cstdint>
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

// Of the family seed % kFamilies; three in ten in other units, 2^-26 to 2^26, and three in ten in another order.
PlainSystem MakePlainSystem(uint64_t seed);
int NumFamilies();

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

#endif  // DLCS_TESTS_PLAIN_PLAIN_SYSTEM_H_
