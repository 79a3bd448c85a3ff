// SPDX-License-Identifier: Apache-2.0
// Small linear programs in exact arithmetic.

#ifndef DLCS_CORE_LINALG_EXACT_PROGRAM_H_
#define DLCS_CORE_LINALG_EXACT_PROGRAM_H_

#include <boost/multiprecision/cpp_int.hpp>
#include <optional>
#include <vector>

#include "core/types.h"

namespace dlcs {

using BigInteger = boost::multiprecision::cpp_int;
using BigVector = std::vector<BigInteger>;
using BigMatrix = std::vector<BigVector>;  // by rows

// R M C in integers with R and C positive and powers of two. Absent where the entries would have more than 128
// bits.
struct IntegerForm {
  BigMatrix entries;
  Vector row, column;  // R, C
};
std::optional<IntegerForm> AsIntegers(const Matrix& M);

// Whether some z >= 0 has A z = b: z, up to a positive factor, or else v with Aᵀv <= 0 and bᵀv > 0 (Farkas). The
// simplex method with Bland's rule and integer pivoting: every number on the way is a minor of (A, b). Some ten rows.
struct ExactFeasibility {
  bool feasible = false;
  BigVector z, v;
  BigInteger factor = 1;  // z / factor solves A z = b
};
ExactFeasibility SolveExactly(const BigMatrix& A, const BigVector& b);

// Some x with h x > 0 for all rows h; absent where there is none. `columns` is the length of a row.
std::optional<BigVector> FindInside(const BigMatrix& rows, std::size_t columns);

// In doubles, divided by the greatest common divisor. Rounded where the integers are long.
Vector AsDoubles(const BigVector& integers);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_EXACT_PROGRAM_H_
