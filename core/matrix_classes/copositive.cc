// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/copositive.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/matrix_classes/positive_semidefinite.h"
#include "core/matrix_classes/semicopositive.h"

namespace dlcs {
namespace {

// Turns a fact about M + Mᵀ, whose sums are rounded, into one about the quadratic form of M. The reason names the entry
// of M if a diagonal entry decides, and M + Mᵀ otherwise.
Fact OfTheForm(const Matrix& M, Fact fact, bool sums_are_exact) {
  const std::vector<Index>& S = fact.witness.indices;
  if (fact.no() && S.size() == 1) {
    fact.why = absl::StrCat("M[", S[0], "][", S[0], "] = ", M(S[0], S[0]), " is ",
                            M(S[0], S[0]) < 0 ? "negative" : "not positive");
  } else {
    fact.why = absl::StrCat("of its symmetric part (doubled): ", fact.why);
  }
  if (!fact.no()) return fact;
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
