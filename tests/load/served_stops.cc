// SPDX-License-Identifier: Apache-2.0
// From a cancel, or a deadline, to the end of a job, through a server.

#include <signal.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/rpc/client.h"
#include "google/protobuf/util/time_util.h"
#include "server/wire/convert.h"
#include "tests/load/percentiles.h"
#include "tests/load/questions.h"
#include "tests/load/stop_cases.h"
#include "tests/server/dlcsd_process.h"
#include "tests/server/store/temporary_folder.h"

namespace dlcs::load {
namespace {

using google::protobuf::util::TimeUtil;
using std::chrono::duration;
using std::chrono::system_clock;
using Seconds = duration<double>;

// Since 1970, as all times here: client and server are on one machine.
double Now() { return Seconds(system_clock::now().time_since_epoch()).count(); }

// The times at which a watcher receives the events of one job.
class WatchedJob {
 public:
  WatchedJob(client::JobClient& client, std::string name)
      : name_(std::move(name)), watcher_([this, &client] {
          v1::WatchSolveJobRequest request;
          request.set_name(name_);
          request.set_view(v1::WATCH_VIEW_PROGRESS);
          client.Watch(request, [this](const v1::SolveEvent& event) { See(event); }, {}).IgnoreError();
          const std::lock_guard lock(mutex_);
          is_over_ = true;
          changed_.notify_all();
        }) {}

  const std::string& name() const { return name_; }

  // Until `seconds` have passed since it began to run; false if it was over before.
  bool WaitUntilRunningFor(double seconds) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return running_ > 0 || is_over_; });
    changed_.wait_for(lock, Seconds(seconds), [this] { return is_over_; });
    return !is_over_;
  }
  void WaitUntilOver() { watcher_.join(); }

  // Only after WaitUntilOver(). Times of the server, but for the last; 0 if there was no such event.
  double running() const { return running_; }
  double cancelling() const { return cancelling_; }
  double stored() const { return stored_; }  // the engine has ended, and its results are being stored
  double ended() const { return ended_; }    // stored
  double told() const { return told_; }      // to the watcher
  v1::JobState state() const { return state_; }
  v1::Termination termination() const { return termination_; }

 private:
  void See(const v1::SolveEvent& event) {
    const std::lock_guard lock(mutex_);
    const double time = 1e-9 * static_cast<double>(TimeUtil::TimestampToNanoseconds(event.time()));
    if (event.has_checkpointed()) stored_ = time;
    if (event.kind_case() == v1::SolveEvent::kState) {
      state_ = event.state();
      if (state_ == v1::JOB_STATE_RUNNING) running_ = time;
      if (state_ == v1::JOB_STATE_CANCELLING) cancelling_ = time;
      ended_ = time;
    }
    if (event.has_summary()) {
      told_ = Now();
      termination_ = event.summary().termination();
    }
    changed_.notify_all();
  }

  const std::string name_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_over_ = false;
  double running_ = 0, cancelling_ = 0, stored_ = 0, ended_ = 0, told_ = 0;
  v1::JobState state_ = v1::JOB_STATE_UNSPECIFIED;
  v1::Termination termination_ = v1::TERMINATION_UNSPECIFIED;
  std::jthread watcher_;  // last: it uses the others
};

// In ms. From the cancel to the server's notice of it, where it was a cancel; from there, or from the deadline, to the
// end of the engine; from the beginning to the watcher's knowledge.
struct ServedStop {
  double until_noticed = 0;
  double until_over = 0;
  double until_told = 0;
  bool is_sound = false;
};

struct Stops {
  std::vector<ServedStop> all;
  bool is_sound() const {
    return std::all_of(all.begin(), all.end(), [](const ServedStop& stop) { return stop.is_sound; });
  }
  void Append(const Stops& others) { all.insert(all.end(), others.all.begin(), others.all.end()); }
  // "p50 p99 max".
  std::string Describe(double ServedStop::*what) const {
    std::vector<double> values;
    for (const ServedStop& stop : all) values.push_back(stop.*what);
    if (values.empty()) return "      -       -       -";
    char text[40];
    std::snprintf(text, sizeof text, "%7.1f %7.1f %7.1f", Percentile(values, 50), Percentile(values, 99),
                  Percentile(values, 100));
    return text;
  }
};

v1::CreateSolveJobRequest RequestOf(const StopCase& the_case) {
  v1::CreateSolveJobRequest request;
  *request.mutable_solve()->mutable_problem() = ToProto(the_case.problem);
  *request.mutable_solve()->mutable_options() = ToProto(the_case.options);
  return request;
}

// Cancels a job `after` seconds of running. Nothing if it was over before; `took` is then how long it ran.
std::optional<ServedStop> Cancel(client::JobClient& client, const v1::CreateSolveJobRequest& request, double after,
                                 double& took) {
  const auto submitted = client.Submit(request, {});
  if (!submitted.ok()) return ServedStop{};
  WatchedJob job(client, submitted->name());
  if (!job.WaitUntilRunningFor(after)) {
    job.WaitUntilOver();
    took = job.ended() - job.running();
    return std::nullopt;
  }
  const double sent = Now();
  const bool cancelled = client.Cancel(job.name(), {}).ok();
  job.WaitUntilOver();
  took = job.ended() - job.running();
  if (job.state() == v1::JOB_STATE_SUCCEEDED) return std::nullopt;
  ServedStop stop;
  stop.until_noticed = 1e3 * (job.cancelling() - sent);
  // The engine may end before the server has stored the cancellation.
  stop.until_over = 1e3 * std::max(0.0, job.stored() - job.cancelling());
  stop.until_told = 1e3 * (job.told() - sent);
  stop.is_sound = cancelled && job.state() == v1::JOB_STATE_CANCELLED && job.cancelling() > 0 && job.stored() > 0 &&
                  job.termination() == v1::TERMINATION_CANCELLED;
  return stop;
}

// A job whose deadline is `allowed` seconds away. Nothing if it was over before.
std::optional<ServedStop> Overrun(client::JobClient& client, v1::CreateSolveJobRequest request, double allowed,
                                  double& took) {
  const double deadline = Now() + allowed;
  *request.mutable_deadline() = TimeUtil::NanosecondsToTimestamp(static_cast<std::int64_t>(1e9 * deadline));
  const auto submitted = client.Submit(request, {});
  if (!submitted.ok()) return std::nullopt;  // predicted to come too late after all
  WatchedJob job(client, submitted->name());
  job.WaitUntilOver();
  took = job.ended() - job.running();
  if (job.state() == v1::JOB_STATE_SUCCEEDED || job.running() == 0) return std::nullopt;
  ServedStop stop;
  stop.until_over = 1e3 * (job.stored() - deadline);
  stop.until_told = 1e3 * (job.told() - deadline);
  stop.is_sound =
      job.state() == v1::JOB_STATE_FAILED && job.stored() >= deadline && job.termination() == v1::TERMINATION_DEADLINE;
  return stop;
}

// The case with so few steps, as long as before, that the server predicts less than `seconds` for it: what is predicted
// to miss its deadline would be refused. Most cases take longer than predicted. Nothing if even few steps are
// predicted to take longer.
std::optional<StopCase> PredictedWithin(double seconds, client::JobClient& client, StopCase the_case,
                                        double& predicted) {
  constexpr Index kFewest = 16;
  for (;;) {
    v1::CreateSolveJobRequest request = RequestOf(the_case);
    request.set_validate_only(true);
    const auto answer = client.Submit(request, {});
    if (!answer.ok()) return std::nullopt;
    predicted = answer->predicted_core_seconds();
    if (predicted <= seconds) return the_case;
    if (the_case.options.num_steps < 2 * kFewest) return std::nullopt;
    the_case.options.num_steps /= 2;
    the_case.problem.horizon /= 2;
    the_case.options.output_times = {the_case.problem.horizon};
  }
}

// `count` of them at random times up to `longest` seconds, in at most three times as many attempts; `stop` is
// Cancel() or Overrun().
template <class Stop>
Stops Collect(int count, double longest, std::mt19937& random, const Stop& stop) {
  Stops stops;
  for (int tries = 0; static_cast<int>(stops.all.size()) < count && tries < 3 * count; ++tries) {
    double took = longest;
    if (const auto one = stop(std::uniform_real_distribution<double>(0, longest)(random), took)) {
      stops.all.push_back(*one);
    } else {
      longest = std::min(longest, took);
    }
  }
  return stops;
}

void PrintRow(int size, const std::string& name, const Stops& cancels, const Stops& deadlines) {
  const bool is_sound = cancels.is_sound() && deadlines.is_sound();
  std::printf("%-5d %-32s | %s | %s | %s | %s | %s%s\n", size, name.c_str(),
              cancels.Describe(&ServedStop::until_noticed).c_str(), cancels.Describe(&ServedStop::until_over).c_str(),
              cancels.Describe(&ServedStop::until_told).c_str(), deadlines.Describe(&ServedStop::until_over).c_str(),
              deadlines.Describe(&ServedStop::until_told).c_str(), is_sound ? "" : "  WRONG: ended as something else");
  std::fflush(stdout);
}

}  // namespace

bool AskServedStops(const StopsQuestion& question) {
  const jobs::testing::TemporaryFolder folder;
  testing::DlcsdProcess server(
      {"--listen", "127.0.0.1:0", "--store", folder.File("jobs.db"), "--log-level", "off", "--threads", "1"});
  const auto client = *client::Client::Connect(server.ReadAddress());
  std::printf("served-stops: %d cancels and %d deadlines of each, within %.3g s, --seed %u; p50, p99 and max in ms\n",
              question.stops, question.stops, question.longest, question.seed);
  std::printf("%-5s %-32s | %-23s | %-23s | %-23s | %-23s | %-23s\n", "size", "solve", "cancel: until noticed",
              "then until over", "in all until told", "deadline: until over", "until told");
  std::mt19937 random(question.seed);
  bool holds = true;
  for (const int size : question.sizes) {
    Stops all_cancels, all_deadlines;
    for (const StopCase& the_case : StopCases(size)) {
      if (the_case.name.find(question.only) == std::string::npos) continue;
      const v1::CreateSolveJobRequest request = RequestOf(the_case);
      const Stops cancels = Collect(question.stops, question.longest, random, [&](double after, double& took) {
        return Cancel(client->jobs(), request, after, took);
      });
      Stops deadlines;
      double predicted = 0;
      if (const auto shorter = PredictedWithin(question.longest / 4, client->jobs(), the_case, predicted)) {
        const v1::CreateSolveJobRequest with_deadline = RequestOf(*shorter);
        constexpr double kToSubmit = 0.1;  // s; ms where the machine is idle
        deadlines = Collect(question.stops, question.longest, random, [&](double after, double& took) {
          return Overrun(client->jobs(), with_deadline, predicted + kToSubmit + after, took);
        });
      }
      PrintRow(size, the_case.name, cancels, deadlines);
      holds = holds && cancels.is_sound() && deadlines.is_sound();
      all_cancels.Append(cancels);
      all_deadlines.Append(deadlines);
    }
    PrintRow(size, "all", all_cancels, all_deadlines);
  }
  server.Signal(SIGTERM);
  return server.Wait() == 0 && holds;
}

}  // namespace dlcs::load
