// SPDX-License-Identifier: Apache-2.0
// The calls of SolverService that stream: one solve, one ensemble.

#ifndef DLCS_SERVER_RPC_SOLVE_CALL_H_
#define DLCS_SERVER_RPC_SOLVE_CALL_H_

#include "dlcs/v1/solver.grpc.pb.h"
#include "server/rpc/ensemble_buffer.h"
#include "server/rpc/event_buffer.h"
#include "server/rpc/stream_call.h"
#include "server/session/solve_session.h"

namespace dlcs {

class SolveCall final : public StreamCall<v1::SolveEvent, EventMailbox>, public SolveSink {
 public:
  // `request` is gRPC's until OnDone().
  SolveCall(const CallEnvironment& environment, grpc::CallbackServerContext& context, const v1::SolveRequest& request)
      : StreamCall(environment, context), request_(request) {}

  void Accept(v1::SolveEvent event) override;

 protected:
  void Run() override;

 private:
  absl::StatusOr<FinishedSolve> Solve();

  const v1::SolveRequest& request_;
};

class EnsembleCall final : public StreamCall<v1::EnsembleEvent, EnsembleMailbox>, public EnsembleSink {
 public:
  EnsembleCall(const CallEnvironment& environment, grpc::CallbackServerContext& context,
               const v1::SolveEnsembleRequest& request)
      : StreamCall(environment, context), request_(request) {}

  bool MayBegin(Index member, const std::stop_token& stop) override { return mailbox_.MayBegin(member, stop); }
  void Finished(Index member, FinishedSolve solve) override;

 protected:
  void Run() override;

 private:
  absl::StatusOr<v1::EnsembleSummary> Solve();

  const v1::SolveEnsembleRequest& request_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_SOLVE_CALL_H_
