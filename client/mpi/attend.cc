// SPDX-License-Identifier: Apache-2.0
#include "client/mpi/attend.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>

#include "client/cli/output/exit_code.h"
#include "core/mpi/mpi_volume.h"
#include "grpcpp/channel.h"
#include "grpcpp/create_channel.h"
#include "grpcpp/security/credentials.h"
#include "server/session/version.h"
#include "server/solve_jobs/rank_launcher.h"
#include "server/solve_jobs/rank_link.grpc.pb.h"
#include "server/solve_jobs/rank_messages.h"
#include "server/solve_jobs/solve_attempt.h"

namespace dlcs::client {
namespace {

// From the loss of the worker to the end of ranks that do not stop by themselves.
constexpr std::chrono::seconds kPatience{10};

// The value of a variable that nothing else is to see.
std::string TakeVariable(const char* name) {
  const char* const value = std::getenv(name);
  std::string text = value == nullptr ? "" : value;
  unsetenv(name);
  return text;
}

std::shared_ptr<grpc::Channel> ConnectTo(const std::string& worker) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kRankPing_ms);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kRankPing_ms);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  return grpc::CreateCustomChannel(worker, grpc::InsecureChannelCredentials(), arguments);
}

// Ends this process as soon as its parent, the launcher or its daemon on this machine, has ended. A launcher that is
// killed cannot end its ranks, whose work another attempt does again. Does nothing where the system has no pidfd.
void EndWithLauncher() {
  const pid_t parent = getppid();
  // The header for it in glibc 2.36 is not for C++.
  const int launcher = static_cast<int>(syscall(SYS_pidfd_open, parent, 0));
  if (launcher < 0) return;
  if (getppid() != parent) _exit(kServiceFailed);
  std::thread([launcher] {
    pollfd has_ended{.fd = launcher, .events = POLLIN, .revents = 0};
    while (poll(&has_ended, 1, /*timeout=*/-1) < 0 && errno == EINTR) continue;
    _exit(kServiceFailed);
  }).detach();
}

// What another rank than the first has with the worker, which misses it if it is lost or stands still.
class Presence {
 public:
  explicit Presence(int rank) {
    hello_.set_rank(rank);
    hello_.set_secret(TakeVariable(kSecretVariable));
    worker_ = TakeVariable(kWorkerVariable);
    stub_ = ranks::RankLink::NewStub(ConnectTo(worker_));
    thread_ = std::thread([this] { Come(); });
  }
  // Says that this rank has done its part.
  ~Presence() {
    {
      const std::lock_guard lock(mutex_);
      is_leaving_ = true;
      if (has_come_) {
        stream_->Write(hello_);
        stream_->WritesDone();
      } else {
        context_.TryCancel();  // it may still wait for an answer of the network
      }
    }
    thread_.join();
  }
  Presence(const Presence&) = delete;
  Presence& operator=(const Presence&) = delete;

 private:
  void Come() {
    stream_ = stub_->Stay(&context_);
    const bool was_heard = stream_->Write(hello_);
    {
      const std::lock_guard lock(mutex_);
      has_come_ = was_heard;
      if (!was_heard && !is_leaving_) {
        fmt::print(stderr, "dlcs-mpi: rank {} does not reach its worker, {}, which will not miss it if it hangs\n",
                   hello_.rank(), worker_);
      }
    }
    // The worker's probes are answered at once where somebody waits for the worker, and every five seconds elsewhere.
    for (ranks::Goodbye goodbye; stream_->Read(&goodbye);) continue;
    stream_->Finish().IgnoreError();
  }

  ranks::Hello hello_;
  std::string worker_;
  std::unique_ptr<ranks::RankLink::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<ranks::Hello, ranks::Goodbye>> stream_;
  std::mutex mutex_;
  bool has_come_ = false, is_leaving_ = false;
  std::thread thread_;
};

// The first rank's end of the conversation. The sink is for the thread that solves.
class WorkerLink final : public AttemptSink {
 public:
  WorkerLink() : stub_(ranks::RankLink::NewStub(ConnectTo(TakeVariable(kWorkerVariable)))) {}
  // Close().
  ~WorkerLink() override { Close(); }

  // The work, serialized; empty if there is none, and then standard error has the reason.
  std::string Receive(int ranks, const std::string& refusal) {
    stream_ = stub_->Attend(&context_);
    ranks::FromRanks hello;
    hello.mutable_hello()->set_secret(TakeVariable(kSecretVariable));
    hello.mutable_hello()->set_ranks(ranks);
    hello.mutable_hello()->set_refusal(refusal);
    hello.mutable_hello()->set_version(kVersion);
    ranks::ToRanks first;
    if (!stream_->Write(hello) || !stream_->Read(&first) || !first.has_work()) {
      fmt::print(stderr, "dlcs-mpi: no work from the worker: {}\n", Close().error_message());
      return "";
    }
    reader_ = std::thread([this] { Listen(); });
    return first.work().SerializeAsString();
  }

  void Emit(jobs::EventKind kind, std::string payload) override {
    ranks::FromRanks message;
    message.mutable_event()->set_kind(static_cast<int>(kind));
    message.mutable_event()->set_payload(std::move(payload));
    stream_->Write(message);
  }
  void Accept(jobs::AcceptedWindow window) override {
    ranks::FromRanks message;
    *message.mutable_window() = ToProto(std::move(window));
    stream_->Write(message);
  }
  std::shared_ptr<const jobs::EventDetail> WantedDetail() override {
    const std::lock_guard lock(mutex_);
    return wanted_;
  }
  jobs::StopCause cause() const override { return cause_; }
  std::stop_token stop() const { return stop_.get_token(); }

  // Returns whether the worker has got it.
  bool End(const jobs::JobEnd& end) {
    ranks::FromRanks message;
    *message.mutable_end() = ToProto(end);
    {
      const std::lock_guard lock(mutex_);
      has_ended_ = true;
    }
    ended_.notify_all();
    stream_->Write(message);
    return Close().ok();
  }

 private:
  // On a thread of its own.
  void Listen() {
    for (ranks::ToRanks message; stream_->Read(&message);) {
      if (message.has_detail()) {
        const std::lock_guard lock(mutex_);
        wanted_ = std::make_shared<const jobs::EventDetail>(FromProto(message.detail()));
      } else if (message.has_stop()) {
        cause_ = static_cast<jobs::StopCause>(message.stop().cause());
        stop_.request_stop();
      }
    }
    std::unique_lock lock(mutex_);
    if (has_ended_) return;
    std::fputs("dlcs-mpi: the worker is gone\n", stderr);
    cause_ = jobs::StopCause::kLeaseLost;
    stop_.request_stop();
    if (ended_.wait_for(lock, kPatience, [this] { return has_ended_; })) return;
    // The launcher ends the others.
    _exit(kServiceFailed);
  }

  grpc::Status Close() {
    if (!stream_) return status_;
    stream_->WritesDone();
    if (reader_.joinable()) {
      reader_.join();
    } else {
      for (ranks::ToRanks rest; stream_->Read(&rest);) continue;
    }
    status_ = stream_->Finish();
    stream_.reset();
    return status_;
  }

  const std::unique_ptr<ranks::RankLink::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<ranks::FromRanks, ranks::ToRanks>> stream_;
  grpc::Status status_;
  std::thread reader_;
  std::stop_source stop_;
  std::atomic<jobs::StopCause> cause_ = jobs::StopCause::kNone;

  std::mutex mutex_;
  std::condition_variable ended_;
  bool has_ended_ = false;
  std::shared_ptr<const jobs::EventDetail> wanted_ = std::make_shared<const jobs::EventDetail>();
};

// The same on all ranks; `sink` is that of the first one, and null on others.
jobs::JobEnd Solve(ranks::Work work, AttemptSink* sink, std::stop_token stop) {
  SessionLimits limits;
  limits.max_memory_bytes = work.max_memory_bytes();
  absl::StatusOr<PreparedSolve> prepared = PrepareSolve(work.request(), limits);
  if (!prepared.ok()) return {prepared.status(), ""};
  work.clear_request();
  absl::StatusOr<EarlierAttempts> earlier = EarlierIn(work, prepared->num_states(), prepared->num_constraints());
  if (!earlier.ok()) return {earlier.status(), ""};
  const std::chrono::milliseconds checkpoint_every(work.checkpoint_ms());
  work.Clear();
  return SolveAttempt(*prepared, *std::move(earlier), sink, std::move(stop), nullptr, checkpoint_every);
}

// Solve(), of which nothing is thrown: the worker hears of what happens to the first rank, and the log of others.
jobs::JobEnd SolveOrSay(ranks::Work work, int rank, AttemptSink* sink, std::stop_token stop) {
  absl::Status thrown;
  try {
    return Solve(std::move(work), sink, std::move(stop));
  } catch (const std::bad_alloc&) {
    thrown = absl::ResourceExhaustedError("A rank is out of memory: ask for fewer output times.");
  } catch (const std::exception& error) {
    thrown = absl::InternalError(error.what());
  }
  fmt::print(stderr, "dlcs-mpi: rank {}: {}\n", rank, std::string(thrown.message()));
  return {thrown, ""};
}

void SayIfNothingWasShared(const MpiVolume& before, AttemptSink& sink) {
  const MpiVolume& now = VolumeOfMpi();
  if (now.messages + now.broadcasts > before.messages + before.broadcasts) return;
  v1::SolveEvent event;
  event.set_log(
      "every rank did the same work, since this solve has no part that ranks share; the propagators contour and "
      "iterative-stepping have");
  sink.Emit(jobs::EventKind::kLog, event.SerializeAsString());
}

}  // namespace

int Attend(MpiWorld& world, const std::string& refusal) {
  EndWithLauncher();
  std::unique_ptr<WorkerLink> link;
  std::optional<Presence> presence;
  if (world.rank() == 0) {
    link = std::make_unique<WorkerLink>();
  } else if (refusal.empty()) {
    presence.emplace(world.rank());
  }
  std::string text = world.OfFirst(link ? link->Receive(world.size(), refusal) : "");
  if (text.empty()) return refusal.empty() ? kServiceFailed : kBadInput;
  ranks::Work work;
  const bool is_sound = work.ParseFromString(text);
  text = {};
  if (!is_sound) return kServiceFailed;

  const MpiVolume before = VolumeOfMpi();
  const std::stop_token stop = world.Agreed(link ? link->stop() : std::stop_token());
  const jobs::JobEnd end = SolveOrSay(std::move(work), world.rank(), link.get(), stop);
  if (link && end.status.ok() && world.size() > 1) SayIfNothingWasShared(before, *link);
  const bool was_told = !link || link->End(end);
  return was_told && (end.status.ok() || absl::IsCancelled(end.status)) ? kSolved : kServiceFailed;
}

}  // namespace dlcs::client
