// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/lcp.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/lcp/basis/polish.h"
#include "core/lcp/dense/complementary_solver.h"
#include "core/lcp/dense/coupled_least_element.h"
#include "core/lcp/dense/coupled_selection.h"
#include "core/lcp/dense/hidden_least_element.h"
#include "core/lcp/dense/history_solver.h"
#include "core/lcp/dense/least_element.h"
#include "core/lcp/dense/least_norm.h"
#include "core/lcp/dense/minimizer.h"
#include "core/lcp/sparsest.h"
#include "core/lcp/structured/sparse_solver.h"
#include "core/lcp/structured/tridiagonal_solver.h"
#include "core/matrix_classes/m_matrix.h"
#include "core/matrix_classes/p_matrix.h"
#include "core/matrix_classes/positive_semidefinite.h"
#include "core/parallel/stop_scope.h"
#include "core/problem/problem_checks.h"
#include "core/problem/violation_list.h"

namespace dlcs {
namespace {

using Known = ComplementarySolver::Known;

// Whether y is no solution by far more than rounding, in the size of each row: numbers overflowed or underflowed on the
// way.
bool IsLost(const Matrix& M, const Vector& q, const LcpResult& result) {
  constexpr double kLost = 1e-8;
  const Vector& y = result.y;
  const Vector size = q.cwiseAbs() + M.cwiseAbs() * y;
  if (!size.allFinite() || !result.w.allFinite()) return true;
  for (Index i = 0; i < y.size(); ++i) {
    if (result.w[i] < -kLost * size[i]) return true;
    const bool counts = ((M.col(i).cwiseAbs() * y[i]).array() > kLost * size.array()).any();
    if (counts && result.w[i] > kLost * size[i]) return true;
  }
  return false;
}

absl::Status Validate(const Matrix& M, const Vector& q, const LcpRequest& request) {
  const Index n = M.rows();
  ViolationList list;
  CheckSquareMatrix(M, "n x n for n complementary pairs", "M", list);
  if (q.size() != n) {
    list.Add("q", absl::StrCat(ComponentsText(q.size()), "; must be n = ", n, " (from M)"));
  }
  list.AddNonFiniteComponents(q, "q");
  CheckSelector(request.selector, request.rule, n, list);
  if (request.all_basic_solutions && n > kMaxBasicSolutionsSize) {
    list.Add("all_basic_solutions", absl::StrCat("n = ", n, "; must be at most ", kMaxBasicSolutionsSize));
  }
  return StatusOf(std::move(list).Take());
}

// The minimizer of the selector, or the least norm where there is none.
std::unique_ptr<LcpSolver> MakeMinimizer(const Matrix& M, const std::optional<Selector>& selector) {
  if (selector) return std::make_unique<MinimizerSolver>(M, *selector);
  if (TestPositiveSemidefinite(M).yes()) return std::make_unique<LeastNormSolver>(M);
  const Index n = M.rows();
  return std::make_unique<MinimizerSolver>(M, Selector{Matrix::Identity(n, n), Vector::Zero(n)});
}

// The solver of LCP(q, M) whatever the pattern of M.
std::unique_ptr<LcpSolver> MakeGeneralSolver(const Matrix& M, const SolutionChoice& choice) {
  switch (choice.selection) {
    case Selection::kUnique:
      return std::make_unique<ComplementarySolver>(M, IsZMatrix(M) ? Known::kMMatrix : Known::kPMatrix);
    case Selection::kLeastElement:
      return std::make_unique<LeastElementSolver>(M);
    case Selection::kHiddenLeastElement:
      return std::make_unique<HiddenLeastElementSolver>(M, choice.X);
    case Selection::kLeastNorm:
      return MakeMinimizer(M, std::nullopt);
    case Selection::kMinimizer:
      return MakeMinimizer(M, choice.selector);
    case Selection::kSparsest:
      return std::make_unique<SparsestSolver>(M);
    case Selection::kHistory:
      return std::make_unique<HistorySolver>(M);
    case Selection::kAny:
      break;
  }
  return std::make_unique<ComplementarySolver>(M, Known::kNothing);
}

}  // namespace

double LcpResidual(const Matrix& M, const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& y) {
  Vector w = q;
  w.noalias() += M * y;
  double residual = 0;
  for (Index i = 0; i < y.size(); ++i) {
    if (!std::isfinite(y[i]) || !std::isfinite(w[i])) return std::numeric_limits<double>::quiet_NaN();
    residual = std::max(residual, std::abs(std::min(y[i], w[i])));
  }
  return residual;
}

std::unique_ptr<LcpSolver> MakeLcpSolver(const StructuredMatrix& M, const SolutionChoice& choice) {
  if (const SparseMatrix* const sparse = LargeSparse(M)) {
    if (auto solver = MakeSparseLcpSolver(*sparse, choice)) return solver;
  }
  if (std::optional<Tridiagonal> diagonals = DiagonalsForPolicyIteration(M, choice)) {
    const auto tridiagonal = std::make_shared<const Tridiagonal>(*std::move(diagonals));
    return std::make_unique<TridiagonalSolver>(
        tridiagonal, [tridiagonal, choice] { return MakeGeneralSolver(DenseOf(*tridiagonal), choice); });
  }
  return MakeGeneralSolver(M, choice);
}

std::unique_ptr<LcpSolver> MakeCoupledLcpSolver(const Matrix& M, const Matrix& K, const SolutionChoice& choice) {
  const Selection selection = choice.selection;
  if (selection == Selection::kLeastElement) return std::make_unique<CoupledLeastElementSolver>(M, K);
  const Matrix coupled = M + K;
  if (selection == Selection::kUnique || selection == Selection::kAny) {
    return MakeLcpSolver(coupled, TestPMatrix(coupled).yes() ? Selection::kUnique : Selection::kAny);
  }
  if (selection == Selection::kHistory) return std::make_unique<HistorySolver>(M, K);
  const bool convex = coupled.allFinite() && TestPositiveSemidefinite(coupled).yes();
  const Selection fallback = convex && selection == Selection::kLeastNorm ? Selection::kLeastNorm : Selection::kAny;
  return std::make_unique<CoupledSelectionSolver>(M, K, MakeLcpSolver(M, choice), MakeLcpSolver(coupled, fallback));
}

LcpResult SolveClassifiedLcp(const Matrix& M, const Vector& q, const MatrixClass& matrix_class,
                             const SolutionChoice& choice) {
  const std::unique_ptr<LcpSolver> solver = MakeLcpSolver(M, choice);
  LcpResult result;
  result.matrix_class = matrix_class.description;
  result.selection = choice.selection;
  Basis basis(M.rows(), 0);
  result.y = Vector::Zero(M.rows());
  // The solver allows for its own rounding; M and q are taken as they stand.
  result.verdict = solver->Solve(q, Vector::Zero(q.size()), basis, result.y);
  if (result.verdict == LcpStatus::kSolved) PolishSolution(M, q, result.y);
  result.w = q + M * result.y;
  result.residual = LcpResidual(M, q, result.y);
  const bool lost = result.verdict == LcpStatus::kSolved && IsLost(M, q, result);
  const bool overflows = lost && !Vector(q.cwiseAbs() + M.cwiseAbs() * result.y).allFinite();
  if (lost) {
    result.verdict = LcpStatus::kSingular;
    result.y.setZero();
    result.w = q;
    result.residual = LcpResidual(M, q, result.y);
  }
  const bool solved = result.verdict == LcpStatus::kSolved;
  const LcpStats account = solver->Account();
  result.pivots = account.pivots;
  result.method = account.method;
  result.message = solved ? "solved" : account.message;
  if (overflows) {
    result.message =
        "y, or the sum of the sizes of the terms of q + M y, is beyond the largest number, 1.8e308; choose other units";
  } else if (lost) {
    result.message = "the entries of M and q are too far apart in size: what was found is no solution";
  }
  if (solved) {
    result.sets = FindIndexSets(M, q, result.y);
    result.only_choice = solver->IsOnlyChoice();
  }
  return result;
}

absl::StatusOr<LcpResult> SolveLcp(const Matrix& M, const Vector& q, const LcpRequest& request,
                                   const std::stop_token& stop) {
  if (absl::Status status = Validate(M, q, request); !status.ok()) return status;
  const StopScope scope(stop);
  try {
    const MatrixClass matrix_class = Classify(M, request.rule);
    const absl::StatusOr<Selection> selection = SelectRule(request.rule, matrix_class);
    if (!selection.ok()) return selection.status();
    LcpResult result = SolveClassifiedLcp(M, q, matrix_class, {*selection, request.selector, matrix_class});
    if (request.all_basic_solutions) result.basic_solutions = AllBasicSolutions(M, q, stop);
    if (!stop.stop_requested()) return result;
  } catch (const Stopped&) {
  }
  return absl::CancelledError("stopped before the LCP was solved");
}

absl::StatusOr<LcpResult> SolveLcp(const Matrix& M, const Vector& q, SolutionRule rule) {
  return SolveLcp(M, q, LcpRequest{.rule = rule});
}

}  // namespace dlcs
