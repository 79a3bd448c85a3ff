// SPDX-License-Identifier: Apache-2.0
// An answer with its reason and the witness that proves it.

#ifndef DLCS_CORE_MATRIX_CLASSES_FACT_H_
#define DLCS_CORE_MATRIX_CLASSES_FACT_H_

#include <optional>
#include <string>
#include <vector>

#include "core/types.h"

namespace dlcs {

enum class Answer { kNo, kYes, kUnknown };

// A proof that the caller can check by arithmetic alone. The comment of each test says which fields it sets.
struct Witness {
  std::vector<Index> indices;   // S, increasing: the principal submatrix M_SS is meant
  std::optional<double> value;  // of the minor det M_SS, of the form zᵀMz, ...
  Vector z;                     // a vector, of |S| entries where `indices` is set, else of n; empty when not used
  Matrix X, Y;                  // M X = Y, (4.10) of [Chen & Xiang 2013]
  Vector r, s;                  // rᵀX + sᵀY > 0, the same

  bool empty() const {
    return indices.empty() && !value && z.size() == 0 && X.size() == 0 && Y.size() == 0 && r.size() == 0 &&
           s.size() == 0;
  }
};

// One fact. `why` is a reason in words: "M[2][2] = -1 is a negative principal minor", "strictly diagonally dominant
// with positive diagonal", "n = 40 is beyond the exact test and no sufficient test applies".
struct Fact {
  Answer answer = Answer::kUnknown;
  std::string why;
  Witness witness = {};
  bool yes() const { return answer == Answer::kYes; }
  bool no() const { return answer == Answer::kNo; }
};

enum class ConstantKind { kExact, kUpperBound, kLowerBound, kEstimate };

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_FACT_H_
