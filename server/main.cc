// SPDX-License-Identifier: Apache-2.0
// dlcsd: start, signals, wait.

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "absl/synchronization/mutex.h"
#include "core/parallel/memory_pages.h"
#include "server/access/token_command.h"
#include "server/dlcs_server.h"
#include "server/flags.h"
#include "server/log.h"
#include "server/store/store_lock.h"
#include "spdlog/spdlog.h"

namespace {

using std::chrono::milliseconds;

// A stopped solve has its summary ready within a fraction of a second; the remaining time is for slow readers.
constexpr milliseconds kDelivery{5000};

// The handler writes the number of each signal here. It is a handler and not a signal mask, because libraries start
// threads before main() that do not block signals. The handler of dlcs (client/cli/commands/interrupt) is separate: it
// stops one command, ends the process at the second signal, and is removed after the command.
std::array<int, 2> signal_pipe;

extern "C" void OnSignal(int number) {
  const int error = errno;
  const char byte = static_cast<char>(number);
  [[maybe_unused]] const ssize_t written = write(signal_pipe[1], &byte, 1);
  errno = error;
}

bool CatchSignals() {
  if (pipe2(signal_pipe.data(), O_CLOEXEC) != 0) return false;
  struct sigaction action {};
  action.sa_handler = OnSignal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  for (const int number : {SIGTERM, SIGINT, SIGHUP}) sigaction(number, &action, nullptr);
  return true;
}

// The next signal, or 0 if none arrives within `wait_ms` milliseconds; -1 waits forever.
int NextSignal(int wait_ms) {
  pollfd readable{.fd = signal_pipe[0], .events = POLLIN, .revents = 0};
  int ready = 0;
  do {
    ready = poll(&readable, 1, wait_ms);
  } while (ready < 0 && errno == EINTR);
  char number = 0;
  return ready > 0 && read(signal_pipe[0], &number, 1) == 1 ? number : 0;
}

// Waits for a signal that ends the server, and handles others. Returns why the server ends.
std::string AwaitEnd(dlcs::DlcsServer& server, std::chrono::duration<double> idle_limit) {
  constexpr int kLook_ms = 100;
  const bool ends_when_idle = idle_limit.count() > 0;
  for (;;) {
    const int signal = NextSignal(ends_when_idle ? kLook_ms : -1);
    if (signal == SIGHUP) server.Reload();
    if (signal == SIGTERM || signal == SIGINT) return "signal " + std::to_string(signal);
    if (ends_when_idle && server.JobsIdleFor() >= idle_limit) return "no job to claim";
  }
}

// Runs the shutdown that --help describes.
void ShutDown(dlcs::DlcsServer& server, double grace_s) {
  server.Drain();
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(grace_s);
  while (!server.WaitUntilIdle(milliseconds(50)) && std::chrono::steady_clock::now() < end) {
    const int signal = NextSignal(0);
    if (signal == SIGTERM || signal == SIGINT) break;
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
  dlcs::RetainFreedMemory();
  // Debian's Abseil has assertions: each lock in gRPC would be looked up in a graph of all, and a cycle would abort.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);

  if (!CatchSignals()) {
    std::perror("dlcsd: a pipe for signals");
    return 3;
  }

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
  const std::string page = (*server)->web_url();
  if (!page.empty()) std::printf("dlcsd page on %s\n", page.c_str());
  std::fflush(stdout);

  const std::string why = AwaitEnd(**server, std::chrono::duration<double>(flags->config.exit_when_idle_s));
  spdlog::info("{}: shutting down, running solves have {} s", why, flags->grace_s);
  ShutDown(**server, flags->grace_s);
  spdlog::info("shut down");
  return 0;
}
