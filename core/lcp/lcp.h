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
#include "core/analysis/matrix_class.h"
#include "core/lcp/basic_solutions.h"
#include "core/lcp/solution_function.h"
#include "core/problem.h"
#include "core/types.h"

namespace dlcs {

enum class LcpVerdict {
  kSolved,
  kInfeasible,  // proven: no y >= 0 with q + M y >= 0, or no complementary basis solves it
  kRay,         // Lemke's method ended in a secondary ray and infeasibility is not proven
  kPivotLimit,
  kSingular,   // a basis that had to be factored is singular to working precision
  kNonFinite,  // q holds an infinity or NaN
};
const char* LcpVerdictName(LcpVerdict verdict);  // "SOLVED", "INFEASIBLE", ...

struct LcpResult {
  LcpVerdict verdict = LcpVerdict::kPivotLimit;
  Vector y;             // the solution; zero when not solved
  Vector w;             // q + M y
  double residual = 0;  // ‖min(y, w)‖_∞, computed from y afresh; NaN when a number is not finite
  Index pivots = 0;
  std::string method;   // "principal pivoting", ...
  std::string message;  // why this verdict
  std::string matrix_class;               // of M, for people
  Selection selection = Selection::kAny;  // the rule that was followed
  IndexSets sets;                         // of y, with kSolved
  bool only_choice = true;                // false where several minimisers tied
  std::optional<BasicSolutions> basic_solutions;  // where they were asked for
};

struct LcpRequest {
  SolutionRule rule = SolutionRule::kAuto;
  std::optional<Selector> selector = std::nullopt;  // with kMinimiser, and only then
  bool all_basic_solutions = false;                 // n <= kMaxBasicSolutionsSize
};

// ‖min(y, q + M y)‖_∞; NaN if any entry is not finite.
double LcpResidual(const Matrix& M, const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& y);

// Solves one LCP, with the solver that the class of M calls for. M and q are taken as they stand: w_i of a solution is
// negative, or positive where y_i is, by no more than the rounding of its sum, 1e-12 (|q_i| + Σ_j|M_ij| y_j), whatever
// the units of rows and columns. So q = -1e-16 with M = 0 has no solution.
// Errors: InvalidArgument, one line "field: description" for each rule broken (fields M, q, rule, selector,
//         all_basic_solutions): shapes, non-finite entries, a rule that M does not admit, too large for all solutions;
//         Cancelled when `stop` is requested (looked at as by Solve() of core/solve.h).
// Cost: the classification of M and O(n³), for small matrices of no class O(2ⁿ) in the worst case.
absl::StatusOr<LcpResult> SolveLcp(const Matrix& M, const Vector& q, const LcpRequest& request,
                                   const std::stop_token& stop = {});
absl::StatusOr<LcpResult> SolveLcp(const Matrix& M, const Vector& q, SolutionRule rule);
// The same for finite M and q whose class and choice are known, without the bases of all solutions.
LcpResult SolveClassifiedLcp(const Matrix& M, const Vector& q, const MatrixClass& matrix_class,
                             const SolutionChoice& choice);

// Which y_i are basic (may be positive): the warm start of a solve, and what it leaves behind.
using Basis = std::vector<std::uint8_t>;

// How a solve went, for statistics and messages.
struct LcpAccount {
  Index pivots = 0;         // basic variables exchanged
  const char* method = "";  // the one that gave the verdict: "principal pivoting", ...
  std::string message;      // why, where the verdict is not kSolved
};

// Solves LCP(q, M) for one matrix and many q. One object per thread: a solver keeps factorizations and work
// space and allocates nothing in a solve that finds its basis again.
//
// A solve is a pure function of its arguments: the factors kept from earlier calls are those that a fresh
// solver would compute, so the bits of the answer depend neither on the past nor on which of several clones
// is asked.
class LcpSolver {
 public:
  virtual ~LcpSolver() = default;

  // `q`          n entries.
  // `tolerance`  n entries >= 0, absolute: w_i above -tolerance_i counts as nonnegative. The caller knows the
  //              rounding in q_i; a good value is 1e-13 times the size of the numbers that it was summed
  //              from. The rounding of the solver's own arithmetic is allowed for in any case.
  // `basis`      in: a guess, n entries; out: the basis of the solution, the last one tried where there is
  //              none. The solution does not depend (beyond rounding and `tolerance`) on the guess where it
  //              is unique or the least element.
  // `y`          out: >= 0 exactly, from a factorization of the basis: in a kSolved result w_i is off by at most
  //              10·tolerance_i + 1e-12·(|q_i| + Σ_j|M_ij| y_j). Zero where the verdict is another one.
  virtual LcpVerdict Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                           Basis& basis, Eigen::Ref<Vector> y) = 0;

  // Whether the last solution is the one that the selection means. False only where a coupled solver found a
  // solution of LCP(q, M + K) that is not the selected one of LCP(q + K y, M), and none that is.
  virtual bool KeptSelection() const { return true; }

  // Whether no other solution would have served the selection as well. False only for minimisers.
  virtual bool IsOnlyChoice() const { return true; }

  // How the last Solve() went. Allocates; not for the inner loop.
  virtual LcpAccount Account() const = 0;

  // A fresh solver for the same matrix, for another thread: its results do not depend on this one's past.
  virtual std::unique_ptr<LcpSolver> Clone() const = 0;
};

// The solver of LCP(q, M) for `choice`: principal pivoting with kept factors (kUnique), Chandrasekaran
// (kLeastElement), the linear program (4.11) (kHiddenLeastElement), regularization (kLeastNorm, M positive
// semidefinite), a quadratic program or enumeration (kMinimiser, and kLeastNorm for small M of other classes), Lemke
// with lexicographic ratio test, behind it enumeration for n <= 12 and before it a few rounds of principal pivoting for
// larger n (kAny). The choice is taken on trust: M must be what SelectRule() asks for, `choice` complete.
std::unique_ptr<LcpSolver> MakeLcpSolver(const Matrix& M, const SolutionChoice& choice);

// The solver of the coupled step: y in SOL(q + K y, M), i.e. LCP(q, M + K), where the selection is judged on
// M: the returned y is the selected solution of LCP(q + K y, M) wherever such a fixed point is found
// (core/lcp/coupled_least_element.h, core/lcp/coupled_selection.h). kInfeasible only when LCP(q, M + K) has no
// solution. Nothing is asked of M + K.
std::unique_ptr<LcpSolver> MakeCoupledLcpSolver(const Matrix& M, const Matrix& K, const SolutionChoice& choice);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_LCP_H_
