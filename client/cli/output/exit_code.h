// SPDX-License-Identifier: Apache-2.0
// The exit codes of `dlcs`.

#ifndef DLCS_CLIENT_CLI_OUTPUT_EXIT_CODE_H_
#define DLCS_CLIENT_CLI_OUTPUT_EXIT_CODE_H_

#include "absl/status/status.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

enum ExitCode : int {
  kSolved = 0,  // T was reached, and there is no sign that the solution is wrong (Verdict.success)
  // There is no solution, the method did not find it, or its estimated error is above 30 %.
  kNoAnswer = 1,
  kBadInput = 2,       // a file, an option or the problem breaks a rule
  kServiceFailed = 3,  // the service failed, or the solve was cancelled on the server or timed out
  kInterrupted = 130,  // 128 + SIGINT, as in shells: Ctrl-C
  kTerminated = 143,   // 128 + SIGTERM
};

// Whether the solve was stopped before its end, so that the trajectory is incomplete.
inline bool IsStopped(v1::Termination termination) {
  return termination == v1::TERMINATION_CANCELLED || termination == v1::TERMINATION_DEADLINE;
}

inline ExitCode ExitCodeOf(const v1::Summary& summary) {
  if (summary.verdict().success()) return kSolved;
  const v1::Termination termination = summary.termination();
  return IsStopped(termination) || termination == v1::TERMINATION_UNSPECIFIED ? kServiceFailed : kNoAnswer;
}

// The exit code for a failed call.
inline ExitCode ExitCodeOf(const absl::Status& status) {
  return absl::IsInvalidArgument(status) ? kBadInput : kServiceFailed;
}

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_EXIT_CODE_H_
