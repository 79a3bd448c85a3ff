// SPDX-License-Identifier: Apache-2.0
#include "server/session/problem_reference.h"

#include <utility>
#include <vector>

#include "fmt/format.h"
#include "server/wire/component_names.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

constexpr const char* kField = "problem_name";

absl::StatusOr<v1::ProblemBody> Find(const std::string& name, const ProblemResolver& find) {
  if (find) return find(name);
  return InvalidRequest(
      {{kField, fmt::format("\"{}\": nothing can be uploaded here; send the problem itself, or use a server with "
                            "uploads (dlcsd --store)",
                            name)}});
}

// Replaces the fields of the problem that a member sets.
absl::Status Change(const v1::EnsembleMember& overrides, v1::Problem& problem) {
  if (overrides.x0_size() > 0) *problem.mutable_x0() = overrides.x0();
  if (overrides.has_f()) *problem.mutable_f() = overrides.f();
  if (overrides.has_g()) *problem.mutable_g() = overrides.g();
  if (overrides.has_horizon()) problem.set_horizon(overrides.horizon());
  if (overrides.has_break_points()) *problem.mutable_break_points() = overrides.break_points().times();
  if (overrides.parameters().empty()) return absl::OkStatus();
  std::vector<Violation> violations;
  FormulaParameters parameters = ParametersFromProto(problem.parameters(), "parameters", violations);
  ChangeParameters(overrides.parameters(), "overrides.parameters", parameters, violations);
  if (!violations.empty()) return InvalidRequest(violations);
  for (v1::Parameter& parameter : *problem.mutable_parameters()) parameter.set_value(parameters.at(parameter.name()));
  return absl::OkStatus();
}

// For requests with a field for a linear problem and one for a name.
template <typename Request>
absl::StatusOr<Request> WithLinearProblem(const Request& request, const ProblemResolver& find) {
  if (request.has_problem())
    return InvalidRequest({{kField, "the request also holds a problem; give only one of the two"}});
  absl::StatusOr<v1::ProblemBody> body = Find(request.problem_name(), find);
  if (!body.ok()) return body.status();
  if (!body->has_problem()) {
    return InvalidRequest(
        {{kField, fmt::format("{} is nonlinear, but this call accepts only linear problems", request.problem_name())}});
  }
  Request whole = request;
  whole.clear_problem_name();
  whole.mutable_problem()->Swap(body->mutable_problem());
  return whole;
}

}  // namespace

bool NamesProblem(const v1::SolveRequest& request) { return request.has_problem_name(); }
bool NamesProblem(const v1::SolveEnsembleRequest& request) { return !request.problem_name().empty(); }
bool NamesProblem(const v1::AnalyzeProblemRequest& request) { return !request.problem_name().empty(); }

absl::StatusOr<v1::SolveRequest> ResolveProblem(const v1::SolveRequest& request, const ProblemResolver& find) {
  absl::StatusOr<v1::ProblemBody> body = Find(request.problem_name(), find);
  if (!body.ok()) return body.status();
  if (request.has_overrides() && !body->has_problem()) {
    return InvalidRequest(
        {{"overrides", fmt::format("{} is nonlinear; only linear problems have overrides", request.problem_name())}});
  }
  v1::SolveRequest whole = request;
  whole.clear_overrides();
  if (body->has_nonlinear()) {
    whole.mutable_nonlinear()->Swap(body->mutable_nonlinear());
  } else {
    whole.mutable_problem()->Swap(body->mutable_problem());
    if (absl::Status changed = Change(request.overrides(), *whole.mutable_problem()); !changed.ok()) return changed;
  }
  return whole;
}

absl::StatusOr<v1::SolveEnsembleRequest> ResolveProblem(const v1::SolveEnsembleRequest& request,
                                                        const ProblemResolver& find) {
  return WithLinearProblem(request, find);
}

absl::StatusOr<v1::AnalyzeProblemRequest> ResolveProblem(const v1::AnalyzeProblemRequest& request,
                                                         const ProblemResolver& find) {
  return WithLinearProblem(request, find);
}

}  // namespace dlcs
