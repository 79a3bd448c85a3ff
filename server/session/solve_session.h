// SPDX-License-Identifier: Apache-2.0
// One solve, from the request on the wire to the events on the wire, without any RPC in it.
//
// The server runs a session on a worker thread; the command line runs the same session in its process. So a solve has
// the same result in both. All errors carry google.rpc details (server/wire/errors.h).

#ifndef DLCS_SERVER_SESSION_SOLVE_SESSION_H_
#define DLCS_SERVER_SESSION_SOLVE_SESSION_H_

#include <atomic>
#include <cstdint>
#include <optional>
#include <stop_token>
#include <string>
#include <variant>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/outputs/output_evaluator.h"
#include "core/problem/nonlinear_problem.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"
#include "dlcs/v1/solver.pb.h"
#include "server/session/problem_reference.h"
#include "server/session/request_check.h"

namespace dlcs {

class SetupCache;

enum class StopCause { kNone, kCancelled, kDeadline, kShutdown };

// The explanation of a stop for the caller, which the engine cannot give: "The deadline was near: ..."; empty for
// kNone.
const char* StopAdvice(StopCause cause);

// Stops a solve and stores the cause; the first one counts. Safe from any thread.
class SolveControl {
 public:
  void Stop(StopCause cause);
  StopCause cause() const { return cause_.load(); }
  std::stop_token token() const { return source_.get_token(); }

 private:
  std::atomic<StopCause> cause_{StopCause::kNone};
  std::stop_source source_;
};

// Receives the events of a solve. Called from the thread that runs it, one call at a time; must not block.
class SolveSink {
 public:
  virtual ~SolveSink() = default;
  virtual void Accept(v1::SolveEvent event) = 0;
  // Whether a chunk of the trajectory is welcome while the engine runs; if not, it follows when the solve is finished.
  virtual bool WantsTrajectory() { return false; }
};

// A request that is ready to run: converted, validated and within the limits.
struct PreparedSolve {
  std::variant<Problem, NonlinearProblem> system;
  Options options;
  std::int64_t result_bytes = 0;  // as SessionLimits::max_result_bytes counts them, an upper bound
  ComponentNames names;

  Index num_states() const;
  Index num_constraints() const;
};

// Converts and checks `request`; `find` looks up a problem that is given by name.
// Errors: InvalidArgument with every violation found (only those of the conversion if there are any, since the rules
// need correct shapes); ResourceExhausted naming the limit; those of `find`.
absl::StatusOr<PreparedSolve> PrepareSolve(const v1::SolveRequest& request, const SessionLimits& limits,
                                           const ProblemResolver& find = {});

// The end of a solve: its trajectory chunks (each below 1 MB) and the summary, made one at a time on request, so that a
// slow reader costs the memory of the solution and not a second copy.
class FinishedSolve {
 public:
  // `next_sequence` continues the numbers of the events that the sink received, `next_time` the times of the
  // trajectory.
  FinishedSolve(Solution solution, std::optional<OutputEvaluator> outputs, StopCause cause, std::int64_t next_sequence,
                Index next_time = 0);

  // The chunks in order, then the summary, then nothing. O(1 MB) per call.
  std::optional<v1::SolveEvent> NextEvent();

  const Solution& solution() const { return solution_; }
  // The evaluator of its outputs; null if it has none.
  OutputEvaluator* outputs() { return outputs_ ? &*outputs_ : nullptr; }
  // As in the summary: DEADLINE, where the engine only knows that it was cancelled.
  v1::Termination termination() const;

 private:
  Solution solution_;
  std::optional<OutputEvaluator> outputs_;
  StopCause cause_;
  std::int64_t next_sequence_;
  Index next_time_;
  bool summary_made_ = false;
};

// The evaluator of the outputs of `problem` in trajectories; absent if it has none. Errors: those of
// OutputEvaluator::Create().
absl::StatusOr<std::optional<OutputEvaluator>> OutputsOf(const Problem& problem, const Options& options);

// The peak memory of this process so far.
double PeakResidentBytes();

// Runs the engine. `sink` gets accepted (with `solve_id`), analysis, windows, iterates, and the chunks that it wants of
// the trajectory so far, numbered from 1.
// Errors: InvalidArgument for rules that only the engine can check (a solution rule that M does not admit). Threads:
// those of the engine; `sink` is called from the calling one. `setups` may be null; it shares set-ups between solves of
// the same matrices.
absl::StatusOr<FinishedSolve> RunSolve(const PreparedSolve& prepared, const std::string& solve_id,
                                       const SolveControl& control, SolveSink& sink, SetupCache* setups = nullptr);

// Prepares and runs a solve for a caller in the same process, and passes every event to `sink`, the summary last.
absl::Status RunSolveToEnd(const v1::SolveRequest& request, const SessionLimits& limits, const std::string& solve_id,
                           const SolveControl& control, SolveSink& sink);

}  // namespace dlcs

#endif  // DLCS_SERVER_SESSION_SOLVE_SESSION_H_
