// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/rank_attempt.h"

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include "absl/status/status.h"
#include "fmt/format.h"
#include "grpcpp/security/server_credentials.h"
#include "grpcpp/server.h"
#include "grpcpp/server_builder.h"
#include "openssl/crypto.h"
#include "server/session/version.h"
#include "server/solve_jobs/rank_link.grpc.pb.h"
#include "server/solve_jobs/rank_messages.h"
#include "server/store/job.h"
#include "spdlog/spdlog.h"

namespace dlcs {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds kRankPollInterval{20};
// Ranks that still run this long after a request to stop, or after the end of the job was received, are ended.
constexpr milliseconds kStopTimeout{5000};
// Ranks are ended this long after one was lost. Until then a launcher that notices the loss can print the reason.
constexpr milliseconds kLauncherTimeout{1000};

using Stream = grpc::ServerReaderWriter<ranks::ToRanks, ranks::FromRanks>;

// Takes the same time for all texts of one length.
bool IsSame(const std::string& one, const std::string& other) {
  return one.size() == other.size() && CRYPTO_memcmp(one.data(), other.data(), one.size()) == 0;
}

// The service that the ranks of one attempt call. RunAttempt() uses a thread of gRPC; KeepAlive() uses none. The other
// functions are safe from any thread.
class RankService final : public ranks::RankLink::WithCallbackMethod_KeepAlive<ranks::RankLink::Service> {
 public:
  RankService(std::string secret, int ranks, ranks::Work work, jobs::JobRun& run)
      : secret_(std::move(secret)), ranks_(ranks), work_(std::move(work)), run_(run) {}

  grpc::Status RunAttempt(grpc::ServerContext* context, Stream* stream) override {
    ranks::FromRanks first;
    if (!stream->Read(&first) || !IsSame(first.hello().secret(), secret_)) {
      spdlog::warn("job {}: {} called its worker without the secret", run_.id(), context->peer());
      return {grpc::StatusCode::PERMISSION_DENIED, "this is not the secret of the attempt"};
    }
    {
      const std::lock_guard lock(mutex_);
      if (is_connected_) {
        spdlog::warn("job {}: {} called its worker although the first rank is connected", run_.id(), context->peer());
        return {grpc::StatusCode::PERMISSION_DENIED, "the first rank of the attempt is already here"};
      }
      is_connected_ = true;
    }
    if (const std::string why = MismatchOf(first.hello()); !why.empty()) {
      SetEnd(jobs::JobEnd{absl::FailedPreconditionError(why), ""});
      return {grpc::StatusCode::FAILED_PRECONDITION, why};
    }
    Serve(*stream);
    return grpc::Status::OK;
  }

  grpc::ServerBidiReactor<ranks::Hello, ranks::KeepAliveResponse>* KeepAlive(
      grpc::CallbackServerContext* context) override {
    return new KeepAliveCall(*this, context->peer());
  }

  // Requests the first rank to stop, as soon as it is connected. Does not wait for it.
  void Stop() {
    const std::lock_guard lock(mutex_);
    wants_stop_ = true;
    changed_.notify_one();
  }

  struct State {
    bool is_connected = false;  // the first rank has called
    std::optional<int> lost;    // the first one that disconnected or hung before it had done its part
    std::optional<jobs::JobEnd> end;
  };
  State state() const {
    const std::lock_guard lock(mutex_);
    return {is_connected_, lost_, end_};
  }

 private:
  // The KeepAlive() call of one rank. Deletes itself.
  class KeepAliveCall final : public grpc::ServerBidiReactor<ranks::Hello, ranks::KeepAliveResponse> {
   public:
    KeepAliveCall(RankService& service, std::string peer) : service_(service), peer_(std::move(peer)) {
      StartRead(&hello_);
    }

    void OnReadDone(bool ok) override {
      if (rank_) {
        if (!ok) service_.ReportLost(*rank_);
        Finish(grpc::Status::OK);
      } else if (ok && IsSame(hello_.secret(), service_.secret_)) {
        rank_ = hello_.rank();
        StartRead(&hello_);
      } else {
        spdlog::warn("job {}: {} called its worker without the secret", service_.run_.id(), peer_);
        Finish({grpc::StatusCode::PERMISSION_DENIED, "this is not the secret of the attempt"});
      }
    }
    void OnDone() override { delete this; }

   private:
    RankService& service_;
    const std::string peer_;
    ranks::Hello hello_;
    std::optional<int> rank_;  // set by the first Hello
  };

  // Why the ranks are not the requested ones; empty if they are.
  std::string MismatchOf(const ranks::Hello& hello) const {
    if (hello.version() != kVersion) {
      return fmt::format("The ranks are dlcs-mpi {}, and the worker is dlcsd {}.", hello.version(), kVersion);
    }
    if (hello.ranks() == ranks_ && hello.refusal().empty()) return "";
    return fmt::format("The launcher of this worker started a world that was not requested: {}.",
                       hello.refusal().empty() ? fmt::format("{} ranks", hello.ranks()) : hello.refusal());
  }

  // Exchanges messages with the first rank until it disconnects.
  void Serve(Stream& stream) {
    // A thread of its own, so that Stop() does not wait for a rank that does not read.
    std::jthread writer([&](const std::stop_token& disconnected) { SendMessages(stream, disconnected); });
    for (ranks::FromRanks message; stream.Read(&message);) {
      switch (message.kind_case()) {
        case ranks::FromRanks::kEvent:
          run_.Emit(static_cast<jobs::EventKind>(message.event().kind()),
                    std::move(*message.mutable_event()->mutable_payload()));
          break;
        case ranks::FromRanks::kWindow:
          run_.Accept(FromProto(std::move(*message.mutable_window())));
          break;
        case ranks::FromRanks::kEnd:
          SetEnd(FromProto(message.end()));
          break;
        default:
          break;
      }
      UpdateWantedDetail();
    }
    writer.request_stop();
    writer.join();
    ReportLost(0);
  }

  // Sends the work, and then a request to stop and changes of the wanted detail, until `disconnected` is requested.
  void SendMessages(Stream& stream, const std::stop_token& disconnected) {
    ranks::ToRanks message;
    *message.mutable_work() = std::move(work_);
    stream.Write(message);
    message.Clear();
    bool sent_stop = false;
    jobs::EventDetail sent_detail;
    std::unique_lock lock(mutex_);
    const auto has_news = [&] { return (wants_stop_ && !sent_stop) || wanted_ != sent_detail; };
    while (changed_.wait(lock, disconnected, has_news)) {
      if (wants_stop_ && !std::exchange(sent_stop, true)) {
        message.mutable_stop()->set_cause(static_cast<int>(run_.cause()));
      } else {
        sent_detail = wanted_;
        *message.mutable_detail() = dlcs::ToProto(sent_detail);
      }
      lock.unlock();
      stream.Write(message);
      lock.lock();
    }
  }

  // Called for each message, since the watchers of the job may change at any time.
  void UpdateWantedDetail() {
    const std::shared_ptr<const jobs::EventDetail> wanted = run_.WantedDetail();
    const std::lock_guard lock(mutex_);
    if (wanted_ == *wanted) return;
    wanted_ = *wanted;
    changed_.notify_one();
  }

  void SetEnd(jobs::JobEnd end) {
    const std::lock_guard lock(mutex_);
    if (!end_) end_ = std::move(end);
  }

  void ReportLost(int rank) {
    const std::lock_guard lock(mutex_);
    if (!lost_) lost_ = rank;
  }

  const std::string secret_;
  const int ranks_;
  ranks::Work work_;  // until it is sent
  jobs::JobRun& run_;

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  jobs::EventDetail wanted_;
  bool is_connected_ = false, wants_stop_ = false;
  std::optional<int> lost_;
  std::optional<jobs::JobEnd> end_;
};

// The gRPC server of one attempt.
class RankServer {
 public:
  // Listens on a free port of `address`. A rank that does not respond for `patience` is disconnected.
  RankServer(RankService& service, const std::string& address, milliseconds patience) {
    const bool is_v6 = address.find(':') != std::string::npos;
    const std::string name = is_v6 ? "[" + address + "]" : address;
    grpc::ServerBuilder builder;
    builder.SetMaxReceiveMessageSize(-1);
    // Sends a ping after half of it, and waits the other half for the response, also while a rank sends nothing.
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, static_cast<int>(patience.count() / 2));
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, static_cast<int>(patience.count() / 2));
    builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
    builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kRankPing_ms / 2);
    builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
    builder.AddListeningPort(name + ":0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(&service);
    server_ = builder.BuildAndStart();
    address_ = fmt::format("{}:{}", name, port_);
  }
  ~RankServer() { Close(); }
  RankServer(const RankServer&) = delete;
  RankServer& operator=(const RankServer&) = delete;

  bool is_open() const { return server_ != nullptr && port_ > 0; }
  const std::string& address() const { return address_; }
  // Ends all calls. When it returns, no function of the service is running.
  void Close() {
    if (server_) server_->Shutdown(std::chrono::system_clock::now());
    server_.reset();
  }

 private:
  int port_ = 0;
  std::string address_;
  std::unique_ptr<grpc::Server> server_;
};

void EmitLog(const std::string& text, jobs::JobRun& run) {
  v1::SolveEvent event;
  event.set_log(text);
  run.Emit(jobs::EventKind::kLog, event.SerializeAsString());
}

// The end of an attempt whose ranks sent none: the launcher has ended, or a rank was lost.
jobs::JobEnd EndOfLostRanks(const RankLauncher& launcher, const RankService::State& state, jobs::JobRun& run) {
  const std::string how = launcher.HowItEnded();
  if (!state.is_connected && !state.lost && !launcher.WasKilled()) {
    return {absl::FailedPreconditionError(
                fmt::format("The launcher of this worker {} before its first rank had connected.", how)),
            ""};
  }
  const std::string lost = state.lost ? fmt::format("rank {} was lost first; ", *state.lost) : "";
  const std::string text = fmt::format("The ranks of this attempt broke down: {}the launcher {}.", lost, how);
  spdlog::warn("job {}: {}", run.id(), text);
  EmitLog(text, run);
  return {absl::AbortedError(text), ""};
}

}  // namespace

jobs::JobEnd SolveOnRanks(const RankSettings& settings, v1::SolveRequest request, EarlierAttempts earlier,
                          std::chrono::milliseconds checkpoint_every, const SessionLimits& limits, jobs::JobRun& run) {
  const int ranks = request.options().ranks();
  v1::SolveOptions& options = *request.mutable_options();
  options.clear_ranks();
  options.set_threads(options.threads() == 0 ? 1 : AllowedThreads(options.threads(), limits));
  ranks::Work work;
  *work.mutable_request() = std::move(request);
  AddEarlier(earlier, work);
  earlier = {};
  work.set_checkpoint_ms(checkpoint_every.count());
  work.set_max_memory_bytes(limits.max_memory_bytes);

  constexpr auto kMostBytes = static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max());
  if (const std::size_t bytes = work.ByteSizeLong(); bytes > kMostBytes) {
    return {absl::ResourceExhaustedError(
                fmt::format("The problem and the trajectory so far have {} bytes; a message to the ranks must have at "
                            "most {}. Ask for fewer output times.",
                            bytes, kMostBytes)),
            ""};
  }

  const std::string secret = jobs::NewJobId();  // 128 random bits
  RankService service(secret, ranks, std::move(work), run);
  RankServer server(service, settings.host, settings.patience);
  if (!server.is_open()) {
    return {absl::FailedPreconditionError(
                fmt::format("This worker cannot listen on --mpi-host {} for its ranks.", settings.host)),
            ""};
  }
  const auto launcher = RankLauncher::Start(
      settings, ranks, {{kWorkerVariable, server.address()}, {kSecretVariable, secret}}, "job " + run.id());
  if (!launcher.ok()) return {launcher.status(), ""};

  std::optional<steady_clock::time_point> until;  // ranks that still run then are ended
  bool was_stopped = false;
  while (!(*launcher)->Wait(kRankPollInterval) && (!until || steady_clock::now() < *until)) {
    if (run.stop().stop_requested() && !std::exchange(was_stopped, true)) service.Stop();
    if (until) continue;
    if (const RankService::State state = service.state(); was_stopped || state.end) {
      until = steady_clock::now() + kStopTimeout;
    } else if (state.lost) {
      until = steady_clock::now() + kLauncherTimeout;
    }
  }
  const RankService::State before = service.state();  // End() disconnects all ranks
  (*launcher)->End();
  server.Close();
  if (const RankService::State state = service.state(); state.end) {
    return *state.end;
  } else if (run.stop().stop_requested()) {
    return {absl::CancelledError(), ""};
  } else {
    return EndOfLostRanks(**launcher, {state.is_connected, before.lost, {}}, run);
  }
}

}  // namespace dlcs
