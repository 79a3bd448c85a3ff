// SPDX-License-Identifier: Apache-2.0
// Connections of submitting and watching clients are cut at random moments.

#include <signal.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "client/rpc/client.h"
#include "fmt/format.h"
#include "tests/load/cut_proxy.h"
#include "tests/load/questions.h"
#include "tests/server/dlcsd_process.h"
#include "tests/server/solve_jobs/job_events.h"
#include "tests/server/store/temporary_folder.h"
#include "tests/server/test_requests.h"

namespace dlcs::load {
namespace {

using client::CallLimits;
using client::Client;
using std::chrono::milliseconds;
using testing::CutProxy;

const CallLimits kPatient{.deadline = std::chrono::minutes(2), .stop = {}};

// The findings of one watcher at the end.
struct Account {
  std::int64_t jobs = 0;
  std::int64_t events = 0;
  std::int64_t gaps = 0;
  std::int64_t resumptions = 0;
  std::vector<std::string> failures;
};

// Submits and watches one job after the other through the proxy until it is stopped. The events that it received are
// compared with those of a watch without cuts.
class Watcher {
 public:
  Watcher(const CutProxy& proxy, const std::string& server, unsigned seed)
      : through_proxy_(*Client::Connect(proxy.address(), [this](const std::string&) { ++account_.resumptions; })),
        direct_(*Client::Connect(server)),
        random_(seed),
        thread_([this] { Work(); }) {}

  Account End() {
    ending_ = true;
    thread_.join();
    return account_;
  }
  // Acts as a client that is killed and restarted: it resumes after the last number that it received.
  void Interrupt() {
    const std::lock_guard lock(mutex_);
    interrupt_.request_stop();
  }

 private:
  void Work() {
    while (!ending_) WatchOne();
  }

  v1::CreateSolveJobRequest NextJob() {
    v1::CreateSolveJobRequest create;
    const std::int64_t variety = std::uniform_int_distribution<int>(0, 500)(random_);
    switch (random_() % 3) {
      case 0:
        *create.mutable_solve() = testing::ChattyRequest((3000 + variety) / testing::kSlowness);
        break;
      case 1:
        *create.mutable_solve() = testing::SwitchingRequest((10'000 + variety) / testing::kSlowness);
        break;
      default:
        *create.mutable_solve() = testing::SteppingRequest((200'000 + variety) / testing::kSlowness);
    }
    return create;
  }

  void WatchOne() {
    const auto job = through_proxy_->jobs().Submit(NextJob(), kPatient);
    if (!job.ok()) return Fail("submit", std::string(job.status().message()));
    v1::WatchSolveJobRequest watch;
    watch.set_name(job->name());
    constexpr int kIntervals[] = {0, 0, 5, 50};
    watch.mutable_min_interval()->set_nanos(kIntervals[random_() % 4] * 1'000'000);
    std::vector<v1::SolveEvent> events;
    while (events.empty() || !events.back().has_summary()) {
      CallLimits limits = kPatient;
      {
        const std::lock_guard lock(mutex_);
        interrupt_ = std::stop_source();
        limits.stop = interrupt_.get_token();
      }
      const absl::Status status = through_proxy_->jobs().Watch(
          watch, [&](const v1::SolveEvent& event) { events.push_back(event); }, limits);
      if (!status.ok() && !limits.stop.stop_requested()) return Fail(job->name(), std::string(status.message()));
      if (!events.empty()) watch.set_after_sequence(events.back().sequence());
      account_.resumptions += limits.stop.stop_requested() ? 1 : 0;
    }
    Judge(job->name(), events);
  }

  void Judge(const std::string& name, const std::vector<v1::SolveEvent>& events) {
    ++account_.jobs;
    account_.events += static_cast<std::int64_t>(events.size());
    for (const v1::SolveEvent& event : events) account_.gaps += event.has_gap() ? 1 : 0;
    if (const std::string wrong = testing::WhatIsWrongWithJobEvents(events); !wrong.empty()) Fail(name, wrong);
    std::vector<v1::SolveEvent> all;
    v1::WatchSolveJobRequest watch;
    watch.set_name(name);
    const absl::Status status = direct_->jobs().Watch(
        watch, [&](const v1::SolveEvent& event) { all.push_back(event); }, kPatient);
    if (!status.ok()) return Fail(name, std::string(status.message()));
    if (const std::string missing = testing::WhatIsMissing(events, all); !missing.empty()) Fail(name, missing);
    if (const absl::Status deleted = direct_->jobs().Delete(name, kPatient); !deleted.ok()) {
      Fail(name, std::string(deleted.message()));
    }
  }

  void Fail(const std::string& job, const std::string& why) { account_.failures.push_back(job + ": " + why); }

  const std::unique_ptr<Client> through_proxy_;
  const std::unique_ptr<Client> direct_;
  std::mt19937 random_;
  Account account_;
  std::atomic<bool> ending_ = false;
  std::mutex mutex_;
  std::stop_source interrupt_;
  std::thread thread_;
};

// One cut, of one of four kinds.
void CutOnce(std::mt19937& random, CutProxy& proxy, std::vector<std::unique_ptr<Watcher>>& watchers) {
  const auto wait = [&](int least, int most) {
    std::this_thread::sleep_for(milliseconds(std::uniform_int_distribution<int>(least, most)(random)));
  };
  switch (random() % 4) {
    case 0:  // the connection breaks
      return proxy.Cut();
    case 1:  // the proxy restarts
      proxy.Close();
      wait(0, 100);
      return proxy.Open();
    case 2:  // the network hangs, and then breaks
      proxy.Stall(true);
      wait(0, 50);
      proxy.Cut();
      return proxy.Stall(false);
    default:  // a client is killed and comes back
      return watchers[random() % watchers.size()]->Interrupt();
  }
}

}  // namespace

bool AskCuts(const CutsQuestion& question) {
  std::printf("cuts: %d cuts, %d watchers, --seed %u\n", question.cuts, question.watchers, question.seed);
  std::mt19937 random(question.seed);
  const jobs::testing::TemporaryFolder folder;
  testing::DlcsdProcess server(
      {"--listen", "127.0.0.1:0", "--store", folder.File("jobs.db"), "--checkpoint-ms", "20", "--log-level", "off"});
  const std::string address = server.ReadAddress();
  CutProxy proxy(address);
  std::vector<std::unique_ptr<Watcher>> watchers;
  for (int k = 0; k < question.watchers; ++k) watchers.push_back(std::make_unique<Watcher>(proxy, address, random()));
  for (int cut = 0; cut < question.cuts; ++cut) {
    std::this_thread::sleep_for(milliseconds(std::uniform_int_distribution<int>(5, 200)(random)));
    CutOnce(random, proxy, watchers);
  }

  Account all;
  for (const auto& watcher : watchers) {
    const Account account = watcher->End();
    all.jobs += account.jobs;
    all.events += account.events;
    all.gaps += account.gaps;
    all.resumptions += account.resumptions;
    all.failures.insert(all.failures.end(), account.failures.begin(), account.failures.end());
  }
  std::printf("  %lld jobs watched to their end; %lld events, %lld gaps, %lld resumptions\n", (long long)all.jobs,
              (long long)all.events, (long long)all.gaps, (long long)all.resumptions);
  // Every watcher deletes its job, so a remaining job was created by a call whose response was lost.
  const auto left = (*Client::Connect(address))->jobs().List({}, 1000, kPatient);
  if (!left.ok()) all.failures.emplace_back(left.status().message());
  if (left.ok() && !left->empty()) all.failures.push_back(fmt::format("{} jobs that nobody knows of", left->size()));
  for (const std::string& failure : all.failures) std::printf("  WRONG %s\n", failure.c_str());
  server.Signal(SIGTERM);
  const int status = server.Wait();
  if (status != 0) std::printf("  WRONG the server ended with %d\n", status);
  return all.failures.empty() && all.jobs > 0 && status == 0;
}

}  // namespace dlcs::load
