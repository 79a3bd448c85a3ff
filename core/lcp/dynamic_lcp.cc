// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dynamic_lcp.h"

#include <algorithm>
#include <cmath>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/format_number.h"
#include "core/lcp/basis/tolerance.h"
#include "core/lcp/lcp.h"
#include "core/linalg/norms.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/matrix_classes/p_matrix.h"
#include "core/problem/violation_list.h"

namespace dlcs {
namespace {

absl::Status CheckPath(const PiecewiseLinearPath& path, Index size, const char* name) {
  const std::vector<double>& times = path.times;
  if (times.empty()) return InvalidField(absl::StrCat(name, ".times"), "none; must start at 0");
  if (times.front() != 0) {
    return InvalidField(absl::StrCat(name, ".times[0]"), absl::StrCat(NumberText(times.front()), "; must be 0"));
  }
  if (path.values.rows() != size || path.values.cols() != static_cast<Index>(times.size())) {
    return InvalidField(absl::StrCat(name, ".values"),
                        absl::StrCat(path.values.rows(), " values at ", path.values.cols(),
                                     " times; must be n = ", size, " (from M) at ", times.size(), " times"));
  }
  if (!path.values.allFinite()) return InvalidField(absl::StrCat(name, ".values"), "must be finite");
  for (std::size_t k = 1; k < times.size(); ++k) {
    const bool thrice = k > 1 && times[k] == times[k - 2];
    if (!std::isfinite(times[k]) || times[k] < times[k - 1] || thrice) {
      return InvalidField(absl::StrCat(name, ".times[", k, "]"),
                          absl::StrCat(times[k], "; times must be finite and increasing, at most two the same"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckProblem(const DcpProblem& problem) {
  const Index size = problem.M.rows();
  if (size == 0 || problem.M.cols() != size || !problem.M.allFinite()) {
    return InvalidField("M", "must be square, not empty and finite");
  }
  return CheckPath(problem.q, size, "q");
}

// The limit of `path` at `t` from the left or the right; `t` within its times.
Vector ValueAt(const PiecewiseLinearPath& path, double t, bool from_right) {
  const auto& times = path.times;
  const auto after =
      from_right ? std::upper_bound(times.begin(), times.end(), t) : std::lower_bound(times.begin(), times.end(), t);
  const Index k = after - times.begin();
  if (k == 0) return path.values.col(0);
  if (after == times.end()) return path.values.col(k - 1);
  const double part = (t - times[k - 1]) / (times[k] - times[k - 1]);
  return (1 - part) * path.values.col(k - 1) + part * path.values.col(k);
}

bool JumpsAt(const PiecewiseLinearPath& path, double t) {
  return std::upper_bound(path.times.begin(), path.times.end(), t) -
             std::lower_bound(path.times.begin(), path.times.end(), t) >
         1;
}

// Times of both, each once.
std::vector<double> AllTimes(const PiecewiseLinearPath& a, const PiecewiseLinearPath& b) {
  std::vector<double> times = a.times;
  times.insert(times.end(), b.times.begin(), b.times.end());
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

// The nodes of q, jumps twice, with steps of at most `max_step` between.
std::vector<double> StepTimes(const std::vector<double>& nodes, double max_step) {
  std::vector<double> times = {nodes.front()};
  for (std::size_t k = 1; k < nodes.size(); ++k) {
    const double length = nodes[k] - nodes[k - 1];
    const double count = std::max(1.0, std::ceil(length / max_step * (1 - kLcpTolerance)));
    for (double j = 1; j < count; ++j) times.push_back(nodes[k - 1] + length * (j / count));
    times.push_back(nodes[k]);
  }
  return times;
}

// M with the signs of an M-matrix: M is an H-matrix with positive diagonal when this is one.
Matrix ComparisonMatrix(const Matrix& M) {
  Matrix comparison = -M.cwiseAbs();
  comparison.diagonal() = M.diagonal();
  return comparison;
}

}  // namespace

absl::StatusOr<DcpCertificate> CheckDcpSolution(const DcpProblem& problem, const PiecewiseLinearPath& v) {
  if (absl::Status status = CheckProblem(problem); !status.ok()) return status;
  if (absl::Status status = CheckPath(v, problem.M.rows(), "v"); !status.ok()) return status;
  if (v.times.back() != problem.q.times.back()) {
    return InvalidField("v", absl::StrCat("ends at ", v.times.back(), " and q at ", problem.q.times.back(),
                                          "; they must end together"));
  }
  Vector v_before = v.values.col(0);
  Vector w_before = problem.q.values.col(0) + problem.M * v_before;
  Vector integral = Vector::Zero(problem.M.rows());
  DcpCertificate certificate{MaxAbs(v_before), std::numeric_limits<double>::infinity(), w_before.minCoeff(), 0};
  const auto move = [&](const Vector& v_after, const Vector& q_after, bool jump) {
    const Vector w_after = q_after + problem.M * v_after;
    const Vector increase = v_after - v_before;
    integral += increase.cwiseProduct(jump ? w_after : Vector(0.5 * (w_before + w_after)));
    certificate.least_increase = std::min(certificate.least_increase, increase.minCoeff());
    certificate.least_w = std::min(certificate.least_w, w_after.minCoeff());
    v_before = v_after;
    w_before = w_after;
  };
  for (const double t : AllTimes(problem.q, v)) {
    if (t > 0) move(ValueAt(v, t, false), ValueAt(problem.q, t, false), false);
    if (JumpsAt(problem.q, t) || JumpsAt(v, t)) move(ValueAt(v, t, true), ValueAt(problem.q, t, true), true);
  }
  certificate.complementarity = MaxAbs(integral);
  return certificate;
}

absl::StatusOr<DcpSolution> SolveDcp(const DcpProblem& problem, double max_step, std::stop_token stop) {
  if (absl::Status status = CheckProblem(problem); !status.ok()) return status;
  if (!(max_step > 0)) return InvalidField("max_step", absl::StrCat(max_step, "; must be positive"));
  if (Index i = 0; problem.q.values.col(0).minCoeff(&i) < 0) {
    return InvalidField(absl::StrCat("q.values[0][", i, "]"),
                        absl::StrCat(NumberText(problem.q.values(i, 0)), "; q(0) must be >= 0, for v(0) = 0"));
  }
  const Index size = problem.M.rows();
  const auto selection = SelectRule(SolutionRule::kAuto, Classify(problem.M));
  if (!selection.ok()) return selection.status();
  const auto solver = MakeLcpSolver(problem.M, *selection);

  DcpSolution solution;
  solution.unique = TestDcpUniqueness(problem.M);
  solution.v.times = StepTimes(problem.q.times, max_step);
  const std::vector<double>& times = solution.v.times;
  solution.v.values = Matrix::Zero(size, static_cast<Index>(times.size()));
  Vector v = Vector::Zero(size), z(size);
  Basis basis(static_cast<std::size_t>(size), 0);
  for (std::size_t j = 1; j < times.size(); ++j) {
    if (stop.stop_requested()) return absl::CancelledError("stopped on request");
    const Vector q = ValueAt(problem.q, times[j], times[j] == times[j - 1]);
    const double sizes = MaxAbs(q) + InfinityNorm(problem.M) * MaxAbs(v);
    const LcpStatus verdict = solver->Solve(q + problem.M * v, Vector::Constant(size, 1e-15 * sizes), basis, z);
    if (verdict != LcpStatus::kSolved) {
      solution.v.times.resize(j);
      solution.v.values.conservativeResize(size, static_cast<Index>(j));
      solution.message = absl::StrCat("The LCP of the increment to t = ", times[j], " is ", LcpStatusName(verdict),
                                      "; M must be strictly semicopositive for every q to have a solution.");
      return solution;
    }
    v += z;
    solution.v.values.col(static_cast<Index>(j)) = v;
  }
  auto certificate = CheckDcpSolution(problem, solution.v);
  if (!certificate.ok()) return certificate.status();
  solution.certificate = *certificate;
  solution.solved = true;
  solution.message = "v is nondecreasing and complementary at the nodes.";
  return solution;
}

Fact TestDcpUniqueness(const Matrix& M) {
  Fact p = TestPMatrix(M);
  if (p.no()) {
    p.why = absl::StrCat("not a P-matrix: ", p.why);
    return p;
  }
  if (!p.yes()) return {Answer::kUnknown, absl::StrCat("M is not known to be a P-matrix: ", p.why)};
  if (M == M.transpose()) return {Answer::kYes, "symmetric positive definite"};  // a symmetric P-matrix is
  if (TestPMatrix(ComparisonMatrix(M)).yes()) return {Answer::kYes, "an H-matrix with positive diagonal"};
  return {Answer::kUnknown, "a P-matrix, which is necessary but not enough"};
}

}  // namespace dlcs
