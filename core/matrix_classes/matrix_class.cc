// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/matrix_class.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/matrix_classes/hidden_z.h"
#include "core/matrix_classes/lipschitz.h"
#include "core/matrix_classes/m_matrix.h"
#include "core/matrix_classes/p_matrix.h"
#include "core/matrix_classes/positive_semidefinite.h"
#include "core/matrix_classes/sparse_class.h"
#include "core/problem/violation_list.h"

namespace dlcs {
namespace {

std::string Describe(const MatrixClass& known, bool skew) {
  if (known.zero) return "zero (index one where N B allows)";
  if (known.p.yes() && known.z.yes()) return "P- and Z-matrix (nonsingular M-matrix)";
  if (known.p.yes()) return absl::StrCat("P-matrix (", known.p.why, ")");
  if (known.z.yes()) return absl::StrCat("Z-matrix, not a P-matrix (", known.p.why, ")");
  const std::string open = known.p.answer == Answer::kUnknown ? "; whether P is unknown" : "";
  if (skew) return "skew-symmetric, hence positive semidefinite";
  if (known.positive_semidefinite.yes()) return absl::StrCat("positive semidefinite, neither P nor Z", open);
  if (!open.empty()) return absl::StrCat("of no known class: not Z, not positive semidefinite", open);
  return "neither P, nor Z, nor positive semidefinite";
}

}  // namespace

Fact TestZMatrix(const Matrix& M) {
  if (IsZMatrix(M)) return {Answer::kYes, "no off-diagonal entry is positive"};
  for (Index i = 0; i < M.rows(); ++i) {
    for (Index j = 0; j < M.cols(); ++j) {
      if (i != j && M(i, j) > 0) {
        Fact fact{Answer::kNo, absl::StrCat("M[", i, "][", j, "] = ", M(i, j), " is positive, off the diagonal")};
        fact.witness.indices = {std::min(i, j), std::max(i, j)};
        fact.witness.value = M(i, j);
        return fact;
      }
    }
  }
  return {Answer::kYes, "no off-diagonal entry is positive"};
}

namespace {

MatrixClass ClassifyDense(const Matrix& M, SolutionRule rule) {
  MatrixClass known;
  known.size = M.rows();
  known.zero = (M.array() == 0).all();
  known.zero_row = (M.array() == 0).rowwise().all().any();
  known.z = TestZMatrix(M);
  known.p = TestPMatrix(M);
  known.positive_semidefinite = TestPositiveSemidefinite(M);
  if (rule == SolutionRule::kHiddenLeastElement) known.hidden_z = TestHiddenZ(M);
  if (known.p.yes() || known.z.yes() || known.hidden_z.yes()) known.lipschitz = LipschitzConstant(M);
  known.description = Describe(known, M == -M.transpose());
  return known;
}

}  // namespace

MatrixClass Classify(const StructuredMatrix& M, SolutionRule rule) {
  const SparseMatrix* const sparse = LargeSparse(M);
  if (sparse && rule != SolutionRule::kHiddenLeastElement) {
    MatrixClass known = ClassifySparse(*sparse);
    if (known.p.yes() || known.zero) return known;
  }
  return ClassifyDense(M, rule);
}

const SparseMatrix* LargeSparse(const StructuredMatrix& M) {
  constexpr Index kLarge = 1000;
  const SparseMatrix* const sparse = M.sparse();
  return sparse && sparse->rows() > kLarge ? sparse : nullptr;
}

const char* SelectionName(Selection selection) {
  switch (selection) {
    case Selection::kUnique:
      return "the one solution";
    case Selection::kLeastElement:
      return "the least element";
    case Selection::kHiddenLeastElement:
      return "the least element in the order of pos X";
    case Selection::kLeastNorm:
      return "the solution of least norm";
    case Selection::kMinimizer:
      return "the minimizer of |C y - b|";
    case Selection::kSparsest:
      return "the solution with the fewest positive components";
    case Selection::kHistory:
      return "the solution that continues the one before";
    case Selection::kAny:
      break;
  }
  return "any solution of the coupled step";
}

bool IsAlwaysLipschitz(Selection selection) {
  return selection == Selection::kUnique || selection == Selection::kLeastElement ||
         selection == Selection::kHiddenLeastElement;
}

namespace {

absl::Status Refuse(const char* rule, const char* needs, const Fact& fact) {
  return InvalidField("rule", absl::StrCat(rule, " needs ", needs, " M, but ",
                                           fact.no() ? "" : "whether it is one is not known: ", fact.why));
}

// Least norm and minimizer: the solution set is convex, or all its pieces are looked at.
absl::StatusOr<Selection> SelectMinimizer(Selection selection, const char* rule, const MatrixClass& matrix_class) {
  if (matrix_class.p.yes()) return Selection::kUnique;
  if (matrix_class.positive_semidefinite.yes() || matrix_class.size <= kMaxSolutionEnumeration) return selection;
  return InvalidField("rule",
                      absl::StrCat(rule, " needs a positive semidefinite M, or one with n <= ", kMaxSolutionEnumeration,
                                   ", but n = ", matrix_class.size, " and ", matrix_class.positive_semidefinite.why));
}

}  // namespace

absl::StatusOr<Selection> SelectRule(SolutionRule rule, const MatrixClass& matrix_class) {
  const bool z = matrix_class.z.yes(), p = matrix_class.p.yes();
  switch (rule) {
    case SolutionRule::kAuto:
      if (p) return Selection::kUnique;
      return z && !matrix_class.zero_row ? Selection::kLeastElement : Selection::kAny;
    case SolutionRule::kUnique:
      if (p) return Selection::kUnique;
      return Refuse("unique", "a P-matrix", matrix_class.p);
    case SolutionRule::kLeastElement:
      if (z) return Selection::kLeastElement;
      return Refuse("least-element", "a Z-matrix", matrix_class.z);
    case SolutionRule::kHiddenLeastElement:
      if (z) return Selection::kLeastElement;  // X = I
      if (matrix_class.hidden_z.yes()) return p ? Selection::kUnique : Selection::kHiddenLeastElement;
      return Refuse("hidden-least-element", "a hidden Z-matrix", matrix_class.hidden_z);
    case SolutionRule::kLeastNorm:
      // With a zero row the two part in coupled steps: see core/lcp/dense/coupled_selection.h.
      if (z && !p && !matrix_class.zero_row) return Selection::kLeastElement;
      return SelectMinimizer(Selection::kLeastNorm, "least-norm", matrix_class);
    case SolutionRule::kMinimizer:
      return SelectMinimizer(Selection::kMinimizer, "minimizer", matrix_class);
    case SolutionRule::kSparsest:
      if (p) return Selection::kUnique;
      if (z) return Selection::kLeastElement;  // positive in no more components than any other solution
      if (matrix_class.size <= kMaxSolutionEnumeration) return Selection::kSparsest;
      return InvalidField("rule", absl::StrCat("sparsest needs a P- or a Z-matrix M, or one with n <= ",
                                               kMaxSolutionEnumeration, ", but n = ", matrix_class.size));
    case SolutionRule::kHistory:
      return p ? Selection::kUnique : Selection::kHistory;
  }
  return InvalidField(
      "rule", "not one of auto, unique, least-element, hidden-least-element, least-norm, minimizer, sparsest, history");
}

}  // namespace dlcs
