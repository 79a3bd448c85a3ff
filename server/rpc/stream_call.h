// SPDX-License-Identifier: Apache-2.0
// One call with a stream of events: a gRPC reactor between the thread that solves and the client that reads.

#ifndef DLCS_SERVER_RPC_STREAM_CALL_H_
#define DLCS_SERVER_RPC_STREAM_CALL_H_

#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "dlcs/v1/solver.grpc.pb.h"
#include "grpcpp/alarm.h"
#include "server/access/credentials.h"
#include "server/log.h"
#include "server/rpc/call_admission.h"
#include "server/rpc/event_buffer.h"
#include "server/telemetry/call_trace.h"
#include "server/wire/status.h"
#include "spdlog/spdlog.h"

namespace dlcs {

// Nothing blocks a reaction: the request is converted and solved on a worker thread (Run() of the derived class), which
// puts events into the mailbox and then calls Pump(); so does OnWriteDone(). Pump() starts the next write when none is
// in flight. After the last event, or an error, or when the client is gone and the engine has noticed, it finishes the
// call.
//
// The engine is stopped when the client hangs up, by StopSolve, and some time before the deadline
// (CallLifetime::StopBeforeDeadline).
//
// Lives until both gRPC (OnDone) and the worker have let go. A Mailbox has Next(Event&), has_more(), delivered(),
// closed() and status(), as EventMailbox does.
template <typename Event, typename Mailbox>
class StreamCall : public grpc::ServerWriteReactor<Event>,
                   public std::enable_shared_from_this<StreamCall<Event, Mailbox>> {
 public:
  // Takes `call` over: admits it and lets it run, or finishes it with why not.
  static grpc::ServerWriteReactor<Event>* Start(std::shared_ptr<StreamCall> call) {
    StreamCall& begun = *call;
    begun.self_ = std::move(call);
    begun.Begin();
    return &begun;
  }

  StreamCall(const CallEnvironment& environment, grpc::CallbackServerContext& context)
      : environment_(environment), context_(context), lifetime_(environment) {}

  void OnSendInitialMetadataDone(bool ok) override {
    if (!ok) HangUp(StopCause::kCancelled);
    environment_.workers.Run([self = this->shared_from_this()] {
      self->Run();
      self->lifetime_.GiveSolverBack();
      self->Pump();
    });
  }

  void OnWriteDone(bool ok) override {
    if (!ok) HangUp(StopCause::kCancelled);
    writing_ = false;
    Pump();
  }

  void OnCancel() override {
    const bool in_time = std::chrono::system_clock::now() < context_.deadline();
    HangUp(in_time ? StopCause::kCancelled : StopCause::kDeadline);
    Pump();
  }

  void OnDone() override {
    lifetime_.End();
    // May be the last share: moved out first, so that nobody destroys the pointer that is being reset.
    const std::shared_ptr<StreamCall> self = std::move(self_);
  }

 protected:
  // Solves, on a worker thread, and closes the mailbox.
  virtual void Run() = 0;

  // The caller's uploaded problems.
  ProblemResolver Problems() const { return ProblemsOf(environment_, context_); }

  // A line of the log about this call: what all have, and `facts`.
  void Tell(const std::string& message, LogFields facts) const {
    if (!spdlog::should_log(spdlog::level::info)) return;  // who calls is looked up
    facts.insert(facts.begin(), {{"solve", lifetime_.id()}, {"user", UserOf(environment_.access, context_)}});
    facts.push_back({"trace_id", TraceIdOf(context_)});
    Log(spdlog::level::info, message, facts);
  }

  // Pump() after a short while, by a thread of gRPC, unless a write is under way that will see to it. An engine that pumped would
  // spend its own time on serialization and system calls, and events that come within this while travel together.
  void PumpSoon() {
    if (writing_ || is_due_.exchange(true)) return;
    const std::lock_guard lock(mutex_);
    gathering_ = std::make_unique<grpc::Alarm>();  // a new one: the last may still be at its end
    gathering_->Set(std::chrono::system_clock::now() + kGathering, [call = this->weak_from_this()](bool /*rang*/) {
      const std::shared_ptr<StreamCall> self = call.lock();
      if (self == nullptr) return;
      self->is_due_ = false;
      self->Pump();
    });
  }

  void Pump() {
    const std::lock_guard lock(mutex_);
    if (writing_ || finished_) return;
    if (hung_up_) {
      if (!mailbox_.closed()) return;
      finished_ = true;
      return this->Finish(grpc::Status::CANCELLED);
    }
    switch (mailbox_.Next(event_)) {
      case EventMailbox::Got::kEvent:
        if (mailbox_.delivered()) {  // the last event and the status travel together
          finished_ = true;
          return this->StartWriteAndFinish(&event_, grpc::WriteOptions(), ToGrpc(mailbox_.status()));
        }
        writing_ = true;
        // While more events wait they travel together, gRPC sending what it holds with the last of them; but large ones at
        // once, so that the reader has one to unpack while the next is made.
        return this->StartWrite(&event_, mailbox_.has_more() && event_.ByteSizeLong() < kLargeBytes
                                             ? grpc::WriteOptions().set_buffer_hint()
                                             : grpc::WriteOptions());
      case EventMailbox::Got::kNothing:
        return;
      case EventMailbox::Got::kEnd:
        finished_ = true;
        return this->Finish(ToGrpc(mailbox_.status()));
    }
  }

  const CallEnvironment& environment_;
  grpc::CallbackServerContext& context_;  // gRPC's until OnDone()
  CallLifetime lifetime_;
  Mailbox mailbox_;

 private:
  // Short for who watches.
  static constexpr std::chrono::milliseconds kGathering{2};
  static constexpr std::size_t kLargeBytes = std::size_t{1} << 16;

  void Begin() {
    const absl::Status admitted = lifetime_.Admit(UserOf(environment_.access, context_));
    if (!admitted.ok()) return this->Finish(ToGrpc(admitted));
    // The worker starts when the headers are sent: before, gRPC has not taken the reactor over and a first
    // message could be lost.
    this->StartSendInitialMetadata();
  }

  void HangUp(StopCause cause) {
    lifetime_.Stop(cause);
    const std::lock_guard lock(mutex_);
    hung_up_ = true;
  }

  std::shared_ptr<StreamCall> self_;  // gRPC's share

  // Both are set free before the mailbox is asked again: who puts an event and finds one of them set knows that it will be seen.
  std::atomic<bool> writing_ = false;
  std::atomic<bool> is_due_ = false;  // Pump(), by `gathering_`

  std::mutex mutex_;  // guards what follows
  Event event_;       // in flight while `writing_`
  std::unique_ptr<grpc::Alarm> gathering_;
  bool hung_up_ = false;   // nobody reads any more
  bool finished_ = false;  // Finish() was called
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_STREAM_CALL_H_
