// SPDX-License-Identifier: Apache-2.0
// Classes of integer matrices by definition, in exact arithmetic. Tests compare the analysis with them.

#ifndef DLCS_TESTS_SUPPORT_INTEGER_MATRICES_H_
#define DLCS_TESTS_SUPPORT_INTEGER_MATRICES_H_

#include <cstdint>
#include <random>
#include <vector>

#include "core/types.h"

namespace dlcs::testing {

__extension__ using Integer = __int128;
using IntegerMatrix = std::vector<std::vector<std::int64_t>>;

int Sign(Integer value);

// The indices in a bit set, increasing.
std::vector<Index> Members(unsigned set);

// det of the given rows and columns by expansion along the rows, over all sets of columns: no division, no
// pivoting.
Integer ExactDeterminant(const IntegerMatrix& a, const std::vector<Index>& rows, const std::vector<Index>& cols);

// The signs of the principal minors, as section 1 of [Chen & Xiang] wants them.
struct MinorTruth {
  bool nondegenerate = true, p = true, p0 = true, n = true, np = true, pn = true;
};
MinorTruth ExactMinorClasses(const IntegerMatrix& a);

// Strict semicopositivity without linear programs: a smallest S that violates it has an extreme ray z > 0 of
// { z >= 0, M_SS z <= 0 } with all but one row at zero, so ±z is a column of the adjugate of M_SS.
bool ExactlyStrictlySemicopositive(const IntegerMatrix& a);

// Semicopositivity by enumeration of the vertices of { z >= 0, -M_SS z >= e } for all S. For n <= 4.
bool ExactlySemicopositive(const IntegerMatrix& a);

// (Strict) copositivity: where the least value λ of the form over the simplex is taken with the fewest
// entries, S, either λ != 0, A_SS is nonsingular and z = λ A_SS⁻¹e; or λ = 0 and z spans the kernel of A_SS. A =
// M + Mᵀ.
struct CopositiveTruth {
  bool strictly_copositive = true, copositive = true;
};
CopositiveTruth ExactlyCopositive(const IntegerMatrix& a);

IntegerMatrix DoubledSymmetricPart(const IntegerMatrix& a);

// 2^exponent a.
Matrix AsDoubles(const IntegerMatrix& a, int exponent);

// Draws members of all the classes, and neighbors of them.
class IntegerMatrixGenerator {
 public:
  explicit IntegerMatrixGenerator(unsigned seed) : generator_(seed) {}

  std::int64_t Integer(std::int64_t low, std::int64_t high) {
    return std::uniform_int_distribution<std::int64_t>(low, high)(generator_);
  }
  IntegerMatrix Any(Index n);

 private:
  std::int64_t Entry(std::int64_t kind, bool diagonal, Index n, std::int64_t spread);

  std::mt19937_64 generator_;
};

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_INTEGER_MATRICES_H_
