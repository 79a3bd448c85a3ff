// SPDX-License-Identifier: Apache-2.0
// Problem files, linear and nonlinear, as `dlcs solve` reads and validates them.
#include "client/files/problem_file.h"
#include "server/session/solve_session.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/small_limits.h"

namespace dlcs::fuzz {

void TryProblemFile(const std::string& input) {
  const absl::StatusOr<client::ProblemFile> file = client::ParseProblem(input, "input");
  if (!file.ok()) return Require(!file.status().message().empty(), "a refusal says why");

  v1::SolveRequest request;
  if (file->nonlinear) {
    *request.mutable_nonlinear() = *file->nonlinear;
    return (void)PrepareSolve(request, SmallLimits());
  }
  *request.mutable_problem() = file->problem;
  if (!PrepareSolve(request, SmallLimits()).ok()) return;
  const auto again = client::ParseProblem(client::ProblemJson(file->problem).dump(), "written");
  Require(again.ok(), "a sound problem is written as a file that is read");
  v1::SolveRequest second;
  *second.mutable_problem() = again->problem;
  Require(PrepareSolve(second, SmallLimits()).ok(), "a sound problem is written as a sound one");
}

}  // namespace dlcs::fuzz
