// SPDX-License-Identifier: Apache-2.0
// dlcsd: flags, signals, wait.

#include <signal.h>

#include <chrono>
#include <cstdio>
#include <ctime>
#include <memory>
#include <string>

#include "CLI/CLI.hpp"
#include "core/heap.h"
#include "google/protobuf/stubs/logging.h"
#include "grpc/support/log.h"
#include "server/dlcs_server.h"
#include "server/version.h"
#include "spdlog/sinks/stdout_color_sinks.h"
#include "spdlog/spdlog.h"

namespace {

using std::chrono::milliseconds;

// A solve that was stopped has its summary ready within a fraction of a second; the rest is for slow readers.
constexpr milliseconds kDelivery{5000};

struct Flags {
  dlcs::ServerConfig config;
  double grace_s = 10;
  std::string log_level = "info";
};

void AddFlags(CLI::App& app, Flags& flags) {
  dlcs::ServerConfig& config = flags.config;
  app.add_option("--listen", config.listen, "HOST:PORT; port 0 picks a free one")->capture_default_str();
  app.add_option("--max-concurrent-solves", config.max_concurrent_solves,
                 "Solves at once, more are refused; 0: one per processor, at least 2")
      ->capture_default_str();
  app.add_option("--threads", config.threads, "Threads of one solve; 0: all processors")
      ->capture_default_str();
  app.add_option("--max-states", config.max_states, "Largest number of states (rows of A)")
      ->capture_default_str();
  app.add_option("--max-dense-states", config.max_dense_states, "The same where A is written down entry by entry")
      ->capture_default_str();
  app.add_option("--max-constraints", config.max_constraints, "Largest number of pairs (rows of M)")
      ->capture_default_str();
  app.add_option("--max-steps", config.max_steps, "Most steps of one solve")->capture_default_str();
  app.add_option("--max-members", config.max_members, "Most members of one ensemble")->capture_default_str();
  app.add_option("--max-result-bytes", config.max_result_bytes, "Largest trajectory of one solve")
      ->capture_default_str();
  app.add_option("--max-held-result-bytes", config.max_held_result_bytes,
                 "All trajectories in memory together")
      ->capture_default_str();
  app.add_option("--max-memory-bytes", config.max_memory_bytes, "What one solve may allocate")->capture_default_str();
  app.add_option("--setup-cache-bytes", config.setup_cache_bytes,
                 "Matrix functions and factors kept for further solves of the same matrices; 0 keeps none")
      ->capture_default_str();
  app.add_option("--store", config.store, "File of jobs, made where there is none; without it no jobs are taken");
  app.add_option("--checkpoint-ms", config.checkpoint_ms, "How often what a running job has found is stored")
      ->capture_default_str();
  app.add_option("--max-message-bytes", config.max_message_bytes, "Largest request")->capture_default_str();
  app.add_option("--grace", flags.grace_s, "Seconds that running solves are given on SIGTERM or SIGINT")
      ->check(CLI::Range(0.0, 86400.0))
      ->capture_default_str();
  app.add_option("--log-level", flags.log_level, "Of the lines on standard error")
      ->check(CLI::IsMember({"debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  app.set_version_flag("--version", std::string("dlcsd ") + dlcs::kVersion);
  app.footer(
      "Prints one line on standard output when it is ready: dlcsd listening on HOST:PORT.\n"
      "SIGTERM and SIGINT end it: no new solves, running ones get the grace period, then they are stopped "
      "and\n"
      "deliver their summary. A second signal skips the rest of the grace period.\n"
      "Exit status: 0 after a signal, 2 for a bad flag, 3 when it cannot listen.\n\n"
      "Examples:\n"
      "  dlcsd                                     serve this machine on port 50051\n"
      "  dlcsd --listen 127.0.0.1:0                on any free port, which is printed\n"
      "  dlcsd --listen 0.0.0.0:50051 --threads 4  serve the network, four threads per solve\n"
      "  dlcsd --store jobs.db                     take jobs as well, which outlive this server");
}

void LogFromGrpc(gpr_log_func_args* args) {
  switch (args->severity) {
    case GPR_LOG_SEVERITY_ERROR:
      return spdlog::error("gRPC: {}", args->message);
    case GPR_LOG_SEVERITY_INFO:
      return spdlog::info("gRPC: {}", args->message);
    case GPR_LOG_SEVERITY_DEBUG:
      return spdlog::debug("gRPC: {}", args->message);
  }
}

void LogFromProtobuf(google::protobuf::LogLevel level, const char*, int, const std::string& message) {
  spdlog::log(level >= google::protobuf::LOGLEVEL_ERROR ? spdlog::level::err : spdlog::level::info,
              "protobuf: {}", message);
}

void SetUpLogging(const std::string& level) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("dlcsd"));
  spdlog::set_level(spdlog::level::from_str(level));
  gpr_set_log_function(LogFromGrpc);
  google::protobuf::SetLogHandler(LogFromProtobuf);
}

// Runs the shutdown of which the footer of the help tells.
void ShutDown(dlcs::DlcsServer& server, const sigset_t& signals, double grace_s) {
  server.Drain();
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(grace_s);
  while (!server.WaitUntilIdle(milliseconds(50)) && std::chrono::steady_clock::now() < end) {
    const timespec no_wait{};
    if (sigtimedwait(&signals, nullptr, &no_wait) > 0) break;
  }
  server.Stop(kDelivery);
}

}  // namespace

int main(int argc, char** argv) {
  Flags flags;
  CLI::App app("dlcsd solves differential linear complementarity systems over gRPC.", "dlcsd");
  AddFlags(app, flags);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  SetUpLogging(flags.log_level);
  dlcs::KeepFreedMemory();

  // Blocked before any thread exists, so that all inherit it and only this one takes the signals.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);

  const absl::StatusOr<std::unique_ptr<dlcs::DlcsServer>> server = dlcs::DlcsServer::Start(flags.config);
  if (!server.ok()) {
    std::fprintf(stderr, "dlcsd: %s\n", std::string(server.status().message()).c_str());
    return absl::IsInvalidArgument(server.status()) ? 2 : 3;
  }
  std::printf("dlcsd listening on %s\n", (*server)->address().c_str());
  std::fflush(stdout);

  int signal = 0;
  sigwait(&signals, &signal);
  spdlog::info("signal {}: shutting down, running solves have {} s", signal, flags.grace_s);
  ShutDown(**server, signals, flags.grace_s);
  spdlog::info("shut down");
  return 0;
}
