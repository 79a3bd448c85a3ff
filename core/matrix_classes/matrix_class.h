// SPDX-License-Identifier: Apache-2.0
// The class of the matrix M of a linear complementarity problem, and which solution rule it admits.

#ifndef DLCS_CORE_MATRIX_CLASSES_MATRIX_CLASS_H_
#define DLCS_CORE_MATRIX_CLASSES_MATRIX_CLASS_H_

#include <optional>

#include "absl/status/statusor.h"
#include "core/linalg/structured_matrix.h"
#include "core/matrix_classes/class_facts.h"
#include "core/matrix_classes/fact.h"
#include "core/problem/problem.h"
#include "core/types.h"

namespace dlcs {

// Classifies `M` (square, finite, n >= 1), with what `rule` needs to know. Exact P-test (all principal
// minors, by recursive Schur complements) for n <= 20, and for Z-matrices of any size; beyond, sufficient and
// necessary polynomial tests, otherwise unknown. What is zero to working precision counts as zero. O(2ⁿ) up
// to 20, O(n³) beyond. A large sparse matrix that ClassifySparse() (core/matrix_classes/sparse_class.h) proves to be P
// or zero costs a few sparse factorizations instead.
MatrixClass Classify(const StructuredMatrix& M, SolutionRule rule = SolutionRule::kAuto);

// `M` if it is sparse and so large that no dense form of it should be made where that can be avoided; null otherwise.
// Below that size tests of the dense matrix take less than a second, and know more.
const SparseMatrix* LargeSparse(const StructuredMatrix& M);

// Whether no off-diagonal entry of `M` is positive. No comes with `witness.indices` = {i, j}, increasing, and
// `witness.value` = M_ij or M_ji, which is positive.
Fact TestZMatrix(const Matrix& M);

// The rule a solver follows once M is known.
enum class Selection {
  kUnique,              // M is a P-matrix
  kLeastElement,        // M is a Z-matrix
  kHiddenLeastElement,  // M is a hidden Z-matrix
  kLeastNorm,           // M is positive semidefinite, or small
  kMinimizer,           // the same
  kSparsest,            // M is small
  kHistory,             // any M: the solution that is reached from the one before
  kAny,                 // none of these: any solution; only coupled steps make sense
};
const char* SelectionName(Selection selection);  // "the one solution", "the least element", ...

// A selection with what a solver needs to make it.
struct SolutionChoice {
  SolutionChoice(Selection selected) : selection(selected) {}  // enough for all but the two below
  SolutionChoice(Selection selected, const std::optional<Selector>& by, const MatrixClass& matrix_class)
      : selection(selected), selector(by), X(matrix_class.hidden_z.witness.X) {}

  Selection selection;
  std::optional<Selector> selector = std::nullopt;  // for kMinimizer
  Matrix X = {};                                    // for kHiddenLeastElement: M X = Y, (4.10) of [Chen & Xiang]
};

// Whether y is a Lipschitz function of q for every M that admits the selection: kUnique, kLeastElement and
// kHiddenLeastElement. The least norm is not ([Chen & Xiang], Remark 2.1), nor is any other minimizer.
bool IsAlwaysLipschitz(Selection selection);

// Up to this size all 2ⁿ choices of active constraints are enumerated if no class of M helps.
inline constexpr Index kMaxSolutionEnumeration = 12;

// Turns `rule` into a selection for M. kAuto: kUnique for a P-matrix, else kLeastElement for a Z-matrix without a zero
// row, otherwise kAny. A zero row i means that (N x + g)_i >= 0 constrains the state alone; y_i is then a multiplier
// that the least element would set to zero. If another selection gives the same solution at less cost, it is returned:
// kUnique if the solution is unique, and kLeastElement instead of kLeastNorm for a Z-matrix without a zero row. Errors:
// InvalidArgument, for field "rule", when M does not admit the rule, with the witness.
absl::StatusOr<Selection> SelectRule(SolutionRule rule, const MatrixClass& matrix_class);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_MATRIX_CLASS_H_
