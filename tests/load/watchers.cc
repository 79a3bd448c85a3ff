// SPDX-License-Identifier: Apache-2.0
// Measures one solve with many watchers, some of which do not read.

#include <signal.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "client/rpc/client.h"
#include "core/solve.h"
#include "grpcpp/create_channel.h"
#include "grpcpp/security/credentials.h"
#include "server/wire/convert.h"
#include "tests/load/percentiles.h"
#include "tests/load/process_meter.h"
#include "tests/load/questions.h"
#include "tests/load/stop_cases.h"
#include "tests/server/dlcsd_process.h"
#include "tests/server/solve_jobs/job_events.h"
#include "tests/server/store/temporary_folder.h"

namespace dlcs::load {
namespace {

using std::chrono::duration;
using std::chrono::milliseconds;
using std::chrono::steady_clock;
using std::chrono::system_clock;

// The event rates of a solve.
class Counter final : public Observer {
 public:
  void OnIterate(const IterateReport&, const IterateValues&) override { ++iterates; }
  void OnWindowFinished(const WindowOutcome&) override {
    last = steady_clock::now();
    if (windows++ == 0) first = last;
  }
  double iterates = 0, windows = 0;
  steady_clock::time_point first, last;
};

struct Rates {
  double iterates = 0;  // a second
  double windows = 0;   // of one step each
};

StopCase OneStepWindows(Index pairs, Index steps) {
  StopCase chatty{"", LongProblemOfPairs(pairs), {}};
  chatty.options.method = Method::kLaplaceIteration;
  chatty.options.window_steps = 1;
  chatty.options.num_steps = steps;
  chatty.options.num_threads = 1;
  chatty.options.output_times = {chatty.problem.horizon};
  chatty.options.output_times_only = true;
  return chatty;
}

Rates RatesOf(Index pairs) {
  const StopCase chatty = OneStepWindows(pairs, 1'000'000);
  std::stop_source stop;
  const std::jthread stopper([&stop] {
    std::this_thread::sleep_for(milliseconds(700));
    stop.request_stop();
  });
  Counter counter;
  Solve(chatty.problem, chatty.options, counter, stop.get_token()).IgnoreError();
  const double seconds = std::max(1e-3, duration<double>(counter.last - counter.first).count());
  return {counter.iterates / seconds, counter.windows / seconds};
}

// The request of a solve that reports about `rate` iterates per second, for `seconds`, on this machine.
v1::SolveRequest RequestOf(double rate, double seconds) {
  Index pairs = 4;
  Rates rates = RatesOf(pairs);
  while (rates.iterates > 1.3 * rate && pairs < 1000) {
    pairs += std::max<Index>(4, pairs / 4);
    rates = RatesOf(pairs);
  }
  const StopCase chatty = OneStepWindows(pairs, std::max<Index>(10, static_cast<Index>(rates.windows * seconds)));
  std::printf("  %ld pairs: %.0f iterates a second\n", static_cast<long>(pairs), rates.iterates);
  v1::SolveRequest request;
  *request.mutable_problem() = ToProto(chatty.problem);
  *request.mutable_options() = ToProto(chatty.options);
  request.mutable_options()->set_estimate_error(false);  // what is watched is one solve
  return request;
}

// A client with a connection of its own, which reads at once or not before Read().
class StallableReader final : public grpc::ClientReadReactor<v1::SolveEvent> {
 public:
  StallableReader(const std::string& address, const std::string& job, int interval_ms, bool is_stalled)
      : begin_(system_clock::now()) {
    grpc::ChannelArguments settings;
    settings.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    // As client/rpc/connection.cc sets them.
    settings.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
    settings.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 256 << 10);
    stub_ = v1::JobService::NewStub(grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), settings));
    request_.set_name(job);
    request_.mutable_min_interval()->set_nanos(interval_ms * 1'000'000);
    stub_->async()->WatchSolveJob(&context_, &request_, this);
    if (is_stalled) AddHold();
    StartCall();
    if (!is_stalled) StartRead(&event_);
  }

  // Ends the stall.
  void Read() {
    StartRead(&event_);
    RemoveHold();
  }

  void OnReadDone(bool ok) override {
    if (!ok) return;
    const auto now = system_clock::now();
    const auto& stamp = event_.time();
    const system_clock::time_point time(std::chrono::duration_cast<system_clock::duration>(
        std::chrono::seconds(stamp.seconds()) + std::chrono::nanoseconds(stamp.nanos())));
    // Events from before the watch are old, and gaps and heartbeats are made for the watcher: neither counts.
    if (!event_.has_gap() && !event_.has_heartbeat() && time > begin_) {
      ages_ms_.push_back(duration<double, std::milli>(now - time).count());
    }
    events_.push_back(std::move(event_));
    event_.Clear();
    StartRead(&event_);
  }
  void OnDone(const grpc::Status& status) override {
    const std::lock_guard lock(mutex_);
    status_ = status;
    is_done_ = true;
    done_.notify_all();
  }

  // Waits for the end. Returns what is wrong with the received events, or an empty text.
  std::string End() {
    std::unique_lock lock(mutex_);
    done_.wait(lock, [this] { return is_done_; });
    if (!status_.ok()) return status_.error_message();
    return testing::WhatIsWrongWithJobEvents(events_);
  }
  const std::vector<double>& ages_ms() const { return ages_ms_; }
  std::size_t num_events() const { return events_.size(); }

 private:
  const system_clock::time_point begin_;
  std::unique_ptr<v1::JobService::Stub> stub_;
  grpc::ClientContext context_;
  v1::WatchSolveJobRequest request_;
  v1::SolveEvent event_;
  std::vector<v1::SolveEvent> events_;
  std::vector<double> ages_ms_;
  std::mutex mutex_;
  std::condition_variable done_;
  bool is_done_ = false;
  grpc::Status status_;
};

bool IsOver(client::JobClient& client, const std::string& job) {
  const auto now = client.Get(job, {});
  return !now.ok() || now->state() > v1::JOB_STATE_CANCELLING;
}

// The time that the engine spent on events, from the server's log.
void PrintTellingTime(const std::string& log) {
  const std::string mark = "events told in ";
  const std::size_t at = log.rfind(mark);
  if (at == std::string::npos) return;
  double told = 0, total = 0;
  if (std::sscanf(log.c_str() + at + mark.size(), "%lf ms of %lf ms", &told, &total) == 2 && total > 0) {
    std::printf("  the engine spent %.0f ms of %.0f ms in telling: %.2f %%\n", told, total, 100 * told / total);
  }
}

}  // namespace

bool AskWatchers(const WatchersQuestion& question) {
  std::printf("watchers: %d of which %d stalled, every %d ms, %.3g s\n", question.watchers, question.stalled,
              question.interval_ms, question.seconds);
  const v1::SolveRequest solve = RequestOf(question.rate, question.seconds);
  const jobs::testing::TemporaryFolder folder;
  testing::DlcsdProcess server({"--listen", "127.0.0.1:0", "--store", folder.File("jobs.db"), "--log-level", "debug"});
  const std::string address = server.ReadAddress();
  const auto client = *client::Client::Connect(address);
  v1::CreateSolveJobRequest create;
  *create.mutable_solve() = solve;
  const auto job = client->jobs().Submit(create, {});
  if (!job.ok()) {
    std::printf("  WRONG %s\n", std::string(job.status().message()).c_str());
    return false;
  }
  const auto begin = steady_clock::now();
  std::vector<std::unique_ptr<StallableReader>> watchers;
  for (int k = 0; k < question.watchers; ++k) {
    watchers.push_back(
        std::make_unique<StallableReader>(address, job->name(), question.interval_ms, k < question.stalled));
  }
  std::vector<double> resident_mb;
  while (!IsOver(client->jobs(), job->name())) {
    std::this_thread::sleep_for(milliseconds(200));
    resident_mb.push_back(UseOf(server.pid()).resident_mb);
  }
  const double seconds = duration<double>(steady_clock::now() - begin).count();
  const double cpu_s = UseOf(server.pid()).cpu_s;

  bool holds = true;
  std::vector<double> ages;
  std::size_t events = 0;
  for (int k = 0; k < question.watchers; ++k) {
    StallableReader& watcher = *watchers[static_cast<std::size_t>(k)];
    if (k < question.stalled) watcher.Read();
    const std::string wrong = watcher.End();
    if (!wrong.empty()) std::printf("  WRONG watcher %d: %s\n", k, wrong.c_str());
    holds = holds && wrong.empty();
    if (k < question.stalled) continue;
    events += watcher.num_events();
    ages.insert(ages.end(), watcher.ages_ms().begin(), watcher.ages_ms().end());
  }
  const auto last = client->jobs().Get(job->name(), {});
  if (last.ok()) std::printf("  %.0f events a second\n", static_cast<double>(last->last_sequence()) / seconds);
  if (!ages.empty()) {
    std::printf("  readers got %zu events; ages p50 %.2f, p99 %.2f, max %.1f ms\n", events, Percentile(ages, 50),
                Percentile(ages, 99), Percentile(ages, 100));
  }
  // Memory that grows with unread events would grow until the end.
  if (resident_mb.size() >= 4) {
    const auto middle = resident_mb.begin() + static_cast<std::ptrdiff_t>(resident_mb.size() / 2);
    const double first_half = *std::max_element(resident_mb.begin(), middle);
    const double second_half = *std::max_element(middle, resident_mb.end());
    std::printf("  resident at most %.1f MB in the first half, %.1f MB in the second; %.1f s of processor time\n",
                first_half, second_half, cpu_s);
    constexpr double kMaxGrowthMb = 16;
    if (second_half > first_half + kMaxGrowthMb) {
      std::printf("  WRONG it grows\n");
      holds = false;
    }
  }
  watchers.clear();
  server.Signal(SIGTERM);
  holds = server.Wait() == 0 && holds;
  PrintTellingTime(server.ReadErrors());
  return holds;
}

}  // namespace dlcs::load
