// SPDX-License-Identifier: Apache-2.0
// One ensemble, from the request on the wire to the events on the wire, without any RPC in it: what a server runs on
// its threads, and the command line in its process. All errors carry google.rpc details (server/wire/errors.h).

#ifndef DLCS_SERVER_SESSION_ENSEMBLE_SESSION_H_
#define DLCS_SERVER_SESSION_ENSEMBLE_SESSION_H_

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/setup_cache.h"
#include "dlcs/v1/solver.pb.h"
#include "server/session/problem_reference.h"
#include "server/session/request_check.h"
#include "server/session/solve_session.h"

namespace dlcs {

// A request that may run: converted, within the limits, and sound.
struct PreparedEnsemble {
  SoundEnsemble ensemble;
  std::vector<std::string> labels;  // of the members
  std::vector<std::int64_t>
      result_bytes;             // of the members: what each holds until its reader has taken it, an upper bound
  std::int64_t all_bytes = 0;   // of all members together
  std::int64_t held_bytes = 0;  // what suffices to keep the threads at work and a reader too; no less than any member's
};

// Converts and checks `request`, whose problem `find` finds where it is named. Errors: as ParseAndValidate() and
// `find`, and ResourceExhausted when a member is above a limit.
absl::StatusOr<PreparedEnsemble> PrepareEnsemble(const v1::SolveEnsembleRequest& request, const SessionLimits& limits,
                                                 const ProblemResolver& find = {});

// Takes the members as they finish.
class EnsembleSink {
 public:
  virtual ~EnsembleSink() = default;
  // Before a member is begun, from the thread that would solve it; may wait until there is room for its result, but not
  // longer than until `stop` is requested. Says whether to begin it.
  virtual bool MayBegin(Index member, const std::stop_token& stop) = 0;
  // One call at a time, from any thread.
  virtual void Finished(Index member, FinishedSolve solve) = 0;
};

// Runs the engine. Members that were begun reach `sink`; the summary counts all. Threads: as core/ensemble.h. `setups`
// as in RunSolve(). Errors: InvalidArgument for what only the engine can judge.
absl::StatusOr<v1::EnsembleSummary> RunEnsemble(const PreparedEnsemble& prepared, const SolveControl& control,
                                                EnsembleSink& sink, SetupCache* setups = nullptr);

// Numbers the events of one ensemble, in the order in which it is asked for them.
class EnsembleWriter {
 public:
  explicit EnsembleWriter(std::vector<std::string> labels) : labels_(std::move(labels)) {}

  v1::EnsembleEvent Accepted(const std::string& solve_id, const PreparedEnsemble& prepared);
  // `event` is one of FinishedSolve::NextEvent().
  v1::EnsembleEvent OfMember(Index member, v1::SolveEvent event);
  v1::EnsembleEvent Summary(v1::EnsembleSummary summary);

 private:
  v1::EnsembleEvent Next();

  std::vector<std::string> labels_;
  std::int64_t next_sequence_ = 1;
};

// Takes the events of an ensemble, one at a time, from any thread; those of a member follow one another.
using EnsembleEvents = std::function<void(v1::EnsembleEvent event)>;

// All of it for a caller in the same process: prepare, run, and hand every event to `take`, summary last.
absl::Status RunEnsembleToEnd(const v1::SolveEnsembleRequest& request, const SessionLimits& limits,
                              const std::string& solve_id, const SolveControl& control, const EnsembleEvents& take);

}  // namespace dlcs

#endif  // DLCS_SERVER_SESSION_ENSEMBLE_SESSION_H_
