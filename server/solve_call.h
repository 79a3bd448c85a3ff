// SPDX-License-Identifier: Apache-2.0
// One Solve call: a gRPC reactor between the thread that solves and the client that reads.

#ifndef DLCS_SERVER_SOLVE_CALL_H_
#define DLCS_SERVER_SOLVE_CALL_H_

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "dlcs/v1/solver.grpc.pb.h"
#include "grpcpp/alarm.h"
#include "server/admission.h"
#include "server/call_registry.h"
#include "server/event_mailbox.h"
#include "server/solve_session.h"
#include "server/worker_pool.h"

namespace dlcs {

// What calls share. Outlives them.
struct CallEnvironment {
  SessionLimits limits;
  Admission& admission;
  WorkerPool& workers;
  CallRegistry& calls;
  SetupCache* setups;  // null where nothing is kept
};

// Nothing blocks a reaction: the request is converted and solved on a worker thread, which puts events into
// the mailbox and then calls Pump(); so does OnWriteDone(). Pump() starts the next write when none is in
// flight. After the last event, or an error, or when the client is gone and the engine has noticed, it
// finishes the call.
//
// The engine is stopped when the client hangs up, and some time before the deadline, so that the trajectory
// so far and a summary that says DEADLINE still arrive: a tenth of the time allowed (at most one second), and
// what the delivery of the trajectory may take, together at most half of the time allowed.
//
// Lives until both gRPC (OnDone) and the worker have let go.
class SolveCall final : public grpc::ServerWriteReactor<v1::SolveEvent>,
                        public SolveSink,
                        public std::enable_shared_from_this<SolveCall> {
 public:
  static grpc::ServerWriteReactor<v1::SolveEvent>* Start(const CallEnvironment& environment,
                                                         grpc::CallbackServerContext& context,
                                                         const v1::SolveRequest& request);

  SolveCall(const CallEnvironment& environment, grpc::CallbackServerContext& context,
            const v1::SolveRequest& request);

  void OnSendInitialMetadataDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

  void Accept(v1::SolveEvent event) override;

 private:
  void Begin();
  void StopBeforeDeadline(std::int64_t result_bytes);
  void Work();
  absl::StatusOr<FinishedSolve> Solve();
  void HangUp(StopCause cause);
  void Pump();

  const CallEnvironment& environment_;
  grpc::CallbackServerContext& context_;  // as the request, gRPC's until OnDone()
  const v1::SolveRequest& request_;
  const std::string id_;
  std::shared_ptr<SolveCall> self_;  // gRPC's share

  std::shared_ptr<SolveControl> control_;  // null when the call was refused
  Admission::Ticket solver_;
  Admission::Ticket result_;
  grpc::Alarm alarm_;
  EventMailbox mailbox_;

  std::mutex mutex_;      // guards what follows
  v1::SolveEvent event_;  // in flight while `writing_`
  bool writing_ = false;
  bool hung_up_ = false;   // nobody reads any more
  bool finished_ = false;  // Finish() was called
};

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_CALL_H_
