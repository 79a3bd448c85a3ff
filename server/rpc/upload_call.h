// SPDX-License-Identifier: Apache-2.0
// The upload call: a reactor that reads the pieces, with blocking store operations on worker threads.

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

// Uploads are held in memory, so the number of concurrent ones is limited.
struct UploadSlots {
  static constexpr int kMax = 4;
  std::atomic<int> taken = 0;
};

// One of them, held while it lives.
class UploadSlot {
 public:
  explicit UploadSlot(UploadSlots& slots) : slots_(slots), is_free_(++slots.taken <= UploadSlots::kMax) {}
  ~UploadSlot() { --slots_.taken; }
  UploadSlot(const UploadSlot&) = delete;
  UploadSlot& operator=(const UploadSlot&) = delete;

  bool is_free() const { return is_free_; }
  // The error of an upload without a slot, which may be repeated.
  static absl::Status AllTaken();

 private:
  UploadSlots& slots_;
  const bool is_free_;
};

// Lives until gRPC (OnDone) and the worker have released it. Ends with UNAVAILABLE when the server drains.
class UploadCall final : public grpc::ServerReadReactor<v1::UploadProblemRequest>,
                         public std::enable_shared_from_this<UploadCall> {
 public:
  // `environment` and `slots` must outlive the call; `response` is owned by gRPC and valid until OnDone().
  static grpc::ServerReadReactor<v1::UploadProblemRequest>* Start(CallEnvironment& environment, UploadSlots& slots,
                                                                  const absl::StatusOr<Caller>& caller,
                                                                  v1::UploadProblemResponse& response);

  UploadCall(CallEnvironment& environment, UploadSlots& slots, const absl::StatusOr<Caller>& caller,
             v1::UploadProblemResponse& response)
      : environment_(environment),
        slots_(slots),
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
  // Later calls have no effect.
  void End(const absl::StatusOr<v1::UploadProblemResponse>& end);

  CallEnvironment& environment_;
  UploadSlots& slots_;
  const absl::StatusOr<Caller> caller_;
  Upload upload_;
  v1::UploadProblemResponse& response_;
  std::shared_ptr<UploadCall> self_;       // the reference that gRPC holds
  std::shared_ptr<SolveControl> control_;  // null when the call was refused
  std::optional<std::stop_callback<std::function<void()>>> on_stop_;
  std::atomic<bool> cancelled_ = false;
  std::optional<UploadSlot> slot_;
  bool begun_ = false;
  v1::UploadProblemRequest part_;
  std::mutex mutex_;    // so that nothing is read after the end
  bool ended_ = false;  // with mutex_
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_UPLOAD_CALL_H_
