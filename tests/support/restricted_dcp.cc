// SPDX-License-Identifier: Apache-2.0
#include "tests/support/restricted_dcp.h"

#include <cmath>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/lcp/lcp.h"
#include "core/linalg/norms.h"
#include "core/linalg/phi_functions.h"
#include "core/matrix_classes/matrix_class.h"

namespace dlcs {
namespace {

absl::Status Check(const IndexOneSystem& system, const Vector& x0, double t_hat, Index steps) {
  const Index m = system.A.rows(), n = system.B.cols();
  if (m == 0 || n == 0 || system.A.cols() != m || system.B.rows() != m || system.C.rows() != n ||
      system.C.cols() != m || x0.size() != m) {
    return absl::InvalidArgumentError("A must be m × m, B m × n, C n × m and x0 have m entries, m, n > 0");
  }
  if (!system.A.allFinite() || !system.B.allFinite() || !system.C.allFinite() || !x0.allFinite()) {
    return absl::InvalidArgumentError("A, B, C and x0 must be finite");
  }
  if (!(t_hat > 0) || !std::isfinite(t_hat)) {
    return absl::InvalidArgumentError(absl::StrCat("t_hat = ", t_hat, " must be positive and finite"));
  }
  if (steps < 1) return absl::InvalidArgumentError(absl::StrCat("steps = ", steps, " must be at least 1"));
  if ((system.C * x0).minCoeff() < 0) return absl::InvalidArgumentError("C x0 must be >= 0");
  return absl::OkStatus();
}

// What (12) is made of on a uniform grid: column j of `q` is C e^{A t_j} x0; F_k as in the header. Unfinished where
// `stop` was requested.
struct Memory {
  Matrix CB;
  Matrix q;
  std::vector<Matrix> F;
};

Memory MakeMemory(const IndexOneSystem& system, const Vector& x0, double h, Index steps, const std::stop_token& stop) {
  const PhiFunctions phi = ComputePhiFunctions(h * system.A);
  Memory memory{.CB = system.C * system.B, .q = Matrix(system.C.rows(), steps + 1), .F = {}};
  memory.F.reserve(steps);
  Matrix response = phi.phi1 * system.B;  // e^{khA} φ_1 B
  Vector x = x0;
  memory.q.col(0) = system.C * x;
  for (Index k = 0; k < steps && !stop.stop_requested(); ++k) {
    memory.F.push_back(system.C * response - memory.CB);
    response = (phi.phi0 * response).eval();
    x = (phi.phi0 * x).eval();
    memory.q.col(k + 1) = system.C * x;
  }
  return memory;
}

}  // namespace

absl::StatusOr<RestrictedDcpSolution> SolveRestrictedDcp(const IndexOneSystem& system, const Vector& x0, double t_hat,
                                                         Index steps, std::stop_token stop) {
  if (absl::Status status = Check(system, x0, t_hat, steps); !status.ok()) return status;
  const double h = t_hat / static_cast<double>(steps);
  const Memory memory = MakeMemory(system, x0, h, steps, stop);
  if (stop.stop_requested()) return absl::CancelledError("stopped on request");
  const Index n = memory.CB.rows();
  const Matrix implicit = memory.CB + memory.F.front();
  const auto selection = SelectRule(SolutionRule::kAuto, Classify(implicit));
  if (!selection.ok()) return selection.status();
  const auto solver = MakeLcpSolver(implicit, *selection);

  RestrictedDcpSolution solution{.message = {}, .v = {{0}, Matrix::Zero(n, steps + 1)}, .dcp = {}, .certificate = {}};
  Matrix& v = solution.v.values;
  Matrix increments = Matrix::Zero(n, steps + 1);  // column j is z_j
  Matrix path = memory.q;                          // q + Φ
  Basis basis(n, 0);
  Vector z(n);
  for (Index j = 1; j <= steps; ++j) {
    if (stop.stop_requested()) return absl::CancelledError("stopped on request");
    for (Index l = 1; l < j; ++l) path.col(j).noalias() += memory.F[j - l] * increments.col(l);
    const Vector q = path.col(j) + memory.CB * v.col(j - 1);
    const double sizes = MaxAbs(path.col(j)) + InfinityNorm(memory.CB) * MaxAbs(v.col(j - 1));
    const LcpStatus verdict = solver->Solve(q, Vector::Constant(n, 1e-15 * sizes), basis, z);
    if (verdict != LcpStatus::kSolved) {
      solution.message =
          absl::StrCat("The LCP of the increment to t = ", h * static_cast<double>(j), " is ", LcpStatusName(verdict),
                       "; CB must be strictly semicopositive and the step short (Theorem 7).");
      v.conservativeResize(n, j);
      return solution;
    }
    increments.col(j) = z;
    v.col(j) = v.col(j - 1) + z;
    path.col(j).noalias() += memory.F.front() * z;
    solution.v.times.push_back(j == steps ? t_hat : h * static_cast<double>(j));
  }
  solution.dcp = {memory.CB, {solution.v.times, std::move(path)}};
  auto certificate = CheckDcpSolution(solution.dcp, solution.v);
  if (!certificate.ok()) return certificate.status();
  solution.certificate = *certificate;
  solution.solved = true;
  solution.message = "v is nondecreasing and complementary at the nodes.";
  return solution;
}

}  // namespace dlcs
