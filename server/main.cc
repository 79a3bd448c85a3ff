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
#include "server/access/new_token.h"
#include "server/dlcs_server.h"
#include "server/flags.h"
#include "server/store_lock.h"
#include "server/telemetry/log.h"
#include "spdlog/spdlog.h"

namespace {

using std::chrono::milliseconds;

// A solve that was stopped has its summary ready within a fraction of a second; the rest is for slow readers.
constexpr milliseconds kDelivery{5000};

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
  if (flags->new_token) {
    const absl::Status made = dlcs::MakeToken(*flags->new_token);
    if (!made.ok()) std::fprintf(stderr, "dlcsd: %s\n", std::string(made.message()).c_str());
    return made.ok() ? 0 : 2;
  }
  dlcs::SetUpLog(flags->log_level, flags->log_format == "json" ? dlcs::LogFormat::kJson : dlcs::LogFormat::kText);
  for (const std::string& warning : flags->warnings) spdlog::warn("{}", warning);
  dlcs::KeepFreedMemory();

  // Blocked before any thread exists, so that all inherit it and only this one takes the signals.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigset_t blocked = signals;
  sigaddset(&blocked, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &blocked, nullptr);

  const absl::StatusOr<dlcs::StoreLock> lock = dlcs::StoreLock::Take(flags->config.store);
  if (!lock.ok()) {
    std::fprintf(stderr, "dlcsd: %s\n", std::string(lock.status().message()).c_str());
    return 3;
  }
  const absl::StatusOr<std::unique_ptr<dlcs::DlcsServer>> server = dlcs::DlcsServer::Start(flags->config);
  if (!server.ok()) {
    std::fprintf(stderr, "dlcsd: %s\n", std::string(server.status().message()).c_str());
    return absl::IsInvalidArgument(server.status()) ? 2 : 3;
  }
  if (!(*server)->metrics_address().empty()) spdlog::info("metrics on http://{}/metrics", (*server)->metrics_address());
  const dlcs::AccessSettings& access = flags->config.access;
  spdlog::info("listening on {}, {}, {}", (*server)->address(),
               access.tls_cert.empty()        ? "without encryption"
               : access.tls_client_ca.empty() ? "TLS"
                                              : "TLS with certificates of clients",
               access.tokens.empty() ? "open to all who can connect" : "users of " + access.tokens);
  std::printf("dlcsd listening on %s\n", (*server)->address().c_str());
  std::fflush(stdout);

  int signal = 0;
  while (sigwait(&blocked, &signal) == 0 && signal == SIGHUP) (*server)->Reload();
  spdlog::info("signal {}: shutting down, running solves have {} s", signal, flags->grace_s);
  ShutDown(**server, signals, flags->grace_s);
  spdlog::info("shut down");
  return 0;
}
