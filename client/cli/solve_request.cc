// SPDX-License-Identifier: Apache-2.0
#include "client/cli/solve_request.h"

namespace dlcs::client {

absl::StatusOr<v1::SolveRequest> MakeSolveRequest(const SolveCommand& command, const ProblemFile& file) {
  v1::SolveRequest request;
  if (file.nonlinear && command.rule) {
    return absl::InvalidArgumentError("--rule: a nonlinear problem takes the rule that its g implies");
  }
  if (file.nonlinear) {
    *request.mutable_nonlinear() = *file.nonlinear;
  } else {
    *request.mutable_problem() = file.problem;
    if (command.rule) request.mutable_problem()->set_rule(*command.rule);
  }
  *request.mutable_options() = command.options;
  return request;
}

double HorizonOf(const v1::SolveRequest& request) {
  return request.has_nonlinear() ? request.nonlinear().horizon() : request.problem().horizon();
}

}  // namespace dlcs::client
