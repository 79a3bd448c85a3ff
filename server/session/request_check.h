// SPDX-License-Identifier: Apache-2.0
// The checks of every call before the engine starts: conversion, validation and limits.

#ifndef DLCS_SERVER_SESSION_REQUEST_CHECK_H_
#define DLCS_SERVER_SESSION_REQUEST_CHECK_H_

#include <cstdint>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/ensemble.h"
#include "core/problem/nonlinear_problem.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "dlcs/v1/solver.pb.h"
#include "server/wire/component_names.h"

namespace dlcs {

// The limits of a session. The defaults limit nothing.
struct SessionLimits {
  std::int64_t max_states = std::numeric_limits<std::int64_t>::max();
  // For systems with dense A, whose time grows like states².
  std::int64_t max_dense_states = std::numeric_limits<std::int64_t>::max();
  std::int64_t max_constraints = std::numeric_limits<std::int64_t>::max();
  std::int64_t max_steps = std::numeric_limits<std::int64_t>::max();
  // Bytes of the trajectory, (1 + m + 2n + outputs) doubles a time: at the output times if there are any, else at all
  // nodes; for a nonlinear problem always at all nodes, since the engine holds them during the solve.
  std::int64_t max_result_bytes = std::numeric_limits<std::int64_t>::max();
  // Bytes of a response that is not streamed.
  std::int64_t max_answer_bytes = std::numeric_limits<std::int64_t>::max();
  // Bytes that a solve may allocate, as predicted by the engine; 0: only the limit in the options.
  double max_memory_bytes = 0;
  int max_threads = 0;                                                  // 0: all of the machine
  std::int64_t max_members = std::numeric_limits<std::int64_t>::max();  // of one ensemble
  int max_ranks = 0;                                                    // processes of MPI for one solve; 0: none
};

// OK, or ResourceExhausted naming the limit.
absl::Status CheckLimit(const char* name, double asked, std::int64_t limit);

// OK if `options` asks for at most `max_ranks` processes of MPI. Errors: InvalidArgument if it asks for ranks and
// max_ranks is 0, or for a negative number; ResourceExhausted naming the limit.
absl::Status CheckRanks(const v1::SolveOptions& options, int max_ranks);

struct ValidSystem {
  std::variant<Problem, NonlinearProblem> system;
  Options options;
  ComponentNames names;
};

// Converts and validates the system and the options of a call: first declared shapes against the limits, before
// anything is allocated, then the conversion, then the rules. Errors: ResourceExhausted naming the limit;
// InvalidArgument with every violation found (only those of the conversion if there are any, since the rules need
// correct shapes).
absl::StatusOr<ValidSystem> ParseAndValidate(const v1::Problem& problem, const v1::SolveOptions& options,
                                             const SessionLimits& limits);
absl::StatusOr<ValidSystem> ParseAndValidate(const v1::NonlinearProblem& problem, const v1::SolveOptions& options,
                                             const SessionLimits& limits);

struct ValidEnsemble {
  Problem base;
  Options options;
  std::vector<EnsembleMember> members;
  ComponentNames names;
};

// The same for an ensemble; fields of a member are named members[3].x0[1].
absl::StatusOr<ValidEnsemble> ParseAndValidate(const v1::SolveEnsembleRequest& request, const SessionLimits& limits);

// The threads of a solve whose options request `asked`; 0 means all.
int AllowedThreads(int asked, const SessionLimits& limits);

// Numbers in the trajectory for each time: t, x, y, w and the outputs.
Index NumbersPerTime(const std::variant<Problem, NonlinearProblem>& system);

// Bytes of the trajectory of `system`, an upper bound, as SessionLimits::max_result_bytes counts them. Errors:
// ResourceExhausted naming the limit, max_steps or max_result_bytes.
absl::StatusOr<std::int64_t> CountResultBytes(const std::variant<Problem, NonlinearProblem>& system,
                                              const Options& options, const SessionLimits& limits);

// Renames the fields of `violations` of a problem and of options to their paths in the request: "A[0][1]" of "problem"
// is problem.a[0][1], "steps" is options.steps, "members[3].T" is members[3].horizon. `system` is the field that holds
// the problem; empty if that is the request itself.
std::vector<Violation> InRequest(std::vector<Violation> violations, const std::string& system);

// Returns an error of the engine with the paths of InRequest() in its violations, and one without violations unchanged.
absl::Status FromEngine(const absl::Status& status, const std::string& system);
// The same for the system that was solved.
absl::Status FromEngine(const absl::Status& status, const std::variant<Problem, NonlinearProblem>& system);

}  // namespace dlcs

#endif  // DLCS_SERVER_SESSION_REQUEST_CHECK_H_
