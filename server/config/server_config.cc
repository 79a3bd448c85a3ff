// SPDX-License-Identifier: Apache-2.0
#include "server/config/server_config.h"

#include <algorithm>
#include <cctype>
#include <concepts>
#include <limits>
#include <thread>

#include "fmt/format.h"
#include "server/net/listen_address.h"
#include "server/store/open_store.h"

namespace dlcs {
namespace {

constexpr double kLongest_s = 100.0 * 365 * 24 * 3600;  // so that times do not overflow

template <std::integral Integer>
absl::Status OutOfRange(const char* flag, Integer value, const char* rule) {
  return absl::InvalidArgumentError(fmt::format("{} {}: must be {}", flag, value, rule));
}

absl::Status OutOfRange(const char* flag, double value, const char* rule) {
  return absl::InvalidArgumentError(fmt::format("{} {:.10g}: must be {}", flag, value, rule));
}

absl::Status CheckAddress(const char* flag, const absl::Status& status) {
  if (status.ok()) return status;
  return absl::InvalidArgumentError(fmt::format("{}: {}", flag, std::string(status.message())));
}

// HOST:PORT, or nothing.
absl::Status CheckHttpAddress(const char* flag, const std::string& text) {
  return text.empty() ? absl::OkStatus() : CheckAddress(flag, ParseHostPort(text).status());
}

absl::Status ValidateStore(const ServerConfig& config) {
  if (absl::Status status = jobs::CheckStoreAddress(config.store); !status.ok()) {
    return absl::InvalidArgumentError(fmt::format("--store: {}", std::string(status.message())));
  }
  if (config.role != "all" && config.role != "front" && config.role != "worker") {
    return absl::InvalidArgumentError(fmt::format("--role {}: must be all, front or worker", config.role));
  }
  if (config.role != "all" && !jobs::IsShared(config.store)) {
    return absl::InvalidArgumentError(
        fmt::format("--role {}: needs a shared store, --store postgresql://...; a file can be used by one dlcsd only",
                    config.role));
  }
  if (config.worker_name.size() > 200) {
    return absl::InvalidArgumentError(
        fmt::format("--worker-name: has {} characters; at most 200", config.worker_name.size()));
  }
  if (!(config.exit_when_idle_s >= 0 && config.exit_when_idle_s <= kLongest_s)) {
    return OutOfRange("--exit-when-idle", config.exit_when_idle_s, "at least 0 and at most 100 years, in seconds");
  }
  if (config.exit_when_idle_s > 0 && config.role != "worker") {
    return absl::InvalidArgumentError(
        fmt::format("--exit-when-idle {:.10g}: needs --role worker; callers may still want other servers",
                    config.exit_when_idle_s));
  }
  if (config.lease_ms < 1000 || config.lease_ms > 3'600'000) {
    return OutOfRange("--lease-ms", config.lease_ms, "between 1000 and 3600000");
  }
  return absl::OkStatus();
}

absl::Status ValidateRanks(const ServerConfig& config) {
  constexpr int kMostRanks = 1 << 20;
  if (config.max_ranks < 0 || config.max_ranks > kMostRanks) {
    return OutOfRange("--max-ranks", config.max_ranks, "between 0 (automatic) and 1048576");
  }
  if (config.max_ranks > 0 && config.mpi_launcher.empty() && config.role != "front") {
    return OutOfRange("--max-ranks", config.max_ranks, "given with --mpi-launcher, which starts them; or to a front");
  }
  if (config.mpi_patience_ms < 1000 || config.mpi_patience_ms > 3'600'000) {
    return OutOfRange("--mpi-patience-ms", config.mpi_patience_ms, "between 1000 and 3600000");
  }
  return absl::OkStatus();
}

absl::Status ValidateJobs(const ServerConfig& config) {
  const auto is_time = [](double seconds) { return seconds > 0 && seconds <= kLongest_s; };
  if (!(config.max_job_core_seconds > 0)) {
    return OutOfRange("--max-job-core-seconds", config.max_job_core_seconds, "above 0");
  }
  if (config.max_queued_jobs < 1) return OutOfRange("--max-queued-jobs", config.max_queued_jobs, "at least 1");
  if (config.max_queued_jobs_per_user < 1) {
    return OutOfRange("--max-queued-jobs-per-user", config.max_queued_jobs_per_user, "at least 1");
  }
  if (!(config.max_queued_core_seconds > 0)) {
    return OutOfRange("--max-queued-core-seconds", config.max_queued_core_seconds, "above 0");
  }
  if (config.max_job_attempts < 1) return OutOfRange("--max-job-attempts", config.max_job_attempts, "at least 1");
  if (!is_time(config.keep_finished_s)) {
    return OutOfRange("--keep-finished", config.keep_finished_s, "above 0 and at most 100 years, in seconds");
  }
  if (config.keep_finished_bytes < 0)
    return OutOfRange("--keep-finished-bytes", config.keep_finished_bytes, "at least 0");
  // Databases do not accept larger values.
  if (config.max_upload_bytes < 1 || config.max_upload_bytes > 1'000'000'000) {
    return OutOfRange("--max-upload-bytes", config.max_upload_bytes, "between 1 and 1000000000");
  }
  if (config.max_uploaded_bytes_per_user < 1) {
    return OutOfRange("--max-uploaded-bytes-per-user", config.max_uploaded_bytes_per_user, "at least 1");
  }
  if (config.max_uploaded_problems_per_user < 1) {
    return OutOfRange("--max-uploaded-problems-per-user", config.max_uploaded_problems_per_user, "at least 1");
  }
  if (!is_time(config.keep_problems_s)) {
    return OutOfRange("--keep-problems", config.keep_problems_s, "above 0 and at most 100 years, in seconds");
  }
  return absl::OkStatus();
}

// What a browser sends as the origin of a page: no path, no wildcard.
bool IsOrigin(const std::string& text) {
  const std::size_t host = text.starts_with("https://") ? 8 : text.starts_with("http://") ? 7 : 0;
  return host > 0 && text.size() > host && text.find_first_of("/?#*@ ", host) == std::string::npos;
}

bool IsHostName(const std::string& text) {
  return std::all_of(text.begin(), text.end(),
                     [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '.' || c == '_'; });
}

absl::Status ValidateWebPort(const ServerConfig& config) {
  if (absl::Status address = CheckHttpAddress("--http-listen", config.http_listen); !address.ok()) return address;
  for (const std::string& origin : SplitList(config.http_origins)) {
    if (IsOrigin(origin)) continue;
    return absl::InvalidArgumentError(fmt::format(
        "--http-origins {}: must be the origin of a site as browsers send it, https://HOST or https://HOST:PORT",
        origin));
  }
  for (const std::string& host : SplitList(config.http_hosts)) {
    if (IsHostName(host)) continue;
    return absl::InvalidArgumentError(fmt::format("--http-hosts {}: must be the name of a host, without a port", host));
  }
  if (!config.http_listen.empty() || (config.http_origins.empty() && config.http_hosts.empty()))
    return absl::OkStatus();
  return absl::InvalidArgumentError(
      fmt::format("--http-{}: has no effect without --http-listen", config.http_origins.empty() ? "hosts" : "origins"));
}

}  // namespace

std::vector<std::string> SplitList(const std::string& text) {
  std::vector<std::string> items;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::size_t first = text.find_first_not_of(' ', begin);
    if (first < end) items.push_back(text.substr(first, text.find_last_not_of(' ', end - 1) - first + 1));
    begin = end + 1;
  }
  return items;
}

absl::Status Validate(const ServerConfig& config) {
  if (absl::Status address = CheckAddress("--listen", ParseListenAddress(config.listen).status()); !address.ok())
    return address;
  if (absl::Status address = CheckHttpAddress("--metrics-listen", config.metrics_listen); !address.ok()) return address;
  if (absl::Status web = ValidateWebPort(config); !web.ok()) return web;
  if (config.max_concurrent_solves < 0 || config.max_concurrent_solves > 1024) {
    return OutOfRange("--max-concurrent-solves", config.max_concurrent_solves, "between 0 (automatic) and 1024");
  }
  if (config.threads < 0 || config.threads > 4096) {
    return OutOfRange("--threads", config.threads, "between 0 (all processors) and 4096");
  }
  // Shapes are int32 on the wire.
  constexpr std::int64_t kMaxSize = std::numeric_limits<std::int32_t>::max();
  if (config.max_states < 1 || config.max_states > kMaxSize) {
    return OutOfRange("--max-states", config.max_states, "between 1 and 2147483647");
  }
  if (config.max_dense_states < 1 || config.max_dense_states > kMaxSize) {
    return OutOfRange("--max-dense-states", config.max_dense_states, "between 1 and 2147483647");
  }
  if (config.max_constraints < 1 || config.max_constraints > kMaxSize) {
    return OutOfRange("--max-constraints", config.max_constraints, "between 1 and 2147483647");
  }
  if (config.max_steps < 1) return OutOfRange("--max-steps", config.max_steps, "at least 1");
  if (config.max_members < 1) return OutOfRange("--max-members", config.max_members, "at least 1");
  if (config.max_result_bytes < 1) return OutOfRange("--max-result-bytes", config.max_result_bytes, "at least 1");
  if (config.max_held_result_bytes < config.max_result_bytes) {
    return OutOfRange("--max-held-result-bytes", config.max_held_result_bytes, "at least --max-result-bytes");
  }
  if (config.max_memory_bytes < 1) return OutOfRange("--max-memory-bytes", config.max_memory_bytes, "at least 1");
  if (config.setup_cache_bytes < 0) return OutOfRange("--setup-cache-bytes", config.setup_cache_bytes, "at least 0");
  if (absl::Status status = ValidateStore(config); !status.ok()) return status;
  if (config.checkpoint_ms < 0) return OutOfRange("--checkpoint-ms", config.checkpoint_ms, "at least 0");
  if (absl::Status status = ValidateRanks(config); !status.ok()) return status;
  if (absl::Status status = ValidateJobs(config); !status.ok()) return status;
  // gRPC keeps the limit in an int.
  if (config.max_message_bytes < 1 || config.max_message_bytes > std::numeric_limits<int>::max()) {
    return OutOfRange("--max-message-bytes", config.max_message_bytes, "between 1 and 2147483647");
  }
  return Validate(config.access);
}

ServerConfig Resolved(ServerConfig config) {
  const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  if (config.max_concurrent_solves == 0) config.max_concurrent_solves = std::max(2, processors);
  if (config.threads == 0) config.threads = processors;
  if (config.max_ranks == 0 && !config.mpi_launcher.empty()) config.max_ranks = processors;
  return config;
}

SessionLimits ToSessionLimits(const ServerConfig& config) {
  SessionLimits limits;
  limits.max_states = config.max_states;
  limits.max_dense_states = config.max_dense_states;
  limits.max_constraints = config.max_constraints;
  limits.max_steps = config.max_steps;
  limits.max_result_bytes = config.max_result_bytes;
  limits.max_answer_bytes = kMaxAnswerBytes;
  limits.max_memory_bytes = static_cast<double>(config.max_memory_bytes);
  limits.max_threads = config.threads;
  limits.max_members = config.max_members;
  return limits;
}

}  // namespace dlcs
