// SPDX-License-Identifier: Apache-2.0
// A call to the gRPC server of this process, awaited by a coroutine; no thread waits for it.

#ifndef DLCS_SERVER_GATEWAY_FORWARDED_CALL_H_
#define DLCS_SERVER_GATEWAY_FORWARDED_CALL_H_

#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "boost/asio/any_io_executor.hpp"
#include "boost/asio/awaitable.hpp"
#include "grpcpp/client_context.h"
#include "grpcpp/generic/generic_stub.h"
#include "grpcpp/support/byte_buffer.h"
#include "grpcpp/support/client_callback.h"

namespace dlcs {

struct ForwardedRequest {
  std::string path;  // "/dlcs.v1.JobService/GetSolveJob"
  std::vector<std::pair<std::string, std::string>> metadata;
  std::optional<std::chrono::system_clock::time_point> deadline;
  std::vector<std::string> messages;
};

class ForwardedCall final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                            public std::enable_shared_from_this<ForwardedCall> {
 public:
  // Sends all messages. The coroutine that uses the call runs on `executor`.
  static std::shared_ptr<ForwardedCall> Start(grpc::GenericStub& stub, ForwardedRequest request,
                                              boost::asio::any_io_executor executor);

  // The next message of the response; absent after the last one. Then Finish() must be called. A message is read from
  // the server only when it is requested, so that a slow reader slows the server's stream.
  boost::asio::awaitable<std::optional<std::string>> Read();
  // Waits for the end of the call. Call it once.
  boost::asio::awaitable<grpc::Status> Finish();

  // Trailing metadata, after Finish().
  std::multimap<std::string, std::string> Trailers() const;

  // From any thread, also after the end.
  void Cancel() { context_.TryCancel(); }

  void OnWriteDone(bool ok) override;
  void OnReadDone(bool ok) override { Resume(ok); }
  void OnDone(const grpc::Status& status) override;

 private:
  ForwardedCall(ForwardedRequest request, boost::asio::any_io_executor executor);
  void WriteNext();
  // Suspends the coroutine, calls `begin`, and resumes at Resume(), which may have been called already.
  boost::asio::awaitable<bool> Suspend(std::function<void()> begin);
  void Resume(bool ok);

  ForwardedRequest request_;  // its messages are moved out when they are written
  const boost::asio::any_io_executor executor_;
  grpc::ClientContext context_;
  std::shared_ptr<ForwardedCall> self_;  // the reference that gRPC holds
  std::size_t written_ = 0;
  grpc::ByteBuffer out_, in_;
  bool first_read_ = true;  // which Start() has begun
  std::mutex mutex_;        // guards the following members
  std::function<void(bool)> resume_;
  std::optional<bool> early_;  // Resume() was called first
  grpc::Status status_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_GATEWAY_FORWARDED_CALL_H_
