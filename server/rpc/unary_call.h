// SPDX-License-Identifier: Apache-2.0
// One call with one answer: a gRPC reactor that hands the work to a worker thread.

#ifndef DLCS_SERVER_RPC_UNARY_CALL_H_
#define DLCS_SERVER_RPC_UNARY_CALL_H_

#include <functional>
#include <memory>
#include <stop_token>

#include "absl/status/status.h"
#include "dlcs/v1/solver.grpc.pb.h"
#include "server/rpc/admission.h"
#include "server/rpc/call_admission.h"
#include "server/session/solve_session.h"

namespace dlcs {

// Takes a solver as Solve does, and asks the work to stop when the client hangs up, the deadline passes or
// the server shuts down. Nobody reads an answer after the first two; after the third the caller gets
// UNAVAILABLE.
//
// Lives until both gRPC (OnDone) and the worker have let go.
class UnaryCall final : public grpc::ServerUnaryReactor, public std::enable_shared_from_this<UnaryCall> {
 public:
  // Fills the response, which is gRPC's until OnDone(), where it returns OK.
  using Work = std::function<absl::Status(std::stop_token stop)>;

  // `name` for the log. `environment` outlives the call.
  static grpc::ServerUnaryReactor* Start(const CallEnvironment& environment, const char* name, Work work);

  UnaryCall(const CallEnvironment& environment, const char* name, Work work)
      : environment_(environment), name_(name), work_(std::move(work)) {}

  void OnCancel() override;
  void OnDone() override;

 private:
  void Begin();
  void DoWork();

  const CallEnvironment& environment_;
  const char* const name_;
  const Work work_;
  std::shared_ptr<UnaryCall> self_;        // gRPC's share
  std::shared_ptr<SolveControl> control_;  // null when the call was refused
  Admission::Ticket solver_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_UNARY_CALL_H_
