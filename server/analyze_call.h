// SPDX-License-Identifier: Apache-2.0
// One AnalyzeProblem call: a gRPC reactor that hands the work to a worker thread.

#ifndef DLCS_SERVER_ANALYZE_CALL_H_
#define DLCS_SERVER_ANALYZE_CALL_H_

#include <memory>

#include "dlcs/v1/solver.grpc.pb.h"
#include "server/admission.h"
#include "server/solve_call.h"
#include "server/solve_session.h"

namespace dlcs {

// Takes a solver as Solve does, and stops when the client hangs up, the deadline passes or the server shuts down.
// Nobody reads an answer after the first two; after the third the caller gets UNAVAILABLE.
//
// Lives until both gRPC (OnDone) and the worker have let go.
class AnalyzeCall final : public grpc::ServerUnaryReactor, public std::enable_shared_from_this<AnalyzeCall> {
 public:
  static grpc::ServerUnaryReactor* Start(const CallEnvironment& environment,
                                         const v1::AnalyzeProblemRequest& request,
                                         v1::AnalyzeProblemResponse& response);

  AnalyzeCall(const CallEnvironment& environment, const v1::AnalyzeProblemRequest& request,
              v1::AnalyzeProblemResponse& response)
      : environment_(environment), request_(request), response_(response) {}

  void OnCancel() override;
  void OnDone() override;

 private:
  void Begin();
  void Work();

  const CallEnvironment& environment_;
  const v1::AnalyzeProblemRequest& request_;  // as the response, gRPC's until OnDone()
  v1::AnalyzeProblemResponse& response_;
  std::shared_ptr<AnalyzeCall> self_;  // gRPC's share
  std::shared_ptr<SolveControl> control_;  // null when the call was refused
  Admission::Ticket solver_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_ANALYZE_CALL_H_
