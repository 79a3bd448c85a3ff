// SPDX-License-Identifier: Apache-2.0
// The linear complementarity problem LCP(q, M): 0 <= y ⟂ w = q + M y >= 0.

#ifndef DLCS_CORE_LCP_LCP_H_
#define DLCS_CORE_LCP_LCP_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/lcp/basis/lcp_solver.h"
#include "core/lcp/basis/solution_function.h"
#include "core/lcp/dense/basic_solutions.h"
#include "core/linalg/structured_matrix.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/problem/problem.h"
#include "core/types.h"

namespace dlcs {

struct LcpResult {
  LcpStatus verdict = LcpStatus::kPivotLimit;
  Vector y;             // the solution; zero when not solved
  Vector w;             // q + M y
  double residual = 0;  // ‖min(y, w)‖_∞, computed from y afresh; NaN when a number is not finite
  Index pivots = 0;
  std::string method;                             // "principal pivoting", ...
  std::string message;                            // why this verdict
  std::string matrix_class;                       // of M, as text
  Selection selection = Selection::kAny;          // the rule that was followed
  IndexSets sets;                                 // of y, with kSolved
  bool only_choice = true;                        // false where several minimizers tied
  std::optional<BasicSolutions> basic_solutions;  // if they were requested
};

struct LcpRequest {
  SolutionRule rule = SolutionRule::kAuto;
  std::optional<Selector> selector = std::nullopt;  // with kMinimizer, and only then
  bool all_basic_solutions = false;                 // n <= kMaxBasicSolutionsSize
};

// ‖min(y, q + M y)‖_∞; NaN if any entry is not finite.
double LcpResidual(const Matrix& M, const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& y);

// Solves one LCP with the solver for the class of M. M and q are taken as exact: w_i of a solution is negative, or
// positive together with y_i, by no more than the rounding of its sum, 1e-12 (|q_i| + Σ_j|M_ij| y_j), for any units of
// rows and columns. So q = -1e-16 with M = 0 has no solution.
// Errors: InvalidArgument, one line "field: description" for each rule broken (fields M, q, rule, selector,
//         all_basic_solutions): shapes, non-finite entries, a rule that M does not admit, too large for all solutions;
//         Cancelled when `stop` is requested (checked as often as by Solve() of core/solve.h).
// Cost: the classification of M and O(n³), for small matrices of no class O(2ⁿ) in the worst case.
absl::StatusOr<LcpResult> SolveLcp(const Matrix& M, const Vector& q, const LcpRequest& request,
                                   const std::stop_token& stop = {});
absl::StatusOr<LcpResult> SolveLcp(const Matrix& M, const Vector& q, SolutionRule rule);
// The same for finite M and q whose class and choice are known; does not compute all basic solutions.
LcpResult SolveClassifiedLcp(const Matrix& M, const Vector& q, const MatrixClass& matrix_class,
                             const SolutionChoice& choice);

// The solver of LCP(q, M) for `choice`: principal pivoting with kept factors (kUnique), Chandrasekaran (kLeastElement),
// the linear program (4.11) (kHiddenLeastElement), regularization (kLeastNorm, M positive semidefinite), a quadratic
// program or enumeration (kMinimizer, and kLeastNorm for small M of other classes), Lemke with lexicographic ratio
// test, behind it enumeration for n <= 12 and before it a few rounds of principal pivoting for larger n (kAny). The
// choice is not checked: M must be of the class that SelectRule() requires, and `choice` complete. For a large sparse M
// (LargeSparse()) and a choice that MakeSparseLcpSolver() (core/lcp/structured/sparse_solver.h) supports, no n × n
// matrix is made. Cost: a copy of M at least.
std::unique_ptr<LcpSolver> MakeLcpSolver(const StructuredMatrix& M, const SolutionChoice& choice);

// The solver of the coupled step: y in SOL(q + K y, M), i.e. LCP(q, M + K), where the selection is judged on M: the
// returned y is the selected solution of LCP(q + K y, M) wherever such a fixed point is found
// (core/lcp/dense/coupled_least_element.h, core/lcp/dense/coupled_selection.h). kInfeasible only if LCP(q, M + K) has
// no solution. M + K may be any matrix.
std::unique_ptr<LcpSolver> MakeCoupledLcpSolver(const Matrix& M, const Matrix& K, const SolutionChoice& choice);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_LCP_H_
