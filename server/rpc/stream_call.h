// SPDX-License-Identifier: Apache-2.0
// A server-streaming call: a gRPC reactor between a worker thread and the client.

#ifndef DLCS_SERVER_RPC_STREAM_CALL_H_
#define DLCS_SERVER_RPC_STREAM_CALL_H_

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "grpcpp/alarm.h"
#include "grpcpp/support/server_callback.h"
#include "server/access/credentials.h"
#include "server/jobs/catch_exceptions.h"
#include "server/rpc/call_environment.h"
#include "server/rpc/call_registry.h"
#include "server/wire/errors.h"
#include "server/wire/status.h"

namespace dlcs {

// Reactions never block; Work(), which may block, runs on a worker thread. If no message is in flight, Pump() gets the
// next one from Next() and writes it. Pump() or PumpSoon() is called by every source of new messages, and by
// OnWriteDone().
//
// A kCompute call writes messages while Work() runs. When the server stops it, only its Work() is stopped: the
// remaining messages are still written. A kStore call writes between two runs of Work(), and ends with UNAVAILABLE when
// the server drains, so that the client resumes with another server.
//
// The call is finished after the last message or an error; or, if the client has disconnected, as soon as Work() has
// returned. Lives until gRPC (OnDone), the worker and all wakers have released it.
template <typename Message>
class StreamCall : public grpc::ServerWriteReactor<Message>, public std::enable_shared_from_this<StreamCall<Message>> {
 public:
  // Admits and starts `call`, or finishes it with the reason for the refusal.
  static grpc::ServerWriteReactor<Message>* Start(std::shared_ptr<StreamCall> call) {
    StreamCall& begun = *call;
    begun.self_ = std::move(call);
    begun.Begin();
    return &begun;
  }

  void OnSendInitialMetadataDone(bool ok) override {
    if (kind_ == CallKind::kStore) HangUpOnShutdown();
    OnWriteDone(ok);
  }

  void OnWriteDone(bool ok) override {
    writing_ = false;
    if (ok) return Pump();
    HangUp(StopCause::kCancelled);
  }

  void OnCancel() override {
    const bool in_time = std::chrono::system_clock::now() < context_.deadline();
    HangUp(in_time ? StopCause::kCancelled : StopCause::kDeadline);
  }

  void OnDone() override {
    // May be the last reference: moved out first, so that the pointer is not destroyed while it is being reset.
    const std::shared_ptr<StreamCall> self = std::move(self_);
    on_stop_.reset();
  }

 protected:
  enum class Got {
    kMessage,
    kLast,     // the last message: it is sent together with the status
    kNothing,  // for now: Pump() is called later
    kBlocks,   // Work() is to be called first
    kEnd,
  };

  // The call can be stopped by its `name`.
  StreamCall(CallEnvironment& environment, grpc::CallbackServerContext& context, CallKind kind,
             CallRegistry::CallName name = {})
      : environment_(environment), context_(context), kind_(kind), name_(std::move(name)) {}

  // Before anything else. An error ends the call.
  virtual absl::Status Admit() { return absl::OkStatus(); }
  // May block. Called on a worker thread, once before the first Next() and after each kBlocks. An error ends the call.
  virtual absl::Status Work() = 0;
  // Never blocks. Called by one thread at a time. An error ends the call.
  virtual absl::StatusOr<Got> Next(Message& message) = 0;
  // Whether another message follows at once.
  virtual bool HasMore() const { return false; }

  // Writes the next message if there is one, unless a write is in flight. Safe from any thread.
  void Pump() {
    const std::lock_guard lock(mutex_);
    if (writing_ || finished_) return;
    if (working_ && (end_ || kind_ == CallKind::kStore)) return;
    if (end_) return End(*end_);
    const absl::StatusOr<Got> got = Next(message_);
    if (!got.ok()) return End(got.status());
    switch (*got) {
      case Got::kMessage:
        writing_ = true;
        // While more messages are waiting, gRPC buffers them and sends them together. Large messages are sent at once,
        // so that the reader can process one while the next is made.
        return this->StartWrite(&message_, HasMore() && message_.ByteSizeLong() < kLargeBytes
                                               ? grpc::WriteOptions().set_buffer_hint()
                                               : grpc::WriteOptions());
      case Got::kLast:
        if (IsForwarded(context_)) {
          // gRPC's in-process transport drops a message that is sent with the status before it was requested.
          writing_ = true;
          end_ = absl::OkStatus();
          return this->StartWrite(&message_, grpc::WriteOptions());
        }
        finished_ = true;
        return this->StartWriteAndFinish(&message_, grpc::WriteOptions(), grpc::Status::OK);
      case Got::kNothing:
        return;
      case Got::kBlocks:
        working_ = true;
        return WorkOnThread();
      case Got::kEnd:
        return End(absl::OkStatus());
    }
  }

  // Too short for a viewer to notice.
  static constexpr std::chrono::milliseconds kGathering{2};

  // Calls Pump() after a short delay, on a gRPC thread, unless a write is in flight (OnWriteDone() will call Pump()
  // then). This keeps serialization and system calls off the engine's thread, and messages within the delay are sent
  // together. Without a delay the thread starts at once; alarms are otherwise late by up to a millisecond.
  void PumpSoon(std::chrono::milliseconds delay = kGathering) {
    if (writing_ || is_due_.exchange(true)) return;
    using std::chrono::system_clock;
    const system_clock::time_point when = delay.count() > 0 ? system_clock::now() + delay : system_clock::time_point();
    const std::lock_guard lock(mutex_);
    gathering_ = std::make_unique<grpc::Alarm>();  // a new one: the last may not have finished yet
    gathering_->Set(when, [call = this->weak_from_this()](bool /*rang*/) {
      const std::shared_ptr<StreamCall> self = call.lock();
      if (self == nullptr) return;
      self->is_due_ = false;
      self->Pump();
    });
  }

  // A function that pumps this call if it is still there.
  std::function<void()> Waker() {
    return [call = this->weak_from_this()] {
      if (const std::shared_ptr<StreamCall> self = call.lock()) self->Pump();
    };
  }

  // Set after admission.
  const std::shared_ptr<SolveControl>& control() const { return control_; }

  CallEnvironment& environment_;
  grpc::CallbackServerContext& context_;  // owned by gRPC, valid until OnDone()

 private:
  static constexpr std::size_t kLargeBytes = std::size_t{1} << 16;

  void Begin() {
    control_ = environment_.calls.Register(kind_, name_);
    const absl::Status admitted = control_ == nullptr ? ShuttingDown() : Admit();
    if (!admitted.ok()) {
      const std::lock_guard lock(mutex_);
      return End(admitted);
    }
    // The work starts at once. Its messages wait for the headers: before these are sent, gRPC does not own the reactor,
    // and a first message could be lost.
    this->StartSendInitialMetadata();
    WorkOnThread();
  }

  void WorkOnThread() {
    environment_.WorkersFor(kind_).Run([self = this->shared_from_this()] {
      const absl::Status done =
          CatchExceptions(self->name_.id.empty() ? "stream" : self->name_.id, [&self] { return self->Work(); });
      self->SetWorking(false, done);
      self->Pump();
    });
  }

  void SetWorking(bool working, const absl::Status& done = absl::OkStatus()) {
    const std::lock_guard lock(mutex_);
    working_ = working;
    if (!done.ok() && !end_) end_ = done;
  }

  // The client has disconnected, or the server drains.
  void HangUp(StopCause cause) {
    {
      const std::lock_guard lock(mutex_);
      if (!end_) end_ = cause == StopCause::kShutdown ? ShuttingDown() : absl::CancelledError();
    }
    if (control_ != nullptr) control_->Stop(cause);
    Pump();
  }

  void HangUpOnShutdown() {
    on_stop_.emplace(control_->token(), [call = this->weak_from_this(), control = control_.get(),
                                         &workers = environment_.WorkersFor(kind_)] {
      if (control->cause() != StopCause::kShutdown) return;  // HangUp() itself
      // On another thread: the registry, which stops all calls, holds the lock that the end of this one needs.
      workers.Run([call] {
        if (const std::shared_ptr<StreamCall> self = call.lock()) self->HangUp(StopCause::kShutdown);
      });
    });
  }

  // With mutex_ held.
  void End(const absl::Status& status) {
    finished_ = true;
    this->Finish(ToGrpc(status));
  }

  const CallKind kind_;
  const CallRegistry::CallName name_;
  std::shared_ptr<SolveControl> control_;  // null when the call was refused
  std::optional<std::stop_callback<std::function<void()>>> on_stop_;
  std::shared_ptr<StreamCall> self_;  // the reference that gRPC holds

  // Both are cleared before Next() is called: if one of them is set when a new message arrives, a later Next() will
  // return it.
  std::atomic<bool> writing_ = true;  // a message or, at first, the headers
  std::atomic<bool> is_due_ = false;  // Pump(), by `gathering_`

  std::mutex mutex_;  // guards the following members
  Message message_;   // in flight while `writing_`
  std::unique_ptr<grpc::Alarm> gathering_;
  bool working_ = true;              // Work() is running or queued
  bool finished_ = false;            // Finish() was called
  std::optional<absl::Status> end_;  // how the call ends when Work() returns, even if there is more to write
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_STREAM_CALL_H_
