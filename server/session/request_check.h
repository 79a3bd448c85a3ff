// SPDX-License-Identifier: Apache-2.0
// What every call checks before the engine starts: that a request converts, is sound and within the limits.

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

// What a session may use. The defaults limit nothing.
struct SessionLimits {
  std::int64_t max_states = std::numeric_limits<std::int64_t>::max();
  // Of a system whose A is written down entry by entry: its time grows like states².
  std::int64_t max_dense_states = std::numeric_limits<std::int64_t>::max();
  std::int64_t max_constraints = std::numeric_limits<std::int64_t>::max();
  std::int64_t max_steps = std::numeric_limits<std::int64_t>::max();
  // Bytes of the trajectory, (1 + m + 2n) doubles a time: at the output times where those are asked for, else at all
  // nodes; of a nonlinear problem at all nodes anyway, which the engine holds while it solves.
  std::int64_t max_result_bytes = std::numeric_limits<std::int64_t>::max();
  // Bytes of the answer of a call that is not streamed.
  std::int64_t max_answer_bytes = std::numeric_limits<std::int64_t>::max();
  // Bytes that a solve may allocate, as the engine predicts them; 0 leaves it to the options.
  double max_memory_bytes = 0;
  int max_threads = 0;                                                  // 0: all of the machine
  std::int64_t max_members = std::numeric_limits<std::int64_t>::max();  // of one ensemble
};

// OK, or ResourceExhausted naming the limit.
absl::Status CheckLimit(const char* name, double asked, std::int64_t limit);

struct SoundSystem {
  std::variant<Problem, NonlinearProblem> system;
  Options options;
  ComponentNames names;
};

// Converts and checks what every call about a system brings: declared shapes against the limits before
// anything is made of them, then the conversion, then the rules. Errors: ResourceExhausted naming the limit;
// InvalidArgument with every violation found (those of the conversion first and alone, since the other checks
// presuppose shapes).
absl::StatusOr<SoundSystem> ParseAndValidate(const v1::Problem& problem, const v1::SolveOptions& options,
                                      const SessionLimits& limits);
absl::StatusOr<SoundSystem> ParseAndValidate(const v1::NonlinearProblem& problem, const v1::SolveOptions& options,
                                      const SessionLimits& limits);

struct SoundEnsemble {
  Problem base;
  Options options;
  std::vector<EnsembleMember> members;
  ComponentNames names;
};

// The same for an ensemble; what is a member's own is named members[3].x0[1].
absl::StatusOr<SoundEnsemble> ParseAndValidate(const v1::SolveEnsembleRequest& request, const SessionLimits& limits);

// The threads of a solve whose options ask for `asked`; 0 takes all.
int AllowedThreads(int asked, const SessionLimits& limits);

// Bytes of the trajectory of `system`, an upper bound, as SessionLimits::max_result_bytes counts them. Errors:
// ResourceExhausted naming the limit, max_steps or max_result_bytes.
absl::StatusOr<std::int64_t> CountResultBytes(const std::variant<Problem, NonlinearProblem>& system,
                                              const Options& options, const SessionLimits& limits);

// `violations` of a problem and of options, by their paths in the request: "A[0][1]" of "problem" is problem.a[0][1],
// "steps" is options.steps, "members[3].T" is members[3].horizon. `system` is the field that holds the problem; empty
// where that is the request itself.
std::vector<Violation> InRequest(std::vector<Violation> violations, const std::string& system);

// The engine's own InvalidArgument ("field: description", one per line) with its violations singly, by their paths as
// InRequest(); any other status as it is.
absl::Status FromEngine(const absl::Status& status, const std::string& system);
// The same for the system that was solved.
absl::Status FromEngine(const absl::Status& status, const std::variant<Problem, NonlinearProblem>& system);

}  // namespace dlcs

#endif  // DLCS_SERVER_SESSION_REQUEST_CHECK_H_
