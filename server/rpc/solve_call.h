// SPDX-License-Identifier: Apache-2.0
// The calls of SolverService that stream: one solve, one ensemble.

#ifndef DLCS_SERVER_RPC_SOLVE_CALL_H_
#define DLCS_SERVER_RPC_SOLVE_CALL_H_

#include <chrono>
#include <cstdint>
#include <string>

#include "dlcs/v1/solver.grpc.pb.h"
#include "grpcpp/alarm.h"
#include "server/access/credentials.h"
#include "server/log.h"
#include "server/rpc/admission.h"
#include "server/rpc/ensemble_buffer.h"
#include "server/rpc/event_buffer.h"
#include "server/rpc/stream_call.h"
#include "server/session/solve_session.h"

namespace dlcs {

// Unique in this process, and very likely unique among processes.
std::string NewSolveId();

// A call that holds a solver while it computes, and the memory of its result until the client has received it. The
// engine puts events into the buffer. It is stopped when the client disconnects, by StopSolve, and some time before
// the deadline (StopTime()).
//
// A Buffer has Next(Event&), has_more(), delivered() and status(), as EventBuffer does.
template <typename Event, typename Buffer>
class SolverCall : public StreamCall<Event> {
 public:
  void OnDone() override {
    result_.reset();  // now, although others may still hold the call
    StreamCall<Event>::OnDone();
  }

 protected:
  using typename StreamCall<Event>::Got;

  SolverCall(CallEnvironment& environment, grpc::CallbackServerContext& context)
      : SolverCall(environment, context, NewSolveId()) {}

  // Solves on a worker thread, releases the solver, and closes the buffer.
  virtual void Run() = 0;

  absl::Status Admit() final { return TakeSolver(); }
  absl::Status Work() final {
    Run();
    return absl::OkStatus();  // errors are in the buffer, after the events that came before them
  }
  absl::StatusOr<Got> Next(Event& event) final;
  bool HasMore() const final { return buffer_.has_more(); }

  const std::string& id() const { return id_; }
  void ReleaseSolver() { solver_.reset(); }
  // Reserves memory until the call ends. Errors: ServerBusy.
  absl::Status HoldResult(std::int64_t bytes);
  // Stops the engine so early that `result_bytes` arrive before the deadline of the call.
  void StopBeforeDeadline(std::int64_t result_bytes);
  // Logs a line about this call with the common fields and `facts`.
  void LogCall(const std::string& message, LogFields facts) const;

  Buffer buffer_;

 private:
  SolverCall(CallEnvironment& environment, grpc::CallbackServerContext& context, const std::string& id)
      : StreamCall<Event>(environment, context, CallKind::kCompute,
                          {.id = id, .user = UserOf(environment.access, context)}),
        id_(id) {}
  absl::Status TakeSolver();

  const std::string id_;
  Admission::Ticket solver_;
  Admission::Ticket result_;
  grpc::Alarm alarm_;
};

class SolveCall final : public SolverCall<v1::SolveEvent, EventBuffer>, public SolveSink {
 public:
  // `request` is owned by gRPC and valid until OnDone().
  SolveCall(CallEnvironment& environment, grpc::CallbackServerContext& context, const v1::SolveRequest& request)
      : SolverCall(environment, context), request_(request) {}

  void Accept(v1::SolveEvent event) override;
  bool WantsTrajectory() override { return buffer_.WantsChunk(); }

 protected:
  void Run() override;

 private:
  absl::StatusOr<FinishedSolve> Solve();

  const v1::SolveRequest& request_;
};

class EnsembleCall final : public SolverCall<v1::EnsembleEvent, EnsembleBuffer>, public EnsembleSink {
 public:
  EnsembleCall(CallEnvironment& environment, grpc::CallbackServerContext& context,
               const v1::SolveEnsembleRequest& request)
      : SolverCall(environment, context), request_(request) {}

  bool MayBegin(Index member, const std::stop_token& stop) override { return buffer_.MayBegin(member, stop); }
  void Finished(Index member, FinishedSolve solve) override;

 protected:
  void Run() override;

 private:
  absl::StatusOr<v1::EnsembleSummary> Solve();

  const v1::SolveEnsembleRequest& request_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_SOLVE_CALL_H_
