// SPDX-License-Identifier: Apache-2.0
// What a call that streams takes from the server and gives back: its place among the solves, the memory of its result,
// the time that it is allowed.

#ifndef DLCS_SERVER_RPC_CALL_ADMISSION_H_
#define DLCS_SERVER_RPC_CALL_ADMISSION_H_

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "grpcpp/alarm.h"
#include "grpcpp/server_context.h"
#include "server/access/access.h"
#include "server/rpc/admission.h"
#include "server/rpc/call_registry.h"
#include "server/rpc/worker_pool.h"
#include "server/session/problem_reference.h"
#include "server/session/solve_session.h"
#include "server/solve_jobs/problem_library.h"
#include "server/telemetry/metrics.h"

namespace dlcs {

// What calls share. Outlives them.
struct CallEnvironment {
  SessionLimits limits;
  Admission& admission;
  WorkerPool& workers;
  CallRegistry& calls;
  SetupCache* setups;  // null where nothing is kept
  const Access& access;
  const ProblemLibrary* problems;  // null on a server without a store
  Metrics& metrics;
};

// The uploaded problems of who makes `call`, which must still be there when one is looked for. An empty function on a
// server without a store.
ProblemResolver ProblemsOf(const CallEnvironment& environment, const grpc::CallbackServerContext& call);

class CallLifetime {
 public:
  explicit CallLifetime(const CallEnvironment& environment);

  // Distinct among the calls of this process, and very likely among processes.
  const std::string& id() const { return id_; }

  // Registers the call, which `user` may stop by its id, and takes a solver. Errors: ShuttingDown, ServerBusy.
  absl::Status Admit(const std::string& user);
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

#endif  // DLCS_SERVER_RPC_CALL_ADMISSION_H_
