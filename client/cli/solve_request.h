// SPDX-License-Identifier: Apache-2.0
// The request that a problem file and the command line make together.

#ifndef DLCS_CLIENT_CLI_SOLVE_REQUEST_H_
#define DLCS_CLIENT_CLI_SOLVE_REQUEST_H_

#include "absl/status/statusor.h"
#include "client/cli/commands.h"
#include "client/problem_file.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Errors: InvalidArgument for a --rule with a nonlinear problem.
absl::StatusOr<v1::SolveRequest> MakeSolveRequest(const SolveCommand& command, const ProblemFile& file);

double HorizonOf(const v1::SolveRequest& request);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_SOLVE_REQUEST_H_
