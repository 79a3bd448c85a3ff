// SPDX-License-Identifier: Apache-2.0
// What a call that streams takes from the server and gives back: its place among the solves, the memory of its result,
// the time that it is allowed.

#ifndef DLCS_SERVER_CALL_LIFETIME_H_
#define DLCS_SERVER_CALL_LIFETIME_H_

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "grpcpp/alarm.h"
#include "grpcpp/server_context.h"
#include "server/admission.h"
#include "server/call_registry.h"
#include "server/solve_session.h"
#include "server/telemetry/metrics.h"
#include "server/worker_pool.h"

namespace dlcs {

// What calls share. Outlives them.
struct CallEnvironment {
  SessionLimits limits;
  Admission& admission;
  WorkerPool& workers;
  CallRegistry& calls;
  SetupCache* setups;  // null where nothing is kept
  // The uploaded problems of who made a call; an empty function on a server without a store.
  std::function<FindProblem(const grpc::CallbackServerContext&)> problems_of;
  Metrics& metrics;
};

class CallLifetime {
 public:
  explicit CallLifetime(const CallEnvironment& environment);

  // Distinct among the calls of this process, and very likely among processes.
  const std::string& id() const { return id_; }

  // Registers the call and takes a solver. Errors: ShuttingDown, ServerBusy.
  absl::Status Admit();
  void GiveSolverBack() { solver_.reset(); }
  // Until the call ends. Errors: ServerBusy.
  absl::Status HoldResult(std::int64_t bytes);

  // Stops the engine some time before `deadline`, so that what was found still arrives: a tenth of the time allowed (at
  // most one second), and what the delivery of `result_bytes` may take, together at most half of the time allowed.
  void StopBeforeDeadline(std::chrono::system_clock::time_point deadline, std::int64_t result_bytes);

  // The call is done: what it holds goes back now, whoever still knows of it.
  void End();

  // Of a call that was admitted, until End().
  const SolveControl& control() const { return *control_; }
  void Stop(StopCause cause);

 private:
  const CallEnvironment& environment_;
  const std::string id_;
  std::shared_ptr<SolveControl> control_;  // null when the call was refused
  Admission::Ticket solver_;
  Admission::Ticket result_;
  grpc::Alarm alarm_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_CALL_LIFETIME_H_
