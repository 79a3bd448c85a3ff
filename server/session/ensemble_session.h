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

// A request that is ready to run: converted, validated and within the limits.
struct PreparedEnsemble {
  ValidEnsemble ensemble;
  std::vector<std::string> labels;  // of the members
  std::vector<std::int64_t>
      result_bytes;             // for each member an upper bound of the memory that its result holds until it is read
  std::int64_t all_bytes = 0;   // of all members together
  std::int64_t held_bytes = 0;  // enough to keep all threads and the reader busy; at least that of any member
};

// Converts and checks `request`; `find` looks up a problem that is given by name. Errors: as ParseAndValidate() and
// `find`, and ResourceExhausted when a member is above a limit.
absl::StatusOr<PreparedEnsemble> PrepareEnsemble(const v1::SolveEnsembleRequest& request, const SessionLimits& limits,
                                                 const ProblemResolver& find = {});

// Receives the members as they finish.
class EnsembleSink {
 public:
  virtual ~EnsembleSink() = default;
  // Called before a member is started, from the thread that would solve it. May wait until there is memory for its
  // result, or until `stop` is requested. Returns whether to start it.
  virtual bool MayBegin(Index member, const std::stop_token& stop) = 0;
  // One call at a time, from any thread.
  virtual void Finished(Index member, FinishedSolve solve) = 0;
};

// The set-up cache of an ensemble that has none to share.
inline constexpr double kOwnSetupBytes = 1e9;

// Runs the engine. `sink` receives all started members; the summary counts all members. Threads: as in core/ensemble.h.
// `setups` as in RunSolve(). Errors: InvalidArgument for rules that only the engine can check.
absl::StatusOr<v1::EnsembleSummary> RunEnsemble(const PreparedEnsemble& prepared, const SolveControl& control,
                                                EnsembleSink& sink, SetupCache* setups = nullptr);

// Makes and numbers the events of one ensemble, in the order of the calls.
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

// Receives the events of an ensemble, one at a time, from any thread; those of one member are consecutive.
using EnsembleEvents = std::function<void(v1::EnsembleEvent event)>;

// Prepares and runs an ensemble for a caller in the same process, and passes every event to `take`, the summary last.
absl::Status RunEnsembleToEnd(const v1::SolveEnsembleRequest& request, const SessionLimits& limits,
                              const std::string& solve_id, const SolveControl& control, const EnsembleEvents& take);

}  // namespace dlcs

#endif  // DLCS_SERVER_SESSION_ENSEMBLE_SESSION_H_
