// SPDX-License-Identifier: Apache-2.0
// All solutions of a small LCP(q, M) with integer entries, in integers.

#ifndef DLCS_TESTS_HOSTILE_EXACT_LCP_H_
#define DLCS_TESTS_HOSTILE_EXACT_LCP_H_

#include <cstdint>
#include <vector>

#include "tests/support/integer_matrices.h"

namespace dlcs::testing {

using IntegerVector = std::vector<std::int64_t>;

// y = numerator / denominator, denominator > 0, without a common divisor.
struct Fractions {
  std::vector<Integer> numerator;
  Integer denominator = 1;

  long double operator[](std::size_t i) const {
    return static_cast<long double>(numerator[i]) / static_cast<long double>(denominator);
  }
  bool operator==(const Fractions&) const = default;
};

// The solution set is a union of polyhedra in y >= 0, none of which holds a line. So it is not empty exactly where it
// has a vertex; a vertex with the support T has w_R = 0 for some R of as many rows with M_RT nonsingular.
struct ExactLcp {
  std::vector<Fractions> vertices;  // distinct
  std::vector<Fractions> basic;     // of these, those with R = S for some S that holds the support
  bool bounded = true;              // no solution has a ray of solutions
  bool solvable() const { return !vertices.empty(); }
  bool unique() const { return vertices.size() == 1 && bounded; }
};

// By Cramer's rule for all T and R: 4ⁿ determinants and more, n <= 5 and entries to about 100.
ExactLcp SolveExactly(const IntegerMatrix& M, const IntegerVector& q);

// The least of each component over the vertices: for a Z-matrix, the least element.
std::vector<long double> LeastComponents(const ExactLcp& lcp);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_HOSTILE_EXACT_LCP_H_
