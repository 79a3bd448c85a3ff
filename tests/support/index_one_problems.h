// SPDX-License-Identifier: Apache-2.0
// Linear complementarity systems of index one: M = 0, no sources.

#ifndef DLCS_TESTS_SUPPORT_INDEX_ONE_PROBLEMS_H_
#define DLCS_TESTS_SUPPORT_INDEX_ONE_PROBLEMS_H_

#include "core/analysis/index_one.h"
#include "core/problem/problem.h"

namespace dlcs::testing {

// x' = A x + B y, 0 <= y ⟂ C x >= 0 on [0, horizon].
Problem IndexOneProblem(const IndexOneSystem& system, const Vector& x0, double horizon);

// Example 10 of [Shen & Pang 2007], CB = [1 3 0; 0 1 3; 3 0 1]; from x0 = (0, 0, 0, 1) it has many solutions.
IndexOneSystem ExampleTenSystem();

// Three contacts with CB an M-matrix, driven by a rotation (x4, x5): they close and open on [0, 6].
IndexOneSystem ThreeContacts();
Vector ThreeContactsStart();

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_INDEX_ONE_PROBLEMS_H_
