// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/matrix_class.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/analysis/lipschitz.h"
#include "core/analysis/p_matrix.h"
#include "core/analysis/positive_semidefinite.h"

namespace dlcs {
namespace {

std::string Describe(const MatrixClass& known, bool skew) {
  if (known.zero) return "M = 0 (index one where NB allows)";
  if (known.p.yes() && known.z.yes()) return "P- and Z-matrix (nonsingular M-matrix)";
  if (known.p.yes()) return absl::StrCat("P-matrix (", known.p.why, ")");
  if (known.z.yes()) return absl::StrCat("Z-matrix, not a P-matrix (", known.p.why, ")");
  const std::string open = known.p.answer == Answer::kUnknown ? "; whether P is unknown" : "";
  if (skew) return "skew-symmetric, hence positive semidefinite";
  if (known.positive_semidefinite.yes()) return absl::StrCat("positive semidefinite, neither P nor Z", open);
  if (!open.empty()) return absl::StrCat("no class known: not Z, not positive semidefinite", open);
  return "neither P, nor Z, nor positive semidefinite";
}

}  // namespace

Fact TestZMatrix(const Matrix& M) {
  for (Index i = 0; i < M.rows(); ++i) {
    for (Index j = 0; j < M.cols(); ++j) {
      if (i != j && M(i, j) > 0) {
        Fact fact{Answer::kNo,
                  absl::StrCat("M[", i, "][", j, "] = ", M(i, j), " is positive, off the diagonal")};
        fact.witness.indices = {std::min(i, j), std::max(i, j)};
        fact.witness.value = M(i, j);
        return fact;
      }
    }
  }
  return {Answer::kYes, "no off-diagonal entry is positive"};
}

MatrixClass Classify(const Matrix& M) {
  MatrixClass known;
  known.zero = (M.array() == 0).all();
  known.zero_row = (M.array() == 0).rowwise().all().any();
  known.z = TestZMatrix(M);
  known.p = TestPMatrix(M);
  known.positive_semidefinite = TestPositiveSemidefinite(M);
  if (known.p.yes() || known.z.yes()) known.lipschitz = LipschitzConstant(M);
  known.description = Describe(known, M == -M.transpose());
  return known;
}

absl::StatusOr<Selection> SelectRule(SolutionRule rule, const MatrixClass& matrix_class) {
  switch (rule) {
    case SolutionRule::kAuto:
      if (matrix_class.p.yes()) return Selection::kUnique;
      return matrix_class.z.yes() && !matrix_class.zero_row ? Selection::kLeastElement : Selection::kAny;
    case SolutionRule::kUnique:
      if (matrix_class.p.yes()) return Selection::kUnique;
      return absl::InvalidArgumentError(
          absl::StrCat("rule: unique needs a P-matrix M, but ",
                       matrix_class.p.answer == Answer::kNo ? "" : "whether it is one is not known: ",
                       matrix_class.p.why));
    case SolutionRule::kLeastElement:
      if (matrix_class.z.yes()) return Selection::kLeastElement;
      return absl::InvalidArgumentError(
          absl::StrCat("rule: least-element needs a Z-matrix M, but ", matrix_class.z.why));
  }
  return absl::InvalidArgumentError("rule: not one of auto, unique, least-element");
}

}  // namespace dlcs
