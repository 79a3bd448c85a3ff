// SPDX-License-Identifier: Apache-2.0
#include "server/gateway/forwarded_call.h"

#include "boost/asio/async_result.hpp"
#include "boost/asio/post.hpp"
#include "boost/asio/use_awaitable.hpp"
#include "grpcpp/support/slice.h"

namespace dlcs {

namespace asio = boost::asio;

std::shared_ptr<ForwardedCall> ForwardedCall::Start(grpc::GenericStub& stub, ForwardedRequest request,
                                                    asio::any_io_executor executor) {
  const std::shared_ptr<ForwardedCall> call(new ForwardedCall(std::move(request), std::move(executor)));
  call->self_ = call;
  stub.PrepareBidiStreamingCall(&call->context_, call->request_.path, grpc::StubOptions(), call.get());
  call->AddHold();  // for reads, which the coroutine starts
  // Before the server can respond: gRPC's in-process transport drops a message that arrives with the status before it
  // was requested. Streams send their last message without the status (server/rpc/stream_call.h).
  call->StartRead(&call->in_);
  call->WriteNext();
  call->StartCall();
  return call;
}

ForwardedCall::ForwardedCall(ForwardedRequest request, asio::any_io_executor executor)
    : request_(std::move(request)), executor_(std::move(executor)) {
  for (const auto& [key, value] : request_.metadata) context_.AddMetadata(key, value);
  if (request_.deadline) context_.set_deadline(*request_.deadline);
}

void ForwardedCall::WriteNext() {
  if (written_ == request_.messages.size()) {
    if (written_ == 0) StartWritesDone();
    return;
  }
  // The slice owns the bytes. gRPC's in-process transport passes them to the server without a copy, and the server may
  // still parse them after this call was cancelled and destroyed.
  auto* const message = new std::string(std::move(request_.messages[written_++]));
  const auto destroy = [](void* owned) { delete static_cast<std::string*>(owned); };
  const grpc::Slice slice(message->data(), message->size(), destroy, message);
  out_ = grpc::ByteBuffer(&slice, 1);
  if (written_ == request_.messages.size()) {
    StartWriteLast(&out_, grpc::WriteOptions());
  } else {
    StartWrite(&out_);
  }
}

void ForwardedCall::OnWriteDone(bool ok) {
  if (ok && written_ < request_.messages.size()) WriteNext();
}

asio::awaitable<bool> ForwardedCall::Suspend(std::function<void()> begin) {
  const auto initiate = [this, &begin](auto handler) {
    const auto kept = std::make_shared<decltype(handler)>(std::move(handler));
    std::function<void(bool)> resume = [kept](bool ok) { (*kept)(ok); };
    std::optional<bool> early;
    {
      const std::lock_guard lock(mutex_);
      early = std::exchange(early_, std::nullopt);
      if (!early) resume_ = std::move(resume);
    }
    if (early) return asio::post(executor_, [resume, ok = *early] { resume(ok); });
    begin();
  };
  const bool ok =
      co_await asio::async_initiate<const asio::use_awaitable_t<>, void(bool)>(initiate, asio::use_awaitable);
  co_return ok;
}

void ForwardedCall::Resume(bool ok) {
  std::function<void(bool)> resume;
  {
    const std::lock_guard lock(mutex_);
    if (resume_ == nullptr) {  // the first read
      early_ = ok;
      return;
    }
    resume = std::exchange(resume_, nullptr);
  }
  asio::post(executor_, [resume = std::move(resume), ok] { resume(ok); });
}

asio::awaitable<std::optional<std::string>> ForwardedCall::Read() {
  const bool was_begun = std::exchange(first_read_, false);
  std::function<void()> begin = [this, was_begun] {
    if (!was_begun) StartRead(&in_);
  };
  const bool got = co_await Suspend(std::move(begin));
  if (!got) co_return std::nullopt;
  std::vector<grpc::Slice> slices;
  std::string message;
  if (in_.Dump(&slices).ok()) {
    message.reserve(in_.Length());
    for (const grpc::Slice& slice : slices) {
      message.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
    }
  }
  in_.Clear();
  co_return message;
}

asio::awaitable<grpc::Status> ForwardedCall::Finish() {
  std::function<void()> begin = [this] { RemoveHold(); };
  co_await Suspend(std::move(begin));
  co_return status_;
}

void ForwardedCall::OnDone(const grpc::Status& status) {
  // May be the last reference: moved out first, so that the pointer is not destroyed while it is being reset.
  const std::shared_ptr<ForwardedCall> self = std::move(self_);
  status_ = status;
  Resume(true);
}

std::multimap<std::string, std::string> ForwardedCall::Trailers() const {
  std::multimap<std::string, std::string> trailers;
  for (const auto& [key, value] : context_.GetServerTrailingMetadata()) {
    const std::string name(key.data(), key.size());
    if (name.rfind("grpc-", 0) != 0) trailers.emplace(name, std::string(value.data(), value.size()));
  }
  return trailers;
}

}  // namespace dlcs
