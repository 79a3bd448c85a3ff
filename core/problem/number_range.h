// SPDX-License-Identifier: Apache-2.0
// Numbers so large that products of them are beyond the largest double, 1.8e308.

#ifndef DLCS_CORE_PROBLEM_NUMBER_RANGE_H_
#define DLCS_CORE_PROBLEM_NUMBER_RANGE_H_

#include <string>

#include "core/problem/problem.h"
#include "core/problem/violation_list.h"

namespace dlcs {

// Adds the first overflow of each product that is needed whatever the method: N B, which drives w; A x0, N x0 and
// E⁻¹A, E⁻¹B, E⁻¹f(0) with a diagonal E; and the y for which w(0) >= 0 asks, -(N x0 + g(0))_i over the size of row i of
// M. Only what overflows in itself counts: there is no other bound. `problem` must be valid otherwise. Not for matrices
// that are known by their products only. Cost: a pass over the entries, and over those of products only if the largest
// ones may overflow.
void CheckNumberRange(const Problem& problem, ViolationList& list);

// The product at the state x, y and time t that overflows, or the sum of its terms, as a sentence: A x, N x, B y, M y,
// A x + B y + f, A f, N f or N A x. Empty if none does.
std::string OverflowAt(const Problem& problem, const Vector& x, const Vector& y, double t);

// For a solve that failed: that T is so long that neighboring doubles near it are further apart than 1/‖E⁻¹A‖ (E
// diagonal or absent), so that the fastest component cannot be followed. As a sentence; empty otherwise.
std::string UnresolvedHorizon(const Problem& problem);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_NUMBER_RANGE_H_
