// SPDX-License-Identifier: Apache-2.0
// More is asked than can be done.

#include <signal.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client/job_client.h"
#include "core/solve.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "grpcpp/create_channel.h"
#include "grpcpp/security/credentials.h"
#include "server/jobs/job_manager.h"
#include "server/jobs/sqlite_job_store.h"
#include "tests/load/percentiles.h"
#include "tests/load/questions.h"
#include "tests/load/stop_cases.h"
#include "tests/server/dlcsd_process.h"
#include "tests/server/jobs/temporary_folder.h"
#include "tests/server/test_requests.h"

namespace dlcs::load {
namespace {

using std::chrono::duration;
using std::chrono::milliseconds;
using std::chrono::steady_clock;
using std::chrono::system_clock;

constexpr int kSubmitters = 8;

// Some 50 ms of work. What refusals cost is the server's too: the smaller the jobs, the more of it they take.
v1::SolveRequest SmallSolve() { return testing::MarchingRequest(40'000 / testing::kSlowness); }

// What became of the requests of all submitters.
struct Tally {
  std::atomic<std::int64_t> taken = 0;
  std::atomic<std::int64_t> refused = 0;
  std::atomic<std::int64_t> refused_without_delay = 0;  // without RetryInfo
  std::atomic<std::int64_t> failed = 0;
};

std::optional<duration<double>> RetryDelay(const grpc::Status& status) {
  google::rpc::Status details;
  details.ParseFromString(status.error_details());
  for (const auto& detail : details.details()) {
    google::rpc::RetryInfo retry;
    if (!detail.UnpackTo(&retry)) continue;
    return std::chrono::seconds(retry.retry_delay().seconds()) + std::chrono::nanoseconds(retry.retry_delay().nanos());
  }
  return std::nullopt;
}

// Submits for `seconds`: at `rate` a second whatever the server says, or, with 0, as a well-behaved client, which comes
// back when it is told to.
void Submit(const std::string& address, double rate, double seconds, Tally& tally) {
  const auto submit = [&] {
    const auto stub = v1::JobService::NewStub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
    v1::CreateSolveJobRequest request;
    *request.mutable_solve() = SmallSolve();
    const auto begin = steady_clock::now();
    const duration<double> pause(rate > 0 ? kSubmitters / rate : 0);
    for (auto next = begin; duration<double>(steady_clock::now() - begin).count() < seconds;) {
      grpc::ClientContext context;
      v1::SolveJob job;
      const grpc::Status status = stub->CreateSolveJob(&context, request, &job);
      duration<double> wait{0};
      if (status.ok()) {
        ++tally.taken;
      } else if (status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED) {
        ++tally.refused;
        const auto delay = RetryDelay(status);
        if (!delay) ++tally.refused_without_delay;
        if (rate == 0) wait = std::min(delay.value_or(wait), duration<double>(1));
      } else {
        ++tally.failed;
      }
      if (rate > 0) {
        next += std::chrono::duration_cast<steady_clock::duration>(pause);
        std::this_thread::sleep_until(next);
      } else {
        std::this_thread::sleep_for(wait);
      }
    }
  };
  std::vector<std::jthread> threads;
  for (int k = 0; k < kSubmitters; ++k) threads.emplace_back(submit);
}

double SecondsOf(const google::protobuf::Timestamp& time) {
  return static_cast<double>(time.seconds()) + 1e-9 * static_cast<double>(time.nanos());
}

double Now() { return duration<double>(system_clock::now().time_since_epoch()).count(); }

// Jobs that ended well in the interval, a second.
double Goodput(const std::vector<v1::SolveJob>& jobs, double begin, double end) {
  double count = 0;
  for (const v1::SolveJob& job : jobs) {
    const double time = SecondsOf(job.end_time());
    count += job.state() == v1::JOB_STATE_SUCCEEDED && time >= begin && time < end ? 1 : 0;
  }
  return count / (end - begin);
}

bool AskServer(const OverloadQuestion& question) {
  const jobs::testing::TemporaryFolder folder;
  testing::DlcsdProcess server({"--listen", "127.0.0.1:0", "--store", folder.File("jobs.db"), "--log-level", "off"});
  const std::string address = server.ReadAddress();
  const auto client = *client::JobClient::Connect(address);

  // The queue is filled first, and then measured.
  Tally polite, rude;
  Submit(address, 0, question.seconds / 6, polite);
  const double polite_begin = Now();
  Submit(address, 0, question.seconds / 3, polite);
  const double rude_begin = Now();
  const auto before = client->List({v1::JOB_STATE_SUCCEEDED}, 1'000'000, {});
  if (!before.ok()) return false;
  const double capacity = Goodput(*before, polite_begin, rude_begin);
  const double overload_begin = Now();
  Submit(address, question.factor * capacity, question.seconds, rude);
  const double overload_end = Now();
  const auto after = client->List({v1::JOB_STATE_SUCCEEDED}, 1'000'000, {});
  if (!after.ok()) return false;
  const double goodput = Goodput(*after, overload_begin, overload_end);

  const double asked = static_cast<double>(rude.taken + rude.refused + rude.failed) / (overload_end - overload_begin);
  std::printf("  capacity %.1f jobs/s; asked %.1f/s: goodput %.1f/s, %.0f %% of capacity\n", capacity, asked, goodput,
              100 * goodput / capacity);
  std::printf("  %lld taken, %lld refused, of which %lld without RetryInfo; %lld other errors\n", (long long)rude.taken,
              (long long)rude.refused, (long long)rude.refused_without_delay, (long long)(rude.failed + polite.failed));
  const auto failed = client->List({v1::JOB_STATE_FAILED}, 10, {});
  server.Signal(SIGTERM);
  const bool ended_well = server.Wait() == 0;
  const bool holds = ended_well && rude.refused_without_delay == 0 && rude.failed == 0 && polite.failed == 0 &&
                     failed.ok() && failed->empty() && rude.taken > 0;
  if (!holds) std::printf("  WRONG\n");
  return holds;
}

class Bell {
 public:
  void Ring() {
    const std::lock_guard lock(mutex_);
    is_rung_ = true;
    changed_.notify_one();
  }
  // Until it is rung, once.
  void Wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return is_rung_; });
    is_rung_ = false;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_rung_ = false;
};

// A user of the manager who waits for each job, as WatchSolveJob does.
class LightUser {
 public:
  LightUser(jobs::JobManager& manager, std::string name) : manager_(manager), name_(std::move(name)) {}

  // In ms since it was submitted.
  struct Waited {
    double until_taken = 0;
    double until_running = 0;
    double until_summary = 0;
  };
  // Nothing where the job was refused.
  std::optional<Waited> WaitForOne(const jobs::Submission& what) {
    jobs::Submission submission = what;
    submission.owner = name_;
    const auto begin = steady_clock::now();
    const auto created = manager_.Submit(submission);
    if (!created.ok()) return std::nullopt;
    const auto so_far = [begin] { return duration<double, std::milli>(steady_clock::now() - begin).count(); };
    Waited waited;
    waited.until_taken = so_far();
    const auto bell = std::make_shared<Bell>();  // may be rung after the watch has gone
    const auto watch = manager_.Watch(std::nullopt, created->job.id, {}, [bell] { bell->Ring(); });
    if (!watch.ok()) return std::nullopt;
    for (;;) {
      const jobs::EventWatch::Delivery delivery = (*watch)->Next();
      if (delivery.got == jobs::EventWatch::Got::kEnd) break;
      if (delivery.got == jobs::EventWatch::Got::kEvent && delivery.event.kind == jobs::EventKind::kState &&
          *delivery.event.payload == jobs::JobStateName(jobs::JobState::kRunning)) {
        waited.until_running = so_far();
      }
      if (delivery.got == jobs::EventWatch::Got::kArchived && !(*watch)->Fetch().ok()) return std::nullopt;
      if (delivery.got != jobs::EventWatch::Got::kNothing) continue;
      bell->Wait();
    }
    waited.until_summary = so_far();
    return waited;
  }

 private:
  jobs::JobManager& manager_;
  const std::string name_;
};

// Waits so many times, prints how long, and returns how often the light user was refused.
int WaitAsLightUser(jobs::JobManager& manager, const jobs::Submission& what, int times, duration<double> pause,
                    const char* when) {
  LightUser user(manager, "light");
  std::vector<double> taken, running, summary;
  for (int k = 0; k < times; ++k) {
    std::this_thread::sleep_for(pause);
    const auto waited = user.WaitForOne(what);
    if (!waited) continue;
    taken.push_back(waited->until_taken);
    running.push_back(waited->until_running);
    summary.push_back(waited->until_summary);
  }
  if (!summary.empty()) {
    std::printf("  a light user %s: p50 %.1f, p99 %.1f ms; p50 %.1f ms until it is taken, %.1f until it runs\n", when,
                Percentile(summary, 50), Percentile(summary, 99), Percentile(taken, 50), Percentile(running, 50));
  }
  return times - static_cast<int>(summary.size());
}

// Two users of the manager, with the real store and a solve in each job.
bool AskFairness(const OverloadQuestion& question) {
  const jobs::testing::TemporaryFolder folder;
  jobs::SqliteJobStore store({.path = folder.File("jobs.db")}, jobs::SystemClock());
  jobs::JobManagerOptions options;
  options.limits.cores = static_cast<int>(std::thread::hardware_concurrency());
  StopCase small{"", LongProblemOfPairs(2), {}};
  small.options.num_steps = 20'000 / testing::kSlowness;
  small.options.num_threads = 1;
  jobs::JobManager manager(
      options, store,
      [](const auto&...) -> absl::StatusOr<jobs::Demand> {
        jobs::Demand demand;
        demand.core_seconds = 0.02;
        demand.memory_bytes = 1 << 20;
        return demand;
      },
      [&small](jobs::JobRun& run) -> jobs::JobEnd {
        Observer nobody;
        return {Solve(small.problem, small.options, nobody, run.stop()).status(), ""};
      },
      jobs::SystemClock());
  jobs::Submission what;
  what.body = what.body_hash = "small";

  const int times = std::max(10, static_cast<int>(2 * question.seconds));
  int refused = WaitAsLightUser(manager, what, times, duration<double>(0.05), "alone");
  std::atomic<bool> is_over = false;
  std::thread heavy([&] {
    jobs::Submission submission = what;
    submission.owner = "heavy";
    // Much more often than jobs end.
    while (!is_over) {
      manager.Submit(submission).IgnoreError();
      std::this_thread::sleep_for(milliseconds(2));
    }
  });
  std::this_thread::sleep_for(duration<double>(question.seconds / 20));
  refused += WaitAsLightUser(manager, what, times, duration<double>(0.3), "beside a heavy one");
  is_over = true;
  heavy.join();
  manager.Drain(jobs::Duration(0));
  if (refused > 0) std::printf("  WRONG the light user was refused %d times\n", refused);
  return refused == 0;
}

}  // namespace

bool AskOverload(const OverloadQuestion& question) {
  std::printf("overload: %.3g times what can be done, %.3g s\n", question.factor, question.seconds);
  const bool server_holds = AskServer(question);
  return AskFairness(question) && server_holds;
}

}  // namespace dlcs::load
