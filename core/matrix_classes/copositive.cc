// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/copositive.h"

#include <utility>
#include <vector>

#include "core/matrix_classes/positive_semidefinite.h"
#include "core/matrix_classes/semicopositive.h"

namespace dlcs {
namespace {

// The no of the symmetric matrix M + Mᵀ with its rounded sums, for the form of M itself.
Fact OfTheForm(const Matrix& M, Fact fact, bool sums_are_exact) {
  if (!fact.no()) return fact;
  const std::vector<Index>& S = fact.witness.indices;
  const Matrix block = M(S, S);
  const Vector& z = fact.witness.z;
  fact.witness.value = z.dot(block * z);
  if (sums_are_exact || FormIsClearlyNegative(block, z)) return fact;
  return {Answer::kUnknown, "the least value of its quadratic form over z >= 0 is zero to working precision"};
}

}  // namespace

CopositiveClasses ClassifyCopositive(const Matrix& M) {
  const SymmetricSum sum = SymmetricSumBelow(M);
  SemicopositiveClasses known = ClassifySemicopositive(sum.below);
  return {OfTheForm(M, std::move(known.strict), sum.exact), OfTheForm(M, std::move(known.weak), sum.exact)};
}

}  // namespace dlcs
