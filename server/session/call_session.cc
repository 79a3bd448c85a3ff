// SPDX-License-Identifier: Apache-2.0
#include "server/session/call_session.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/analyze.h"
#include "core/lcp/dynamic_lcp.h"
#include "core/lcp/lcp.h"
#include "core/problem/violation_list.h"
#include "fmt/format.h"
#include "proto/wire/matrix_shape.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

// The default step, as a fraction of the time of q.
constexpr double kDefaultDcpSteps = 1000;

absl::Status CheckPairs(const v1::Matrix& m, const SessionLimits& limits) {
  const WireShape shape = ShapeOf(m);
  return CheckLimit("max_constraints", static_cast<double>(std::max(shape.rows, shape.columns)),
                    limits.max_constraints);
}

absl::Status CheckDcpSize(const DcpProblem& problem, double max_step, const SessionLimits& limits) {
  const double steps = std::ceil(problem.q.times.back() / max_step) + static_cast<double>(problem.q.times.size());
  const double bytes = (steps + 1) * static_cast<double>(1 + problem.M.rows()) * sizeof(double);
  absl::Status limit = CheckLimit("max_steps", steps, limits.max_steps);
  limit.Update(CheckLimit("max_result_bytes", bytes, limits.max_result_bytes));
  limit.Update(CheckLimit("max_answer_bytes", bytes, limits.max_answer_bytes));
  return limit;
}

v1::SolveDcpResponse MakeResponse(const DcpCertificate& certificate, const Fact& unique) {
  v1::SolveDcpResponse response;
  *response.mutable_certificate() = ToProto(certificate);
  *response.mutable_unique() = ToProto(Finding{"dcp-unique", "one solution for every q with q(0) >= 0", unique, ""});
  return response;
}

// The path to be measured, v, is the field `check` of the request.
absl::Status OfPath(const absl::Status& status) {
  std::vector<Violation> violations = ViolationsOf(status);
  if (violations.empty()) return status;
  for (Violation& violation : violations) {
    if (violation.field == "v" || violation.field.starts_with("v.")) violation.field.replace(0, 1, "check");
  }
  return StatusOf(violations);
}

absl::StatusOr<v1::SolveDcpResponse> Measure(const DcpProblem& problem, const PiecewiseLinearPath& v) {
  const absl::StatusOr<DcpCertificate> certificate = CheckDcpSolution(problem, v);
  if (!certificate.ok()) return FromEngine(OfPath(certificate.status()), "");
  return MakeResponse(*certificate, TestDcpUniqueness(problem.M));
}

absl::StatusOr<v1::SolveDcpResponse> Step(const DcpProblem& problem, double max_step, const SessionLimits& limits,
                                          std::stop_token stop) {
  const double horizon = problem.q.times.empty() ? 0 : problem.q.times.back();
  const bool takes_time = std::isfinite(horizon) && horizon > 0;
  if (max_step == 0) max_step = takes_time ? horizon / kDefaultDcpSteps : 1;
  if (max_step > 0 && takes_time) {
    if (absl::Status limit = CheckDcpSize(problem, max_step, limits); !limit.ok()) return limit;
  }
  const absl::StatusOr<DcpSolution> solution = SolveDcp(problem, max_step, std::move(stop));
  if (!solution.ok()) return FromEngine(solution.status(), "");
  v1::SolveDcpResponse response = MakeResponse(solution->certificate, solution->unique);
  response.set_solved(solution->solved);
  response.set_message(solution->message);
  *response.mutable_v() = ToProto(solution->v);
  return response;
}

}  // namespace

absl::StatusOr<v1::SolveLcpResponse> RunLcp(const v1::SolveLcpRequest& request, const SessionLimits& limits,
                                            std::stop_token stop) {
  if (absl::Status limit = CheckPairs(request.m(), limits); !limit.ok()) return limit;
  std::vector<Violation> violations;
  const Matrix M = MatrixFromProto(request.m(), "M", violations);
  LcpRequest how;
  how.rule = RuleFromProto(request.rule(), violations);
  if (request.has_selector())
    how.selector = SelectorFromProto(request.selector(), ShapeOf(request.m()).rows, violations);
  how.all_basic_solutions = request.all_basic_solutions();
  if (!violations.empty()) return InvalidRequest(InRequest(violations, ""));
  const Vector q = Eigen::Map<const Vector>(request.q().data(), request.q_size());
  const absl::StatusOr<LcpResult> result = SolveLcp(M, q, how, stop);
  if (!result.ok()) return FromEngine(result.status(), "");
  return ToProto(*result);
}

absl::StatusOr<v1::SolveDcpResponse> RunDcp(const v1::SolveDcpRequest& request, const SessionLimits& limits,
                                            std::stop_token stop) {
  if (absl::Status limit = CheckPairs(request.m(), limits); !limit.ok()) return limit;
  std::vector<Violation> violations;
  DcpProblem problem;
  problem.M = MatrixFromProto(request.m(), "M", violations);
  if (!violations.empty()) return InvalidRequest(InRequest(violations, ""));
  problem.q = PathFromProto(request.q(), problem.M.rows(), "q", violations);
  PiecewiseLinearPath check;
  if (request.has_check()) check = PathFromProto(request.check(), problem.M.rows(), "check", violations);
  if (!violations.empty()) return InvalidRequest(InRequest(violations, ""));
  if (request.has_check()) return Measure(problem, check);
  return Step(problem, request.max_step(), limits, std::move(stop));
}

absl::StatusOr<v1::AnalyzeProblemResponse> RunAnalysis(const v1::AnalyzeProblemRequest& request,
                                                       const SessionLimits& limits, std::stop_token stop,
                                                       const ProblemResolver& find) {
  if (NamesProblem(request)) {
    const absl::StatusOr<v1::AnalyzeProblemRequest> whole = ResolveProblem(request, find);
    return whole.ok() ? RunAnalysis(*whole, limits, std::move(stop)) : whole.status();
  }
  if (!request.has_problem()) {
    return InvalidRequest({{"problem", "is not set; one of problem and problem_name must be"}});
  }
  if (absl::Status ranks = CheckRanks(request.options(), 0); !ranks.ok()) return ranks;
  const absl::StatusOr<ValidSystem> read = ParseAndValidate(request.problem(), request.options(), limits);
  if (!read.ok()) return read.status();
  absl::StatusOr<Analysis> analysis = AnalyzeValidated(std::get<Problem>(read->system), read->options, std::move(stop));
  if (!analysis.ok()) return FromEngine(analysis.status(), "problem");
  // The memory limit of this server is not part of the recommended options.
  const double asked = request.options().max_memory_bytes();
  analysis->recommendation.options.max_memory = asked > 0 ? asked : Options().max_memory;
  return ToProto(*analysis);
}

}  // namespace dlcs
