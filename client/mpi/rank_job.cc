// SPDX-License-Identifier: Apache-2.0
#include "client/mpi/rank_job.h"

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

// The process is ended if the solve has not stopped this long after the worker was lost.
constexpr std::chrono::seconds kStopTimeout{10};

// Returns the value of a variable and unsets it, so that child processes do not inherit a secret.
std::string TakeVariable(const char* name) {
  const char* const value = std::getenv(name);
  std::string text = value == nullptr ? "" : value;
  unsetenv(name);
  return text;
}

// Why a rank does not know its worker.
std::string NoWorker(int rank) {
  return fmt::format(
      "dlcs-mpi: rank {} has no {} in its environment; ranks that dlcsd --mpi-launcher starts have it, and on other "
      "machines if the launcher passes it on: mpirun -x {} -x {}\n",
      rank, kWorkerVariable, kWorkerVariable, kSecretVariable);
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

// Ends this process as soon as its parent, the launcher or its daemon on this machine, has ended. A launcher that was
// killed cannot end its ranks, and another attempt repeats their work. Does nothing on a system without pidfd.
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

// Keeps a stream to the worker open, on every rank but the first, so that the worker notices if the rank is lost or
// hangs.
class KeepAliveStream {
 public:
  explicit KeepAliveStream(int rank) {
    hello_.set_rank(rank);
    hello_.set_secret(TakeVariable(kSecretVariable));
    worker_ = TakeVariable(kWorkerVariable);
    stub_ = ranks::RankLink::NewStub(ConnectTo(worker_));
    thread_ = std::thread([this] { Run(); });
  }
  // Reports to the worker that this rank has done its part.
  ~KeepAliveStream() {
    {
      const std::lock_guard lock(mutex_);
      is_closing_ = true;
      if (is_open_) {
        stream_->Write(hello_);
        stream_->WritesDone();
      } else {
        context_.TryCancel();  // Run() may still wait for the connection
      }
    }
    thread_.join();
  }
  KeepAliveStream(const KeepAliveStream&) = delete;
  KeepAliveStream& operator=(const KeepAliveStream&) = delete;

 private:
  void Run() {
    if (worker_.empty()) {
      fmt::print(stderr, "{}", NoWorker(hello_.rank()));
      return;
    }
    stream_ = stub_->KeepAlive(&context_);
    const bool was_sent = stream_->Write(hello_);
    {
      const std::lock_guard lock(mutex_);
      is_open_ = was_sent;
      if (!was_sent && !is_closing_) {
        fmt::print(stderr, "dlcs-mpi: rank {} cannot reach its worker, {}, which will not notice if the rank hangs\n",
                   hello_.rank(), worker_);
      }
    }
    // Without a pending read, gRPC would respond to the worker's pings only every five seconds.
    for (ranks::KeepAliveResponse none; stream_->Read(&none);) continue;
    stream_->Finish().IgnoreError();
  }

  ranks::Hello hello_;
  std::string worker_;
  std::unique_ptr<ranks::RankLink::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<ranks::Hello, ranks::KeepAliveResponse>> stream_;
  std::mutex mutex_;
  bool is_open_ = false, is_closing_ = false;
  std::thread thread_;
};

// The connection of the first rank to its worker. The functions of AttemptSink are for the thread that solves.
class WorkerClient final : public AttemptSink {
 public:
  WorkerClient() : worker_(TakeVariable(kWorkerVariable)), stub_(ranks::RankLink::NewStub(ConnectTo(worker_))) {}
  // Close().
  ~WorkerClient() override { Close(); }

  // Returns the work in serialized form; empty if there is none, and then the reason is on standard error.
  std::string ReceiveWork(int ranks, const std::string& refusal) {
    if (worker_.empty()) {
      fmt::print(stderr, "{}", NoWorker(0));
      return "";
    }
    stream_ = stub_->RunAttempt(&context_);
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
    reader_ = std::thread([this] { ReadMessages(); });
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

  // Sends the end of the job. Returns whether the worker has received it.
  bool SendEnd(const jobs::JobEnd& end) {
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
  // Runs on a thread of its own.
  void ReadMessages() {
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
    std::fputs("dlcs-mpi: the connection to the worker is lost\n", stderr);
    cause_ = jobs::StopCause::kLeaseLost;
    stop_.request_stop();
    if (ended_.wait_for(lock, kStopTimeout, [this] { return has_ended_; })) return;
    // The launcher then ends the other ranks.
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

  const std::string worker_;
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

// Called by all ranks with the same `work`. `sink` is null on every rank but the first.
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

// Solve() with exceptions turned into a status. The worker receives that of the first rank; all are printed.
jobs::JobEnd SolveAndCatch(ranks::Work work, int rank, AttemptSink* sink, std::stop_token stop) {
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

void LogIfNothingWasShared(const MpiVolume& before, AttemptSink& sink) {
  if (VolumeOfMpi().SharesMoreThan(before)) return;
  v1::SolveEvent event;
  event.set_log(
      "every rank did the same work, since this solve has no part that ranks share; the propagators contour and "
      "iterative-stepping have");
  sink.Emit(jobs::EventKind::kLog, event.SerializeAsString());
}

}  // namespace

int RunRankJob(MpiWorld& world, const std::string& refusal) {
  EndWithLauncher();
  std::unique_ptr<WorkerClient> worker;
  std::optional<KeepAliveStream> keep_alive;
  if (world.rank() == 0) {
    worker = std::make_unique<WorkerClient>();
  } else if (refusal.empty()) {
    keep_alive.emplace(world.rank());
  }
  std::string text = world.OfFirst(worker ? worker->ReceiveWork(world.size(), refusal) : "");
  if (text.empty()) return refusal.empty() ? kServiceFailed : kBadInput;
  ranks::Work work;
  const bool is_sound = work.ParseFromString(text);
  text = {};
  if (!is_sound) return kServiceFailed;

  const MpiVolume before = VolumeOfMpi();
  const std::stop_token stop = world.Agreed(worker ? worker->stop() : std::stop_token());
  const jobs::JobEnd end = SolveAndCatch(std::move(work), world.rank(), worker.get(), stop);
  if (worker && end.status.ok() && world.size() > 1) LogIfNothingWasShared(before, *worker);
  const bool was_delivered = !worker || worker->SendEnd(end);
  return was_delivered && (end.status.ok() || absl::IsCancelled(end.status)) ? kSolved : kServiceFailed;
}

}  // namespace dlcs::client
