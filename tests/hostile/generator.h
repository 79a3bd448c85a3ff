// SPDX-License-Identifier: Apache-2.0
// Random systems that are meant to break solvers: every class of M, every kind of A, any units. Everything is a
// function of the seed.

#ifndef DLCS_TESTS_HOSTILE_GENERATOR_H_
#define DLCS_TESTS_HOSTILE_GENERATOR_H_

#include "tests/hostile/system.h"

namespace dlcs::hostile {

System MakeSystem(uint64_t seed);

}  // namespace dlcs::hostile

#endif  // DLCS_TESTS_HOSTILE_GENERATOR_H_
