// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/semicopositive.h"

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/matrix_classes/p_matrix.h"
#include "core/matrix_classes/s_matrix.h"
#include "core/matrix_classes/semicopositive_sweep.h"

namespace dlcs {
namespace {

Fact Refuted(std::string why, std::vector<Index> indices, Vector z) {
  Fact fact{Answer::kNo, std::move(why)};
  fact.witness.indices = std::move(indices);
  fact.witness.z = std::move(z);
  return fact;
}

std::vector<Index> All(Index n) {
  std::vector<Index> all;
  for (Index i = 0; i < n; ++i) all.push_back(i);
  return all;
}

// A single diagonal entry can refute a class.
void SeeDiagonal(const Matrix& M, SemicopositiveClasses& known) {
  for (Index i = 0; i < M.rows(); ++i) {
    if (M(i, i) > 0) continue;
    Fact no = Refuted(absl::StrCat("M[", i, "][", i, "] = ", M(i, i), " is not positive"), {i}, Vector::Ones(1));
    if (M(i, i) < 0) {
      known = {no, no};
      known.weak.why = absl::StrCat("M[", i, "][", i, "] = ", M(i, i), " is negative");
      return;
    }
    if (!known.strict.no()) known.strict = std::move(no);
  }
}

// Mz >= Ñz for z >= 0, where Ñ is diag M with the negative entries of M beside it: what makes Ñ an M-matrix
// makes M strictly semicopositive.
void SeeNegativeEntries(const Matrix& M, SemicopositiveClasses& known) {
  if (M.minCoeff() >= 0) known.weak = {Answer::kYes, "no entry is negative"};
  if (known.strict.no()) return;
  Vector z = PositiveImageOfMMatrix(ZMatrixBelow(M));
  if (z.size() == 0) return;
  Fact yes{Answer::kYes, M.minCoeff() >= 0 ? "nonnegative with positive diagonal"
                                           : "its diagonal outweighs its negative entries, after column scaling"};
  yes.witness.z = std::move(z);
  known = {yes, yes};
}

// What can be said beyond the sweep.
void SeeLargeMatrix(const Matrix& M, SemicopositiveClasses& known) {
  const std::string beyond =
      absl::StrCat("n = ", M.rows(), " is beyond the exact test (n <= ", kMaxExactSize, ") and no other test decides");
  if (known.strict.answer == Answer::kUnknown) {
    known.strict.why = beyond;
    if (const Fact p = TestPMatrix(M); p.yes()) {
      known.strict = known.weak = {Answer::kYes, absl::StrCat("a P-matrix: ", p.why)};
    } else if (const Fact s = TestSMatrix(M.transpose()); s.no()) {
      known.strict = Refuted("some z >= 0, z != 0, has Mz <= 0", All(M.rows()), s.witness.z);
    }
  }
  if (known.weak.answer == Answer::kUnknown) {
    known.weak.why = beyond;
    if (const Fact s = TestSMatrix(-M); s.yes() && s.witness.z.minCoeff() > 0) {
      known.weak = Refuted("some z > 0 has Mz < 0", All(M.rows()), s.witness.z);
    }
  }
}

}  // namespace

SemicopositiveClasses ClassifySemicopositive(const Matrix& M) {
  SemicopositiveClasses known;
  const auto decided = [&known] {
    return known.strict.answer != Answer::kUnknown && known.weak.answer != Answer::kUnknown;
  };
  SeeDiagonal(M, known);
  if (!decided()) SeeNegativeEntries(M, known);
  if (decided()) return known;
  if (M.rows() > kMaxExactSize) {
    SeeLargeMatrix(M, known);
    return known;
  }
  SemicopositiveClasses swept = SweepSemicopositive(M);
  if (known.strict.answer == Answer::kUnknown) known.strict = std::move(swept.strict);
  if (known.weak.answer == Answer::kUnknown) known.weak = std::move(swept.weak);
  return known;
}

}  // namespace dlcs
