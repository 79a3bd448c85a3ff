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

constexpr milliseconds kLookAtRanks{20};
// From a request to stop, or from the end of the conversation, to the end of the ranks.
constexpr milliseconds kPatienceWithRanks{5000};
// From when a rank was missed to the end of the others: a launcher that misses it too says more about it.
constexpr milliseconds kPatienceWithLauncher{1000};

using Stream = grpc::ServerReaderWriter<ranks::ToRanks, ranks::FromRanks>;

bool IsSame(const std::string& one, const std::string& other) {
  return one.size() == other.size() && CRYPTO_memcmp(one.data(), other.data(), one.size()) == 0;
}

// The conversation with the first rank, on a thread of gRPC, and the presence of the others, which takes no thread.
// Other functions from any thread.
class RankHost final : public ranks::RankLink::WithCallbackMethod_Stay<ranks::RankLink::Service> {
 public:
  RankHost(std::string secret, int ranks, ranks::Work work, jobs::JobRun& run)
      : secret_(std::move(secret)), ranks_(ranks), work_(std::move(work)), run_(run) {}

  grpc::Status Attend(grpc::ServerContext* context, Stream* stream) override {
    ranks::FromRanks first;
    if (!stream->Read(&first) || !IsSame(first.hello().secret(), secret_)) {
      spdlog::warn("job {}: {} called its worker without the secret", run_.id(), context->peer());
      return {grpc::StatusCode::PERMISSION_DENIED, "this is not the secret of the attempt"};
    }
    {
      const std::lock_guard lock(mutex_);
      if (has_come_) {
        spdlog::warn("job {}: {} called its worker where the first rank is already", run_.id(), context->peer());
        return {grpc::StatusCode::PERMISSION_DENIED, "the first rank of the attempt is already here"};
      }
      has_come_ = true;
    }
    if (const std::string why = WhyNot(first.hello()); !why.empty()) {
      Conclude(jobs::JobEnd{absl::FailedPreconditionError(why), ""});
      return {grpc::StatusCode::FAILED_PRECONDITION, why};
    }
    Converse(*stream);
    return grpc::Status::OK;
  }

  grpc::ServerBidiReactor<ranks::Hello, ranks::Goodbye>* Stay(grpc::CallbackServerContext* context) override {
    return new Guest(*this, context->peer());
  }

  // Tells the first rank to stop, once it is there. Does not wait for it.
  void Stop() {
    const std::lock_guard lock(mutex_);
    wants_stop_ = true;
    to_tell_.notify_one();
  }

  struct State {
    bool has_come = false;      // the first rank
    std::optional<int> missed;  // the first that went, or stood still, before it had done its part
    std::optional<jobs::JobEnd> end;
  };
  State state() const {
    const std::lock_guard lock(mutex_);
    return {has_come_, missed_, end_};
  }

 private:
  // A rank that is not the first. Deletes itself.
  class Guest final : public grpc::ServerBidiReactor<ranks::Hello, ranks::Goodbye> {
   public:
    Guest(RankHost& host, std::string peer) : host_(host), peer_(std::move(peer)) { StartRead(&hello_); }

    void OnReadDone(bool ok) override {
      if (rank_) {
        if (!ok) host_.Miss(*rank_);
        Finish(grpc::Status::OK);
      } else if (ok && IsSame(hello_.secret(), host_.secret_)) {
        rank_ = hello_.rank();
        StartRead(&hello_);
      } else {
        spdlog::warn("job {}: {} called its worker without the secret", host_.run_.id(), peer_);
        Finish({grpc::StatusCode::PERMISSION_DENIED, "this is not the secret of the attempt"});
      }
    }
    void OnDone() override { delete this; }

   private:
    RankHost& host_;
    const std::string peer_;
    ranks::Hello hello_;
    std::optional<int> rank_;  // once it is known
  };

  std::string WhyNot(const ranks::Hello& hello) const {
    if (hello.version() != kVersion) {
      return fmt::format("The ranks are dlcs-mpi {}, and the worker is dlcsd {}.", hello.version(), kVersion);
    }
    if (hello.ranks() == ranks_ && hello.refusal().empty()) return "";
    return fmt::format("The launcher of this worker started another world than it was asked for: {}.",
                       hello.refusal().empty() ? fmt::format("{} ranks", hello.ranks()) : hello.refusal());
  }

  void Converse(Stream& stream) {
    // Whoever asks to stop must not wait for a rank that does not read.
    std::jthread writer([&](const std::stop_token& is_over) { Tell(stream, is_over); });
    for (ranks::FromRanks said; stream.Read(&said);) {
      switch (said.kind_case()) {
        case ranks::FromRanks::kEvent:
          run_.Emit(static_cast<jobs::EventKind>(said.event().kind()),
                    std::move(*said.mutable_event()->mutable_payload()));
          break;
        case ranks::FromRanks::kWindow:
          run_.Accept(FromProto(std::move(*said.mutable_window())));
          break;
        case ranks::FromRanks::kEnd:
          Conclude(FromProto(said.end()));
          break;
        default:
          break;
      }
      LookWhatIsWanted();
    }
    writer.request_stop();
    writer.join();
    Miss(0);
  }

  // The work, and then what comes up.
  void Tell(Stream& stream, const std::stop_token& is_over) {
    ranks::ToRanks message;
    *message.mutable_work() = std::move(work_);
    stream.Write(message);
    message.Clear();
    bool told_stop = false;
    jobs::EventDetail told_detail;
    std::unique_lock lock(mutex_);
    const auto has_news = [&] { return (wants_stop_ && !told_stop) || wanted_ != told_detail; };
    while (to_tell_.wait(lock, is_over, has_news)) {
      if (wants_stop_ && !std::exchange(told_stop, true)) {
        message.mutable_stop()->set_cause(static_cast<int>(run_.cause()));
      } else {
        told_detail = wanted_;
        *message.mutable_detail() = dlcs::ToProto(told_detail);
      }
      lock.unlock();
      stream.Write(message);
      lock.lock();
    }
  }

  // Looked at with each event: watchers come and go.
  void LookWhatIsWanted() {
    const std::shared_ptr<const jobs::EventDetail> wanted = run_.WantedDetail();
    const std::lock_guard lock(mutex_);
    if (wanted_ == *wanted) return;
    wanted_ = *wanted;
    to_tell_.notify_one();
  }

  void Conclude(jobs::JobEnd end) {
    const std::lock_guard lock(mutex_);
    if (!end_) end_ = std::move(end);
  }

  void Miss(int rank) {
    const std::lock_guard lock(mutex_);
    if (!missed_) missed_ = rank;
  }

  const std::string secret_;
  const int ranks_;
  ranks::Work work_;  // until it is sent
  jobs::JobRun& run_;

  mutable std::mutex mutex_;
  std::condition_variable_any to_tell_;
  jobs::EventDetail wanted_;
  bool has_come_ = false, wants_stop_ = false;
  std::optional<int> missed_;
  std::optional<jobs::JobEnd> end_;
};

// The server of one attempt.
class RankPort {
 public:
  // Listens on `address`, and looks for signs of life of all who call within `patience`.
  RankPort(RankHost& host, const std::string& address, milliseconds patience) {
    const bool is_v6 = address.find(':') != std::string::npos;
    const std::string name = is_v6 ? "[" + address + "]" : address;
    grpc::ServerBuilder builder;
    builder.SetMaxReceiveMessageSize(-1);
    // Asked after half of it, and missed after the other half, however long ranks have nothing to say.
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, static_cast<int>(patience.count() / 2));
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, static_cast<int>(patience.count() / 2));
    builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
    builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kRankPing_ms / 2);
    builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
    builder.AddListeningPort(name + ":0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(&host);
    server_ = builder.BuildAndStart();
    address_ = fmt::format("{}:{}", name, port_);
  }
  ~RankPort() { Close(); }
  RankPort(const RankPort&) = delete;
  RankPort& operator=(const RankPort&) = delete;

  bool is_open() const { return server_ != nullptr && port_ > 0; }
  const std::string& address() const { return address_; }
  // Ends the conversation. Nothing of the host runs any more when it returns.
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

// Why there is no end: the launcher has ended, or a rank is missed.
jobs::JobEnd BrokenOff(const RankLauncher& launcher, const RankHost::State& state, jobs::JobRun& run) {
  const std::string how = launcher.HowItEnded();
  if (!state.has_come && !state.missed && !launcher.WasKilled()) {
    return {absl::FailedPreconditionError(
                fmt::format("The launcher of this worker {} before its first rank was there.", how)),
            ""};
  }
  const std::string missed = state.missed ? fmt::format("rank {} was missed first; ", *state.missed) : "";
  const std::string text = fmt::format("The ranks of this attempt broke down: {}the launcher {}.", missed, how);
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
  RankHost host(secret, ranks, std::move(work), run);
  RankPort port(host, settings.host, settings.patience);
  if (!port.is_open()) {
    return {absl::FailedPreconditionError(
                fmt::format("This worker cannot listen on --mpi-host {} for its ranks.", settings.host)),
            ""};
  }
  const auto launcher = RankLauncher::Start(
      settings, ranks, {{kWorkerVariable, port.address()}, {kSecretVariable, secret}}, "job " + run.id());
  if (!launcher.ok()) return {launcher.status(), ""};

  std::optional<steady_clock::time_point> until;  // then they are ended
  bool told_to_stop = false;
  while (!(*launcher)->Wait(kLookAtRanks) && (!until || steady_clock::now() < *until)) {
    if (run.stop().stop_requested() && !std::exchange(told_to_stop, true)) host.Stop();
    if (until) continue;
    if (const RankHost::State state = host.state(); told_to_stop || state.end) {
      until = steady_clock::now() + kPatienceWithRanks;
    } else if (state.missed) {
      until = steady_clock::now() + kPatienceWithLauncher;
    }
  }
  const RankHost::State before = host.state();  // its end takes all ranks along
  (*launcher)->End();
  port.Close();
  if (const RankHost::State state = host.state(); state.end) {
    return *state.end;
  } else if (run.stop().stop_requested()) {
    return {absl::CancelledError(), ""};
  } else {
    return BrokenOff(**launcher, {state.has_come, before.missed, {}}, run);
  }
}

}  // namespace dlcs
