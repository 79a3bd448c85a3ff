// SPDX-License-Identifier: Apache-2.0
// Measures a server that gets more work than it can do, and a light user beside the heavy ones.

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "client/rpc/client.h"
#include "client/rpc/connection.h"
#include "client/rpc/retry.h"
#include "google/protobuf/util/time_util.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "server/access/token.h"
#include "tests/load/percentiles.h"
#include "tests/load/process_meter.h"
#include "tests/load/questions.h"
#include "tests/server/dlcsd_process.h"
#include "tests/server/store/temporary_folder.h"
#include "tests/server/test_requests.h"

namespace dlcs::load {
namespace {

using client::Client;
using google::protobuf::util::TimeUtil;
using std::chrono::duration;
using std::chrono::steady_clock;
using std::chrono::system_clock;

constexpr int kSubmitters = 8;

// Some 50 ms of work. Refusals cost the server time too: the smaller the jobs, the larger their part of it.
v1::CreateSolveJobRequest SmallJob() {
  v1::CreateSolveJobRequest request;
  *request.mutable_solve() = testing::SteppingRequest(40'000 / testing::kSlowness);
  return request;
}

// A server with three users, each with a token.
class Server {
 public:
  client::ConnectionOptions As(const std::string& token) const {
    client::ConnectionOptions options(address_);
    options.token = token;
    return options;
  }
  client::ConnectionOptions Heavy() const { return As(heavy_); }
  client::ConnectionOptions Light() const { return As(light_); }
  client::ConnectionOptions Operator() const { return As(operator_); }
  testing::DlcsdProcess& process() { return process_; }

 private:
  std::string WriteTokens() const {
    const std::string path = folder_.File("tokens.txt");
    std::ofstream(path) << "heavy submitter " << TokenHashText(heavy_) << "\nlight submitter " << TokenHashText(light_)
                        << "\noperator admin " << TokenHashText(operator_) << "\n";
    return path;
  }

  const jobs::testing::TemporaryFolder folder_;
  const std::string heavy_ = RandomToken(), light_ = RandomToken(), operator_ = RandomToken();
  testing::DlcsdProcess process_{
      {"--listen", "127.0.0.1:0", "--store", folder_.File("jobs.db"), "--tokens", WriteTokens(), "--log-level", "off"}};
  const std::string address_ = process_.ReadAddress();
};

// The outcomes of the requests of all submitters.
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

// Submits for `seconds`: at `rate` per second regardless of refusals or, if 0, as a well-behaved client, which retries
// after the delay in RetryInfo.
void Submit(const Server& server, double rate, double seconds, Tally& tally) {
  const auto submit = [&] {
    const auto connection = *client::Connection::Open(server.Heavy());
    const auto stub = v1::JobService::NewStub(connection.channel());
    v1::CreateSolveJobRequest request = SmallJob();
    const auto begin = steady_clock::now();
    const duration<double> pause(rate > 0 ? kSubmitters / rate : 0);
    for (auto next = begin; duration<double>(steady_clock::now() - begin).count() < seconds;) {
      request.set_request_id(client::NewRequestId());  // as every client of ours
      client::Call call(connection, {});
      v1::SolveJob job;
      const grpc::Status status = stub->CreateSolveJob(call.context(), request, &job);
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

// Submits one job after the other, and waits for the end of each.
class LightUser {
 public:
  explicit LightUser(const Server& server) : client_(*Client::Connect(server.Light())) {}

  void WorkFor(double seconds) {
    const auto begin = steady_clock::now();
    while (duration<double>(steady_clock::now() - begin).count() < seconds) {
      std::this_thread::sleep_for(duration<double>(std::uniform_real_distribution<double>(0.1, 0.3)(random_)));
      HaveOneDone();
    }
  }

  const std::vector<double>& waited_ms() const { return waited_ms_; }
  const std::vector<std::string>& failures() const { return failures_; }
  void Print(const char* when) const {
    if (waited_ms_.empty()) return;
    std::printf("  a light user %s: p50 %.1f, p99 %.1f, max %.1f ms from submission to summary, of %zu jobs\n", when,
                Percentile(waited_ms_, 50), Percentile(waited_ms_, 99), Percentile(waited_ms_, 100), waited_ms_.size());
    std::printf("    of these p50 %.1f, p99 %.1f ms until it was taken; p50 %.1f, p99 %.1f ms until it ran\n",
                Percentile(until_taken_ms_, 50), Percentile(until_taken_ms_, 99), Percentile(until_running_ms_, 50),
                Percentile(until_running_ms_, 99));
  }

 private:
  void HaveOneDone() {
    const auto begin = steady_clock::now();
    const auto so_far = [begin] { return duration<double, std::milli>(steady_clock::now() - begin).count(); };
    const auto job = client_->jobs().Submit(SmallJob(), {.deadline = std::chrono::minutes(1), .stop = {}});
    if (!job.ok()) return failures_.emplace_back(job.status().message()), void();
    const double taken = so_far();
    double running = taken;
    v1::WatchSolveJobRequest watch;
    watch.set_name(job->name());
    bool is_done = false;
    const auto see = [&](const v1::SolveEvent& event) {
      if (event.state() == v1::JOB_STATE_RUNNING) running = so_far();
      is_done = is_done || event.state() == v1::JOB_STATE_SUCCEEDED;
    };
    const absl::Status status = client_->jobs().Watch(watch, see, {.deadline = std::chrono::minutes(1), .stop = {}});
    if (!status.ok() || !is_done) return failures_.push_back(job->name() + ": " + std::string(status.message()));
    waited_ms_.push_back(so_far());
    until_taken_ms_.push_back(taken);
    until_running_ms_.push_back(running);
  }

  const std::unique_ptr<Client> client_;
  std::minstd_rand random_{1};
  std::vector<double> waited_ms_, until_taken_ms_, until_running_ms_;
  std::vector<std::string> failures_;
};

// Time, and the processor time of both sides, from its beginning to End().
struct Phase {
  explicit Phase(pid_t server_process) : server(server_process) {}
  void End() {
    end = Now();
    clients_cpu_s = UseOf(getpid()).cpu_s - clients_cpu_s;
    server_cpu_s = UseOf(server).cpu_s - server_cpu_s;
  }
  double seconds() const { return end - begin; }
  // Cores that the clients left to the server.
  double cores() const { return std::thread::hardware_concurrency() - clients_cpu_s / seconds(); }
  static double Now() { return duration<double>(system_clock::now().time_since_epoch()).count(); }

  pid_t server;
  double begin = Now(), end = begin;
  double clients_cpu_s = UseOf(getpid()).cpu_s, server_cpu_s = UseOf(server).cpu_s;
};

// Jobs that ended well within the phase, a second.
double Goodput(const std::vector<v1::SolveJob>& jobs, const Phase& phase) {
  const auto count = std::count_if(jobs.begin(), jobs.end(), [&](const v1::SolveJob& job) {
    const double time = 1e-9 * static_cast<double>(TimeUtil::TimestampToNanoseconds(job.end_time()));
    return time >= phase.begin && time < phase.end;
  });
  return static_cast<double>(count) / phase.seconds();
}

void Print(const char* name, double goodput, const Phase& phase) {
  std::printf("  %s %.1f jobs/s; the server took %.2f cores, the clients %.2f\n", name, goodput,
              phase.server_cpu_s / phase.seconds(), phase.clients_cpu_s / phase.seconds());
}

}  // namespace

bool AskOverload(const OverloadQuestion& question) {
  std::printf("overload: %.3g times what can be done, %.3g s\n", question.factor, question.seconds);
  Server server;
  const pid_t pid = server.process().pid();
  const auto client = *Client::Connect(server.Operator());

  LightUser alone(server), beside(server);
  alone.WorkFor(question.seconds / 2);
  // The queue is filled first, and then measured. How long that takes is the machine's.
  Tally polite, rude;
  for (int k = 0; k < 100 && polite.refused == 0; ++k) Submit(server, 0, question.seconds / 6, polite);
  Phase full(pid);
  Submit(server, 0, question.seconds / 2, polite);
  full.End();
  const auto before = client->jobs().List({v1::JOB_STATE_SUCCEEDED}, 1'000'000, {});
  if (!before.ok()) return false;
  const double capacity = Goodput(*before, full);
  Phase overload(pid);
  {
    const std::jthread light([&] { beside.WorkFor(question.seconds); });
    Submit(server, question.factor * capacity, question.seconds, rude);
  }
  overload.End();
  const auto after = client->jobs().List({v1::JOB_STATE_SUCCEEDED}, 1'000'000, {});
  if (!after.ok()) return false;
  const double goodput = Goodput(*after, overload);

  Print("capacity", capacity, full);
  Print("goodput", goodput, overload);
  std::printf("  asked %.1f/s: goodput is %.0f %% of capacity; %.0f %% by the cores that the clients left\n",
              static_cast<double>(rude.taken + rude.refused + rude.failed) / overload.seconds(),
              100 * goodput / capacity, 100 * goodput / overload.cores() / (capacity / full.cores()));
  const std::int64_t without_delay = rude.refused_without_delay + polite.refused_without_delay;
  std::printf("  %lld taken, %lld refused, %lld without RetryInfo; %lld other errors\n", (long long)rude.taken,
              (long long)rude.refused, (long long)without_delay, (long long)(rude.failed + polite.failed));
  alone.Print("alone");
  beside.Print("beside the overload");
  for (const LightUser* user : {&alone, &beside}) {
    for (const std::string& failure : user->failures()) std::printf("  WRONG the light user: %s\n", failure.c_str());
  }
  const auto failed = client->jobs().List({v1::JOB_STATE_FAILED}, 10, {});
  server.process().Signal(SIGTERM);
  const bool ended_well = server.process().Wait() == 0;
  const bool holds = ended_well && polite.refused > 0 && without_delay == 0 && rude.failed == 0 && polite.failed == 0 &&
                     failed.ok() && failed->empty() && rude.taken > 0 && alone.failures().empty() &&
                     beside.failures().empty() && !beside.waited_ms().empty();
  if (!holds) std::printf("  WRONG\n");
  return holds;
}

}  // namespace dlcs::load
