// SPDX-License-Identifier: Apache-2.0
#include "server/telemetry/metrics.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <mutex>
#include <unordered_map>
#include <utility>
#include <vector>

#include "prometheus/counter.h"
#include "prometheus/family.h"
#include "prometheus/gauge.h"
#include "prometheus/histogram.h"
#include "prometheus/registry.h"
#include "prometheus/text_serializer.h"
#include "server/session/version.h"
#include "server/telemetry/process_usage.h"

namespace dlcs {
namespace {

using prometheus::Counter;
using prometheus::Family;
using prometheus::Gauge;
using prometheus::Histogram;
using prometheus::MetricFamily;
using prometheus::MetricType;
using prometheus::Registry;

// Upper bounds [s]. Calls take from some hundred microseconds to hours; for the store and the lag short times matter.
const Histogram::BucketBoundaries kCallSeconds = {0.001, 0.003, 0.01, 0.03, 0.1, 0.3,  1,
                                                  3,     10,    30,   100,  300, 1000, 3600};
const Histogram::BucketBoundaries kShortSeconds = {0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1, 3, 10};

Family<Counter>& AddCounter(Registry& registry, const char* name, const char* help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry);
}
Family<Histogram>& AddHistogram(Registry& registry, const char* name, const char* help) {
  return prometheus::BuildHistogram().Name(name).Help(help).Register(registry);
}

// Families with one current value each.
class Readings {
 public:
  using Labels = std::vector<prometheus::ClientMetric::Label>;

  void AddGauge(const char* name, const char* help, double value, Labels labels = {}) {
    Add(MetricType::Gauge, name, help, std::move(labels)).gauge.value = value;
  }
  void AddCounter(const char* name, const char* help, double value, Labels labels = {}) {
    Add(MetricType::Counter, name, help, std::move(labels)).counter.value = value;
  }
  std::vector<MetricFamily> Take() { return std::move(families_); }

 private:
  prometheus::ClientMetric& Add(MetricType type, const char* name, const char* help, Labels labels) {
    auto family =
        std::find_if(families_.begin(), families_.end(), [&](const auto& other) { return other.name == name; });
    if (family == families_.end()) family = families_.insert(family, MetricFamily{name, help, type, {}});
    prometheus::ClientMetric& metric = family->metric.emplace_back();
    metric.label = std::move(labels);
    return metric;
  }

  std::vector<MetricFamily> families_;
};

void ReadSetups(const SetupCache::Statistics& setups, Readings& readings) {
  readings.AddCounter("dlcs_setup_cache_hits_total", "Set-ups that were found in the cache.",
                      static_cast<double>(setups.hits));
  readings.AddCounter("dlcs_setup_cache_misses_total", "Set-ups that had to be made.",
                      static_cast<double>(setups.misses));
  readings.AddCounter("dlcs_setup_cache_dropped_total", "Set-ups dropped to keep the cache within its bound.",
                      static_cast<double>(setups.dropped));
  readings.AddGauge("dlcs_setup_cache_bytes", "Size of the set-ups in the cache.", setups.bytes);
}

void ReadJobs(const ServerState::Jobs& jobs, Readings& readings) {
  // An autoscaler waits where there is no figure, and takes workers away where it is too small.
  if (jobs.load.is_measured) {
    readings.AddGauge("dlcs_jobs_queued", "Queued jobs on this store.", static_cast<double>(jobs.load.queued));
    readings.AddGauge("dlcs_jobs_queued_core_seconds", "Predicted core-seconds of the queued jobs.",
                      jobs.load.queued_core_seconds);
    readings.AddGauge("dlcs_jobs_oldest_queued_seconds", "Time since the oldest queued job was created; 0 without one.",
                      std::chrono::duration<double>(jobs.load.oldest_queued_age).count());
  }
  readings.AddGauge("dlcs_jobs_running", "Jobs that run on this server.", jobs.load.running);
  readings.AddGauge("dlcs_store_healthy", "1 if the last access to the job store succeeded, otherwise 0.",
                    jobs.store_healthy ? 1 : 0);
}

void ReadProcess(Readings& readings) {
  const ProcessUsage usage = ReadProcessUsage();
  readings.AddGauge("process_resident_memory_bytes", "Resident memory of this process.", usage.resident_bytes);
  readings.AddCounter("process_cpu_seconds_total", "Processor time, user and system.", usage.cpu_seconds);
  readings.AddGauge("process_open_fds", "Open file descriptors.", usage.open_files);
  readings.AddGauge("process_threads", "Threads of this process.", usage.threads);
}

std::vector<MetricFamily> Read(const ServerState& state) {
  Readings readings;
  readings.AddGauge(
      "dlcs_build_info", "The version of the program; always 1.", 1,
      {{"version", kVersion}, {"revision", kBuild.revision}, {"compiler", kBuild.compiler}, {"type", kBuild.type}});
  readings.AddGauge("dlcs_solves_running", "Running solves of SolverService.", state.solves);
  readings.AddGauge("dlcs_solves_limit", "Limit of running solves; more are refused.", state.max_solves);
  readings.AddGauge("dlcs_held_result_bytes", "Trajectories that are being computed or not yet read.",
                    static_cast<double>(state.held_result_bytes));
  readings.AddGauge("dlcs_web_connections", "Connections to the port of the page and of calls over HTTP.",
                    state.web_connections);
  ReadSetups(state.setups, readings);
  if (state.jobs) ReadJobs(*state.jobs, readings);
  ReadProcess(readings);
  return readings.Take();
}

}  // namespace

struct Metrics::Families {
  Registry registry;
  Family<Counter>& calls = AddCounter(registry, "dlcs_rpcs_total", "Calls that have ended, by method and status code.");
  Family<Histogram>& call_seconds =
      AddHistogram(registry, "dlcs_rpc_duration_seconds", "From the first byte of a call to its status.");
  Family<Gauge>& calls_under_way = prometheus::BuildGauge()
                                       .Name("dlcs_rpcs_in_flight")
                                       .Help("Running calls, including watchers.")
                                       .Register(registry);
  Family<Counter>& events = AddCounter(registry, "dlcs_events_sent_total", "Events of streams that were sent.");
  Counter& EventsOf(const std::string& method) {
    const std::lock_guard lock(events_mutex);
    Counter*& known = events_of[method];
    if (known == nullptr) known = &events.Add({{"method", method}});
    return *known;
  }
  std::mutex events_mutex;
  std::unordered_map<std::string, Counter*> events_of;  // by method

  Histogram& lag = AddHistogram(registry, "dlcs_event_lag_seconds",
                                "Time from an event of a running job until it was sent to a watcher.")
                       .Add({}, kShortSeconds);
  Family<Counter>& gaps = AddCounter(registry, "dlcs_event_gaps_total", "Gaps that readers received, by reason.");
  Family<Counter>& dropped =
      AddCounter(registry, "dlcs_events_dropped_total", "Events that readers did not receive; a gap was sent instead.");
  Family<Counter>& solves =
      AddCounter(registry, "dlcs_solves_total", "Solves that have ended, by kind, method and termination.");
  Family<Counter>& seconds =
      AddCounter(registry, "dlcs_solve_seconds_total", "Time of solves by phase: setup, lcp, linear (algebra), other.");
  Family<Counter>& steps = AddCounter(registry, "dlcs_solve_steps_total", "Steps in time of all solves.");
  Family<Counter>& iterations =
      AddCounter(registry, "dlcs_solve_iterations_total", "Iterations of all windows of all solves.");
  Family<Counter>& lcps =
      AddCounter(registry, "dlcs_solve_lcps_total", "Linear complementarity problems of all solves.");
  Family<Counter>& jobs =
      AddCounter(registry, "dlcs_jobs_finished_total", "Attempts at jobs that have ended on this server, by outcome.");
  Family<Histogram>& store_seconds = AddHistogram(registry, "dlcs_store_operation_duration_seconds",
                                                  "Duration of operations of the job store, by operation.");
  Family<Counter>& store_errors =
      AddCounter(registry, "dlcs_store_errors_total", "Operations that failed because of the store.");
};

Metrics::Metrics() : families_(std::make_unique<Families>()) {}
Metrics::~Metrics() = default;

void Metrics::CallBegan(const std::string& method) { families_->calls_under_way.Add({{"method", method}}).Increment(); }

void Metrics::CallEnded(const std::string& method, const std::string& code, Seconds took) {
  families_->calls_under_way.Add({{"method", method}}).Decrement();
  families_->calls.Add({{"method", method}, {"code", code}}).Increment();
  families_->call_seconds.Add({{"method", method}}, kCallSeconds).Observe(took.count());
}

// Counters are cached, since building labels and looking up their counter costs more than all other work for an event.
void Metrics::EventSent(const std::string& method) { families_->EventsOf(method).Increment(); }

void Metrics::EventSent(const std::string& method, Seconds lag) {
  EventSent(method);
  families_->lag.Observe(std::max(lag.count(), 0.0));
}

void Metrics::GapSent(const std::string& method, const std::string& reason, std::int64_t count) {
  families_->gaps.Add({{"method", method}, {"reason", reason}}).Increment();
  families_->dropped.Add({{"method", method}}).Increment(static_cast<double>(count));
}

void Metrics::Solved(const std::string& kind, const std::string& method, const std::string& termination,
                     const Cost& cost) {
  families_->solves.Add({{"kind", kind}, {"method", method}, {"termination", termination}}).Increment();
  const auto add = [](Family<Counter>& family, double amount, const std::map<std::string, std::string>& labels = {}) {
    if (amount > 0) family.Add(labels).Increment(amount);
  };
  add(families_->seconds, cost.seconds_setup, {{"phase", "setup"}});
  add(families_->seconds, cost.seconds_lcp, {{"phase", "lcp"}});
  add(families_->seconds, cost.seconds_linear, {{"phase", "linear"}});
  add(families_->seconds, cost.seconds_certificate, {{"phase", "certificate"}});
  add(families_->seconds,
      cost.seconds_total - cost.seconds_setup - cost.seconds_lcp - cost.seconds_linear - cost.seconds_certificate,
      {{"phase", "other"}});
  add(families_->steps, static_cast<double>(cost.steps));
  add(families_->iterations, static_cast<double>(cost.iterations));
  add(families_->lcps, static_cast<double>(cost.lcps));
}

void Metrics::JobEnded(const std::string& outcome) { families_->jobs.Add({{"outcome", outcome}}).Increment(); }

jobs::StoreTimer Metrics::StoreTimer() {
  return [this](const char* operation, const absl::Status& status, Seconds took) {
    families_->store_seconds.Add({{"operation", operation}}, kShortSeconds).Observe(took.count());
    // Errors of the store itself; other codes are normal responses.
    if (absl::IsUnavailable(status) || absl::IsDataLoss(status) || absl::IsInternal(status)) {
      const std::string code = absl::StatusCodeToString(status.code());
      families_->store_errors.Add({{"operation", operation}, {"code", code}}).Increment();
    }
  };
}

std::string Metrics::Text(const ServerState& state) const {
  std::vector<MetricFamily> all = Read(state);
  std::vector<MetricFamily> counted = families_->registry.Collect();
  std::move(counted.begin(), counted.end(), std::back_inserter(all));
  return prometheus::TextSerializer().Serialize(all);
}

}  // namespace dlcs
