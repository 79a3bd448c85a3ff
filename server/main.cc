// SPDX-License-Identifier: Apache-2.0
// dlcsd: start, signals, wait.

#include <signal.h>

#include <chrono>
#include <cstdio>
#include <ctime>
#include <memory>
#include <optional>
#include <string>

#include "core/heap.h"
#include "google/protobuf/stubs/logging.h"
#include "grpc/support/log.h"
#include "server/dlcs_server.h"
#include "server/flags.h"
#include "spdlog/sinks/stdout_color_sinks.h"
#include "spdlog/spdlog.h"

namespace {

using std::chrono::milliseconds;

// A solve that was stopped has its summary ready within a fraction of a second; the rest is for slow readers.
constexpr milliseconds kDelivery{5000};

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

// Runs the shutdown of which --help tells.
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
  int exit_status = 0;
  const std::optional<dlcs::Flags> flags = dlcs::ReadFlags(argc, argv, exit_status);
  if (!flags) return exit_status;
  SetUpLogging(flags->log_level);
  dlcs::KeepFreedMemory();

  // Blocked before any thread exists, so that all inherit it and only this one takes the signals.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);

  const absl::StatusOr<std::unique_ptr<dlcs::DlcsServer>> server = dlcs::DlcsServer::Start(flags->config);
  if (!server.ok()) {
    std::fprintf(stderr, "dlcsd: %s\n", std::string(server.status().message()).c_str());
    return absl::IsInvalidArgument(server.status()) ? 2 : 3;
  }
  std::printf("dlcsd listening on %s\n", (*server)->address().c_str());
  std::fflush(stdout);

  int signal = 0;
  sigwait(&signals, &signal);
  spdlog::info("signal {}: shutting down, running solves have {} s", signal, flags->grace_s);
  ShutDown(**server, signals, flags->grace_s);
  spdlog::info("shut down");
  return 0;
}
