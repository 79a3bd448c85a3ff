// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/lcp.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/analysis/m_matrix.h"
#include "core/analysis/p_matrix.h"
#include "core/analysis/positive_semidefinite.h"
#include "core/lcp/chandrasekaran.h"
#include "core/lcp/complementary_solver.h"
#include "core/lcp/coupled_least_element.h"
#include "core/lcp/coupled_selection.h"
#include "core/lcp/least_norm.h"
#include "core/lcp/minimiser.h"

namespace dlcs {
namespace {

using Known = ComplementarySolver::Known;

// Where a problem has no solution as it stands, violations of this size, relative to the largest entry of q
// or 1, are taken for rounding: a right-hand side that should be zero came out of somebody's arithmetic as
// -1e-17.
constexpr double kNoise = 1e-15;

void CheckSelector(const LcpRequest& request, Index n, std::vector<std::string>& broken) {
  const bool needed = request.rule == SolutionRule::kMinimiser;
  if (needed != request.selector.has_value()) {
    broken.push_back("selector: the rule minimiser, and only that, takes one");
  }
  if (!request.selector) return;
  const auto& [C, b] = *request.selector;
  if (C.rows() < 1 || C.cols() != n || b.size() != C.rows() || !C.allFinite() || !b.allFinite()) {
    broken.push_back(absl::StrCat("selector: C must be k × n with n = ", n, ", b have k entries, all finite"));
  }
}

absl::Status Validate(const Matrix& M, const Vector& q, const LcpRequest& request) {
  std::vector<std::string> broken;
  if (M.rows() < 1 || M.rows() != M.cols()) {
    broken.push_back(absl::StrCat("M: is ", M.rows(), " × ", M.cols(), ", must be square with at least one row"));
  }
  for (Index i = 0; i < M.rows(); ++i) {
    for (Index j = 0; j < M.cols(); ++j) {
      if (!std::isfinite(M(i, j))) broken.push_back(absl::StrCat("M[", i, "][", j, "]: is ", M(i, j), ", must be finite"));
    }
  }
  if (q.size() != M.rows()) {
    broken.push_back(absl::StrCat("q: has ", q.size(), " entries, must have one per row of M: ", M.rows()));
  }
  for (Index i = 0; i < q.size(); ++i) {
    if (!std::isfinite(q[i])) broken.push_back(absl::StrCat("q[", i, "]: is ", q[i], ", must be finite"));
  }
  CheckSelector(request, M.rows(), broken);
  if (request.all_basic_solutions && M.rows() > kMaxBasicSolutionsSize) {
    broken.push_back(absl::StrCat("all_basic_solutions: n = ", M.rows(), ", must be at most ", kMaxBasicSolutionsSize));
  }
  if (broken.empty()) return absl::OkStatus();
  constexpr std::size_t kMostListed = 200;
  broken.resize(std::min(broken.size(), kMostListed));
  return absl::InvalidArgumentError(absl::StrJoin(broken, "\n"));
}

// The minimiser of the selector, or the least norm where there is none.
std::unique_ptr<LcpSolver> MakeMinimiser(const Matrix& M, const std::optional<Selector>& selector) {
  if (selector) return std::make_unique<MinimiserSolver>(M, *selector);
  if (TestPositiveSemidefinite(M).yes()) return std::make_unique<LeastNormSolver>(M);
  const Index n = M.rows();
  return std::make_unique<MinimiserSolver>(M, Selector{Matrix::Identity(n, n), Vector::Zero(n)});
}

}  // namespace

const char* LcpVerdictName(LcpVerdict verdict) {
  switch (verdict) {
    case LcpVerdict::kSolved:
      return "SOLVED";
    case LcpVerdict::kInfeasible:
      return "INFEASIBLE";
    case LcpVerdict::kRay:
      return "RAY";
    case LcpVerdict::kPivotLimit:
      return "PIVOT_LIMIT";
    case LcpVerdict::kSingular:
      return "SINGULAR";
    case LcpVerdict::kNonFinite:
      return "NON_FINITE";
  }
  return "UNKNOWN";
}

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

std::unique_ptr<LcpSolver> MakeLcpSolver(const Matrix& M, Selection selection,
                                         const std::optional<Selector>& selector) {
  switch (selection) {
    case Selection::kUnique:
      return std::make_unique<ComplementarySolver>(M, IsZMatrix(M) ? Known::kMMatrix : Known::kPMatrix);
    case Selection::kLeastElement:
      return std::make_unique<LeastElementSolver>(M);
    case Selection::kHiddenLeastElement:
      break;
    case Selection::kLeastNorm:
      return MakeMinimiser(M, std::nullopt);
    case Selection::kMinimiser:
      return MakeMinimiser(M, selector);
    case Selection::kAny:
      break;
  }
  return std::make_unique<ComplementarySolver>(M, Known::kNothing);
}

std::unique_ptr<LcpSolver> MakeCoupledLcpSolver(const Matrix& M, const Matrix& K, Selection selection,
                                                const std::optional<Selector>& selector) {
  if (selection == Selection::kLeastElement) return std::make_unique<CoupledLeastElementSolver>(M, K);
  const Matrix coupled = M + K;
  if (selection == Selection::kUnique || selection == Selection::kAny) {
    return MakeLcpSolver(coupled, TestPMatrix(coupled).yes() ? Selection::kUnique : Selection::kAny);
  }
  const bool convex = coupled.allFinite() && TestPositiveSemidefinite(coupled).yes();
  const Selection fallback = convex && selection == Selection::kLeastNorm ? Selection::kLeastNorm : Selection::kAny;
  return std::make_unique<CoupledSelectionSolver>(M, K, MakeLcpSolver(M, selection, selector),
                                                  MakeLcpSolver(coupled, fallback));
}

absl::StatusOr<LcpResult> SolveLcp(const Matrix& M, const Vector& q, const LcpRequest& request,
                                   const std::stop_token& stop) {
  if (absl::Status status = Validate(M, q, request); !status.ok()) return status;
  const MatrixClass matrix_class = Classify(M, request.rule);
  const absl::StatusOr<Selection> selection = SelectRule(request.rule, matrix_class);
  if (!selection.ok()) return selection.status();
  if (stop.stop_requested()) return absl::CancelledError("stopped after the classification of M");
  const std::unique_ptr<LcpSolver> solver = MakeLcpSolver(M, *selection, request.selector);
  LcpResult result;
  result.matrix_class = matrix_class.description;
  result.selection = *selection;
  Basis basis(M.rows(), 0);
  result.y = Vector::Zero(M.rows());
  // The solver allows for its own rounding. The caller's is assumed only where there is no solution without.
  result.verdict = solver->Solve(q, Vector::Zero(q.size()), basis, result.y);
  const double noise = kNoise * std::max(1.0, q.lpNorm<Eigen::Infinity>());
  const bool has_noise = (q.array() != 0 && q.array().abs() <= noise).any();
  if (result.verdict != LcpVerdict::kSolved && has_noise) {
    result.verdict = solver->Solve(q, Vector::Constant(q.size(), noise), basis, result.y);
  }
  const bool solved = result.verdict == LcpVerdict::kSolved;
  result.w = q + M * result.y;
  result.residual = LcpResidual(M, q, result.y);
  const LcpAccount account = solver->Account();
  result.pivots = account.pivots;
  result.method = account.method;
  result.message = absl::StrCat(solved ? "solved" : account.message, "; M: ", matrix_class.description);
  if (solved) {
    result.sets = FindIndexSets(M, q, result.y);
    result.only_choice = solver->IsOnlyChoice();
  }
  if (request.all_basic_solutions) result.basic_solutions = AllBasicSolutions(M, q, stop);
  if (stop.stop_requested()) return absl::CancelledError("stopped before all basic solutions were found");
  return result;
}

absl::StatusOr<LcpResult> SolveLcp(const Matrix& M, const Vector& q, SolutionRule rule) {
  return SolveLcp(M, q, LcpRequest{.rule = rule});
}

}  // namespace dlcs
