// SPDX-License-Identifier: Apache-2.0
// Creates jobs and connections for a long time, while the server restarts now and then: does anything grow?

#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <deque>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "client/rpc/client.h"
#include "tests/load/process_meter.h"
#include "tests/load/questions.h"
#include "tests/server/dlcsd_process.h"
#include "tests/server/store/temporary_folder.h"
#include "tests/server/test_requests.h"

namespace dlcs::load {
namespace {

using client::CallLimits;
using client::Client;
using client::JobClient;
using std::chrono::duration;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

const CallLimits kUnhurried{.deadline = std::chrono::minutes(1), .stop = {}};

// The actions of users, one after the other.
class Users {
 public:
  Users(std::string address, unsigned seed) : address_(std::move(address)), random_(seed) {}

  // A round of everything, some of it interrupted; less than a tenth of a second of work. New connections every time.
  void Round() {
    const auto jobs = *Client::Connect(address_);
    const std::string watched = Submit(jobs->jobs(), 0);
    WatchUntilCut(jobs->jobs(), watched);
    const std::string cancelled = Submit(jobs->jobs(), 1);
    Check("cancel", jobs->jobs().Cancel(cancelled, kUnhurried).status());
    Watch(jobs->jobs(), watched, kUnhurried);
    Watch(jobs->jobs(), cancelled, kUnhurried);
    v1::ReadTrajectoryRequest read;
    read.set_name(watched);
    Check("read", jobs->jobs().ReadTrajectory(
                      read, [](const v1::TrajectoryPage&) {}, kUnhurried));
    Check("list", jobs->jobs().List({}, 100, kUnhurried).status());
    SolveAndHangUp();
    done_.push_back(watched);
    done_.push_back(cancelled);
    while (done_.size() > 50) {
      Check("delete", jobs->jobs().Delete(done_.front(), kUnhurried));
      done_.pop_front();
    }
    ++rounds_;
  }

  int rounds() const { return rounds_; }
  const std::vector<std::string>& failures() const { return failures_; }

 private:
  v1::SolveRequest NextSolve(int kind) {
    const int variety = std::uniform_int_distribution<int>(0, 9)(random_);
    if (kind == 1) return testing::SteppingRequest((300'000 + variety) / testing::kSlowness);
    return variety % 2 == 0 ? testing::ChattyRequest((500 + variety) / testing::kSlowness)
                            : testing::SwitchingRequest((2000 + variety) / testing::kSlowness);
  }
  std::string Submit(JobClient& jobs, int kind) {
    v1::CreateSolveJobRequest create;
    *create.mutable_solve() = NextSolve(kind);
    const auto job = jobs.Submit(create, kUnhurried);
    Check("submit", job.status());
    return job.ok() ? job->name() : "";
  }
  void Watch(JobClient& jobs, const std::string& name, const CallLimits& limits) {
    v1::WatchSolveJobRequest watch;
    watch.set_name(name);
    bool finished = false;
    const absl::Status status = jobs.Watch(
        watch, [&](const v1::SolveEvent& event) { finished = event.has_summary(); }, limits);
    if (!limits.stop.stop_requested() && !finished)
      Check("watch", status.ok() ? absl::DataLossError("no end") : status);
  }
  // Cancels after a few milliseconds, probably in the middle.
  void WatchUntilCut(JobClient& jobs, const std::string& name) {
    std::stop_source leave;
    CallLimits limits = kUnhurried;
    limits.stop = leave.get_token();
    const int pause = std::uniform_int_distribution<int>(0, 10)(random_);
    const std::jthread leaver([&leave, pause] {
      std::this_thread::sleep_for(milliseconds(pause));
      leave.request_stop();
    });
    Watch(jobs, name, limits);
  }
  void SolveAndHangUp() {
    const auto client = *Client::Connect(address_);
    CallLimits limits = kUnhurried;
    limits.deadline = duration<double>(std::uniform_real_distribution<double>(0.001, 0.05)(random_));
    client->Solve(NextSolve(1), {}, limits).IgnoreError();
  }
  void Check(const char* what, const absl::Status& status) {
    if (!status.ok() && failures_.size() < 10)
      failures_.push_back(std::string(what) + ": " + std::string(status.message()));
  }

  const std::string address_;
  std::mt19937 random_;
  std::deque<std::string> done_;
  int rounds_ = 0;
  std::vector<std::string> failures_;
};

struct Sample {
  double minutes = 0;
  ProcessUse use;
};

// MB an hour of the straight line that fits best.
double SlopeMbPerHour(const std::vector<Sample>& samples) {
  double n = 0, t = 0, r = 0, tt = 0, tr = 0;
  for (const Sample& sample : samples) {
    const double hours = sample.minutes / 60;
    n += 1, t += hours, r += sample.use.resident_mb, tt += hours * hours, tr += hours * sample.use.resident_mb;
  }
  const double spread = n * tt - t * t;
  return spread > 0 ? (n * tr - t * r) / spread : 0;
}

// The allowed growth of a server from the first third of its life to the end. Pools of gRPC and the pages of the
// store's cache fill up slowly; a leak of one event or connection a round is far beyond.
constexpr double kMaxGrowthMb = 12;
constexpr int kMaxMoreDescriptors = 6;
constexpr int kMaxMoreThreads = 4;

bool JudgeLife(const std::vector<Sample>& samples) {
  const std::vector<Sample> settled(samples.begin() + static_cast<std::ptrdiff_t>(samples.size() / 3), samples.end());
  if (settled.size() < 4) {
    std::printf("  WRONG too short to judge\n");
    return false;
  }
  // The minimum of each half: memory that is never released.
  const auto middle = settled.begin() + static_cast<std::ptrdiff_t>(settled.size() / 2);
  ProcessUse before = settled.front().use, after = middle->use;
  const auto lower = [](ProcessUse& least, const ProcessUse& use) {
    least.resident_mb = std::min(least.resident_mb, use.resident_mb);
    least.descriptors = std::min(least.descriptors, use.descriptors);
    least.threads = std::min(least.threads, use.threads);
  };
  for (auto sample = settled.begin(); sample != middle; ++sample) lower(before, sample->use);
  for (auto sample = middle; sample != settled.end(); ++sample) lower(after, sample->use);
  std::printf("  resident MB");
  for (std::size_t k = 0; k < 10; ++k) std::printf(" %.1f", samples[k * (samples.size() - 1) / 9].use.resident_mb);
  std::printf("\n  least of the later thirds: %.1f -> %.1f MB (%+.1f MB/h), descriptors %d -> %d, threads %d -> %d\n",
              before.resident_mb, after.resident_mb, SlopeMbPerHour(settled), before.descriptors, after.descriptors,
              before.threads, after.threads);
  const bool holds = after.resident_mb - before.resident_mb <= kMaxGrowthMb &&
                     after.descriptors - before.descriptors <= kMaxMoreDescriptors &&
                     after.threads - before.threads <= kMaxMoreThreads;
  if (!holds) std::printf("  WRONG it grows\n");
  return holds;
}

}  // namespace

bool AskSoak(const SoakQuestion& question) {
  std::printf("soak: %.3g minutes, %d lives of the server, --seed %u\n", question.minutes, question.lives,
              question.seed);
  const jobs::testing::TemporaryFolder folder;
  const double life_minutes = question.minutes / question.lives;
  const double sample_every = std::min(life_minutes / 30, 0.1);
  bool holds = true;
  for (int life = 0; life < question.lives; ++life) {
    testing::DlcsdProcess server(
        {"--listen", "127.0.0.1:0", "--store", folder.File("jobs.db"), "--checkpoint-ms", "50", "--log-level", "off"});
    Users users(server.ReadAddress(), question.seed + static_cast<unsigned>(life));
    std::vector<Sample> samples;
    const auto begin = steady_clock::now();
    double now = 0, next_sample = sample_every;
    while ((now = duration<double, std::ratio<60>>(steady_clock::now() - begin).count()) < life_minutes) {
      users.Round();
      if (now >= next_sample) {
        std::this_thread::sleep_for(milliseconds(50));  // calls that were cut are over
        samples.push_back({now, UseOf(server.pid())});
        next_sample = now + sample_every;
      }
      std::this_thread::sleep_for(milliseconds(question.pause_ms));
    }
    const ProcessUse last = UseOf(server.pid());
    std::printf("life %d: %d rounds, %.0f s of processor time\n", life + 1, users.rounds(), last.cpu_s);
    holds = JudgeLife(samples) && holds;
    for (const std::string& failure : users.failures()) std::printf("  WRONG %s\n", failure.c_str());
    holds = holds && users.failures().empty();
    server.Signal(SIGTERM);
    const int status = server.Wait();
    if (status != 0) std::printf("  WRONG the server ended with %d\n", status);
    holds = holds && status == 0;
    std::fflush(stdout);
  }
  return holds;
}

}  // namespace dlcs::load
