// SPDX-License-Identifier: Apache-2.0
// The call of an upload: a reactor that reads piece by piece and leaves what blocks on the store to worker threads.

#ifndef DLCS_SERVER_RPC_UPLOAD_CALL_H_
#define DLCS_SERVER_RPC_UPLOAD_CALL_H_

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>

#include "dlcs/v1/problems.grpc.pb.h"
#include "grpcpp/support/server_callback.h"
#include "server/access/access.h"
#include "server/rpc/call_environment.h"
#include "server/solve_jobs/upload.h"

namespace dlcs {

// Uploads are held in memory, so only so many are under way at once.
struct UploadPlaces {
  static constexpr int kMost = 4;
  std::atomic<int> taken = 0;
};

// Lives until gRPC (OnDone) and the worker have let go. Ends with UNAVAILABLE when the server drains.
class UploadCall final : public grpc::ServerReadReactor<v1::UploadProblemRequest>,
                         public std::enable_shared_from_this<UploadCall> {
 public:
  // `environment` and `places` outlive the call, `response` is gRPC's until OnDone().
  static grpc::ServerReadReactor<v1::UploadProblemRequest>* Start(CallEnvironment& environment, UploadPlaces& places,
                                                                  const absl::StatusOr<Caller>& caller,
                                                                  v1::UploadProblemResponse& response);

  UploadCall(CallEnvironment& environment, UploadPlaces& places, const absl::StatusOr<Caller>& caller,
             v1::UploadProblemResponse& response)
      : environment_(environment),
        places_(places),
        caller_(caller),
        upload_(environment.jobs->library(), caller.ok() ? caller->user : ""),
        response_(response) {}
  void OnReadDone(bool ok) override;
  void OnCancel() override { cancelled_ = true; }
  void OnDone() override;

 private:
  void Admit();
  void ReadNext();
  void BeginOnWorker();
  void StoreOnWorker();
  // The first end stays.
  void End(const absl::StatusOr<v1::UploadProblemResponse>& end);

  CallEnvironment& environment_;
  UploadPlaces& places_;
  const absl::StatusOr<Caller> caller_;
  Upload upload_;
  v1::UploadProblemResponse& response_;
  std::shared_ptr<UploadCall> self_;       // gRPC's share
  std::shared_ptr<SolveControl> control_;  // null when the call was refused
  std::optional<std::stop_callback<std::function<void()>>> on_stop_;
  std::atomic<bool> cancelled_ = false;
  bool has_place_ = false;
  bool begun_ = false;
  v1::UploadProblemRequest part_;
  std::mutex mutex_;    // so that nothing is read behind the end
  bool ended_ = false;  // with mutex_
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_UPLOAD_CALL_H_
