// SPDX-License-Identifier: Apache-2.0
// store_load: measures how many jobs per second one PostgreSQL can process, by the functions of the store that servers
// call, without any work in between. README.md and deploy/SCALE.md have measured figures.
//
// Each worker is a thread with a store of its own, which has a connection for it and one for notifications. In turn it
// creates a job, as a front would; claims the first one of its list of claimable jobs that nobody else has; renews the
// lease; stores two windows; finishes. It reads the list, as a server does, when it is used up or a second old, and
// claims job by job, naming --candidates of them as servers do.

#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <fstream>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "CLI/CLI.hpp"
#include "absl/cleanup/cleanup.h"
#include "fmt/format.h"
#include "server/store/postgres/postgres_job_store.h"
#include "tests/load/percentiles.h"
#include "tests/load/process_meter.h"
#include "tests/server/store/job_samples.h"
#include "tests/server/store/postgres/postgres_server.h"

namespace dlcs::load {
namespace {

using namespace std::chrono_literals;
using jobs::JobId;
using jobs::PostgresConnection;
using jobs::PostgresJobStore;
using jobs::testing::PostgresServer;
using std::chrono::steady_clock;

// main() says what they are.
struct Question {
  int workers = 16;
  double seconds = 20, every = 10;
  int queued = 100, ended = 0, listeners = 0;
  int limit = 1000, candidates = 101;
  std::string sql;
  int body_bytes = 1000, chunk_bytes = 4000;
  bool hold = false;
  bool no_flush = false;
};

double Since(steady_clock::time_point begin) {
  return std::chrono::duration<double>(steady_clock::now() - begin).count();
}

void Check(const absl::Status& status) {
  if (!status.ok()) throw std::runtime_error(status.ToString());
}
template <typename Value>
Value Checked(absl::StatusOr<Value> value) {
  Check(value.status());
  return *std::move(value);
}

// What all workers did. Claims of jobs that another worker had are lost.
struct Work {
  std::int64_t jobs = 0, lost = 0;
  std::vector<double> claim_s, list_s;
};
std::mutex work_mutex;
Work work;

double Milliseconds(const std::vector<double>& seconds, double percent) {
  return seconds.empty() ? 0 : 1e3 * Percentile(seconds, percent);
}

class Worker {
 public:
  Worker(const Question& question, const std::string& address, int number)
      : question_(question),
        name_("worker-" + std::to_string(number)),
        store_({.address = address, .max_connections = 2}) {
    Check(store_.Probe());
  }

  void Run(const std::atomic<bool>& stop) {
    while (!stop) {
      Create();
      const jobs::ClaimedJob job = Claim();
      if (Checked(store_.RenewLease(job.lease, 30s))) throw std::runtime_error("cancelled");
      std::int64_t sequence = job.job.sequence;
      for (int window = 0; window < 2; ++window) {
        jobs::Progress progress = jobs::testing::SampleWindow(window, ++sequence);
        progress.chunks[0].data.assign(static_cast<std::size_t>(question_.chunk_bytes), 'c');
        progress.state->assign(static_cast<std::size_t>(question_.body_bytes), 's');
        Check(store_.Append(job.lease, progress));
      }
      Check(store_.Finish(job.lease, jobs::testing::SampleEnd(sequence)));
      const std::lock_guard lock(work_mutex);
      ++work.jobs;
    }
  }

  JobId Create() {
    const std::string body(static_cast<std::size_t>(question_.body_bytes), 'b');
    return Checked(store_.Create(jobs::testing::SampleJob("user", body))).job.id;
  }

  jobs::ClaimedJob Claim() {
    for (;;) {
      if (list_.empty() || Since(listed_) > 1) List();
      const auto end = list_.begin() + std::min<std::ptrdiff_t>(question_.candidates, std::ssize(list_));
      const std::vector<JobId> candidates(list_.begin(), end);
      const auto begin = steady_clock::now();
      std::optional<jobs::ClaimedJob> claimed = Checked(store_.Claim(name_, 30s, candidates));
      // The jobs before it have been claimed by other workers.
      list_.erase(list_.begin(), claimed.has_value() ? std::find(list_.begin(), end, claimed->job.id) + 1 : end);
      const std::lock_guard lock(work_mutex);
      work.claim_s.push_back(Since(begin));
      if (claimed.has_value()) return *std::move(claimed);
      ++work.lost;
    }
  }

  void List() {
    listed_ = steady_clock::now();
    list_.clear();
    for (const jobs::Job& job : Checked(store_.ListClaimable(question_.limit))) list_.push_back(job.id);
    const std::lock_guard lock(work_mutex);
    work.list_s.push_back(Since(listed_));
  }

  PostgresJobStore& store() { return store_; }

 private:
  const Question& question_;
  const std::string name_;
  PostgresJobStore store_;
  std::deque<JobId> list_;
  steady_clock::time_point listed_{};
};

// Makes `count` copies of the only job, which the store made, with names of their own: a queue of 100,000 in seconds.
void Multiply(const PostgresServer& server, const JobId& job, int count) {
  if (count <= 0) return;
  PostgresConnection connection(server.address(), 600s);
  connection.Execute("SET session_replication_role = replica");  // no notifications, no checks of references
  connection.Execute(fmt::format(
      "INSERT INTO jobs OVERRIDING USER VALUE SELECT (jsonb_populate_record(jobs, jsonb_build_object('id',"
      " substr(translate(md5(random()::text || k), '0189', 'ghij'), 1, 26)))).* FROM jobs, generate_series(1, {1})"
      " AS k WHERE id = '{0}'; INSERT INTO bodies SELECT number, (SELECT body FROM bodies LIMIT 1) FROM jobs"
      " WHERE NOT EXISTS (SELECT 1 FROM bodies WHERE job = number);",
      job, count));
  connection.Execute("VACUUM ANALYZE");
}

// The shortest of five, in ms.
double Timed(const std::function<void()>& operation) {
  double least = 1e9;
  for (int k = 0; k < 5; ++k) {
    const auto begin = steady_clock::now();
    operation();
    least = std::min(least, 1e3 * Since(begin));
  }
  return least;
}

void Ask(const Question& question) {
  PostgresServer server({question.no_flush ? "fsync=off" : "fsync=on", "shared_buffers=512MB", "max_wal_size=4GB",
                         "max_connections=1000"});
  // Jobs that ended, and jobs that are queued.
  Worker first(question, server.address(), 0);
  if (question.ended > 0) {
    first.Create();
    const jobs::ClaimedJob job = first.Claim();
    Check(first.store().Finish(job.lease, jobs::testing::SampleEnd(job.job.sequence)));
    Multiply(server, job.job.id, question.ended - 1);
  }
  Multiply(server, first.Create(), question.queued - 1);
  if (!question.sql.empty()) server.Execute(question.sql);
  fmt::print("{} workers, {} queued, {} ended, {} listeners, {} candidates{}{}{}\n", question.workers, question.queued,
             question.ended, question.listeners, question.candidates, question.hold ? ", a snapshot held" : "",
             question.no_flush ? ", nothing flushed" : "", question.sql.empty() ? "" : "; " + question.sql);
  fmt::print(
      "alone: a flush {:.2f} ms, list of {} {:.1f} ms, MeasureQueue {:.1f} ms, Expire (nothing to do) "
      "{:.1f} ms\n",
      Timed([&] { Check(first.store().Probe()); }), question.limit, Timed([&] { first.List(); }),
      Timed([&] { Checked(first.store().MeasureQueue()); }), Timed([&] { Checked(first.store().Expire({})); }));

  PostgresConnection other(server.address(), 60s);
  if (question.hold) other.Execute("BEGIN ISOLATION LEVEL REPEATABLE READ; SELECT COUNT(*) FROM jobs");
  std::atomic<std::int64_t> heard = 0;
  std::vector<std::unique_ptr<PostgresJobStore>> listeners;
  for (int k = 0; k < question.listeners; ++k) {
    listeners.push_back(std::make_unique<PostgresJobStore>(
        jobs::PostgresDatabaseOptions{.address = server.address(), .max_connections = 1}));
    listeners.back()->Subscribe([&heard](const jobs::JobChange&) { ++heard; });
  }
  std::this_thread::sleep_for(question.listeners * 10ms);
  std::vector<std::unique_ptr<Worker>> workers;
  for (int k = 0; k < question.workers; ++k) {
    workers.push_back(std::make_unique<Worker>(question, server.address(), k + 1));
  }
  PostgresConnection meter(server.address(), 60s);
  // Bytes of log, of the database, and dead rows of `jobs`.
  const auto measure = [&meter] {
    const auto rows = meter.Run(
        "SELECT (pg_current_wal_lsn() - '0/0')::bigint, pg_database_size(current_database()), n_dead_tup,"
        " n_tup_upd, n_tup_hot_upd FROM pg_stat_user_tables WHERE relname = 'jobs'");
    return std::array{rows.Int(0, 0), rows.Int(0, 1), rows.Int(0, 2), rows.Int(0, 3), rows.Int(0, 4)};
  };
  const auto bytes_before = measure();
  const double database_before = FamilyCpuSeconds(server.pid()), own_before = UseOf(getpid()).cpu_s;

  work = {};  // that of `first`
  std::atomic<bool> stop = false;
  std::vector<std::future<void>> runs;
  for (const auto& worker : workers) {
    runs.push_back(std::async(std::launch::async, [&stop, worker = worker.get()] { worker->Run(stop); }));
  }
  const absl::Cleanup stop_workers = [&stop] { stop = true; };  // also where something throws
  fmt::print("   until  jobs/s  claim p50    p99  list p50 ms  lost/job  dead rows\n");
  double jobs = 0;
  const auto begin = steady_clock::now();
  for (double last = 0; last < question.seconds;) {
    std::this_thread::sleep_for(std::chrono::duration<double>(std::min(question.every, question.seconds - last)));
    const Work done = [] {
      const std::lock_guard lock(work_mutex);
      return std::exchange(work, {});
    }();
    const double now = Since(begin), count = static_cast<double>(std::max<std::int64_t>(done.jobs, 1));
    fmt::print("{:6.0f} s {:7.1f} {:10.2f} {:6.1f} {:12.1f} {:9.2f} {:10}\n", now, count / (now - last),
               Milliseconds(done.claim_s, 50), Milliseconds(done.claim_s, 99), Milliseconds(done.list_s, 50),
               static_cast<double>(done.lost) / count, measure()[2]);
    std::fflush(stdout);
    last = now;
    jobs += count;
  }
  const double seconds = Since(begin), database = FamilyCpuSeconds(server.pid()) - database_before,
               own = UseOf(getpid()).cpu_s - own_before;
  stop = true;
  for (std::future<void>& run : runs) run.get();  // throws what it threw
  if (jobs < question.seconds) throw std::runtime_error("there is less than a job a second");
  if (question.listeners > 0 && heard == 0) throw std::runtime_error("no notification was heard");
  const auto bytes = measure();
  const auto grown = [&](int k) { return static_cast<double>(bytes[k] - bytes_before[k]); };
  fmt::print(
      "all: {:.1f} jobs/s; processor time of a job: database {:.2f} ms, workers {:.2f} ms, together {:.2f} "
      "processors; heard {:.1f} notices a job\n",
      jobs / seconds, 1e3 * database / jobs, 1e3 * own / jobs, (database + own) / seconds,
      static_cast<double>(heard) / jobs);
  fmt::print("bytes of a job: log {:.0f}, database {:.0f}; updates that touched no index {:.0f} %\n\n", grown(0) / jobs,
             grown(1) / jobs, 100 * grown(4) / std::max(grown(3), 1.0));
}

}  // namespace
}  // namespace dlcs::load

int main(int argc, char** argv) {
  using namespace dlcs::load;
  Question question;
  std::vector<int> workers = {1, 4, 16};
  CLI::App app("Measures how many jobs a second a PostgreSQL takes through their lives.", "store_load");
  app.option_defaults()->always_capture_default();
  app.add_option("--workers", workers, "At once, each with a connection; several numbers, one after the other");
  app.add_option("--seconds", question.seconds, "Of each measurement");
  app.add_option("--every", question.every, "Seconds between lines");
  app.add_option("--queued", question.queued, "Jobs that stay in the queue")->check(CLI::PositiveNumber);
  app.add_option("--ended", question.ended, "Jobs that had ended before");
  app.add_option("--listeners", question.listeners, "Idle servers, which hear every notification");
  app.add_option("--limit", question.limit, "Jobs that a worker lists at once");
  app.add_option("--candidates", question.candidates, "Of a claim; servers name 101");
  app.add_option("--sql", question.sql, "Run before the measurement: another index, another setting");
  app.add_option("--body-bytes", question.body_bytes, "Of a job's request, and of its state");
  app.add_option("--chunk-bytes", question.chunk_bytes, "Of each of its two windows");
  app.add_flag("--hold", question.hold, "A transaction holds a snapshot, as pg_dump does: rows stay dead");
  app.add_flag("--no-flush", question.no_flush, "fsync=off: what a disk without delay would do");
  CLI11_PARSE(app, argc, argv);
  try {
    for (const int number : workers) {
      question.workers = number;
      Ask(question);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "store_load: %s\n", error.what());
    return 1;
  }
}
