// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/lcp.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/analysis/m_matrix.h"
#include "core/analysis/p_matrix.h"
#include "core/lcp/chandrasekaran.h"
#include "core/lcp/complementary_solver.h"
#include "core/lcp/coupled_least_element.h"

namespace dlcs {
namespace {

using Known = ComplementarySolver::Known;

// Where a problem has no solution as it stands, violations of this size, relative to the largest entry of q
// or 1, are taken for rounding: a right-hand side that should be zero came out of somebody's arithmetic as
// -1e-17.
constexpr double kNoise = 1e-15;

absl::Status Validate(const Matrix& M, const Vector& q) {
  if (M.rows() < 1 || M.rows() != M.cols()) {
    return absl::InvalidArgumentError(
        absl::StrCat("M: is ", M.rows(), " × ", M.cols(), ", must be square with at least one row"));
  }
  if (q.size() != M.rows()) {
    return absl::InvalidArgumentError(
        absl::StrCat("q: has ", q.size(), " entries, must have one per row of M: ", M.rows()));
  }
  for (Index i = 0; i < M.rows(); ++i) {
    for (Index j = 0; j < M.cols(); ++j) {
      if (!std::isfinite(M(i, j))) {
        return absl::InvalidArgumentError(
            absl::StrCat("M[", i, "][", j, "]: is ", M(i, j), ", must be finite"));
      }
    }
    if (!std::isfinite(q[i])) {
      return absl::InvalidArgumentError(absl::StrCat("q[", i, "]: is ", q[i], ", must be finite"));
    }
  }
  return absl::OkStatus();
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

std::unique_ptr<LcpSolver> MakeLcpSolver(const Matrix& M, Selection selection) {
  switch (selection) {
    case Selection::kUnique:
      return std::make_unique<ComplementarySolver>(M, IsZMatrix(M) ? Known::kMMatrix : Known::kPMatrix);
    case Selection::kLeastElement:
      return std::make_unique<LeastElementSolver>(M);
    case Selection::kHiddenLeastElement:
    case Selection::kLeastNorm:
    case Selection::kMinimiser:
    case Selection::kAny:
      break;
  }
  return std::make_unique<ComplementarySolver>(M, Known::kNothing);
}

std::unique_ptr<LcpSolver> MakeCoupledLcpSolver(const Matrix& M, const Matrix& K, Selection selection) {
  if (selection == Selection::kLeastElement) return std::make_unique<CoupledLeastElementSolver>(M, K);
  const Matrix coupled = M + K;
  return MakeLcpSolver(coupled, TestPMatrix(coupled).yes() ? Selection::kUnique : Selection::kAny);
}

absl::StatusOr<LcpResult> SolveLcp(const Matrix& M, const Vector& q, SolutionRule rule) {
  if (absl::Status status = Validate(M, q); !status.ok()) return status;
  const MatrixClass matrix_class = Classify(M);
  const absl::StatusOr<Selection> selection = SelectRule(rule, matrix_class);
  if (!selection.ok()) return selection.status();
  const std::unique_ptr<LcpSolver> solver = MakeLcpSolver(M, *selection);
  LcpResult result;
  Basis basis(M.rows(), 0);
  result.y = Vector::Zero(M.rows());
  // The solver allows for its own rounding. The caller's is assumed only where there is no solution without.
  result.verdict = solver->Solve(q, Vector::Zero(q.size()), basis, result.y);
  const double noise = kNoise * std::max(1.0, q.lpNorm<Eigen::Infinity>());
  const bool has_noise = (q.array() != 0 && q.array().abs() <= noise).any();
  if (result.verdict != LcpVerdict::kSolved && has_noise) {
    result.verdict = solver->Solve(q, Vector::Constant(q.size(), noise), basis, result.y);
  }
  result.w = q + M * result.y;
  result.residual = LcpResidual(M, q, result.y);
  LcpAccount account = solver->Account();
  result.pivots = account.pivots;
  result.method = account.method;
  result.message = result.verdict == LcpVerdict::kSolved
                       ? absl::StrCat("solved; M: ", matrix_class.description)
                       : absl::StrCat(account.message, "; M: ", matrix_class.description);
  return result;
}

}  // namespace dlcs
