// SPDX-License-Identifier: Apache-2.0
#include "client/cli/commands/interrupt.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>

#include "client/cli/terminal/progress_ticker.h"

namespace dlcs::client {
namespace {

constexpr std::array kSignals = {SIGINT, SIGTERM};

// The data used by the signal handler, which may run in any thread, between any two instructions.
std::atomic<int> first_signal{0};
std::atomic<int> wake{-1};  // a descriptor that becomes readable
static_assert(std::atomic<int>::is_always_lock_free);

void Write(int descriptor) {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = write(descriptor, &one, sizeof one);
}

extern "C" void OnInterrupt(int number) {
  const int error = errno;
  int none = 0;
  // The engine checks its token several times a second; a second signal ends the process at once.
  if (!first_signal.compare_exchange_strong(none, number)) {
    EraseProgressInSignalHandler();
    _exit(128 + number);
  }
  Write(wake.load());
  errno = error;
}

// Ctrl-Z: erases the progress display before the shell gets the screen. Then does what happens without a handler.
extern "C" void OnSuspend(int number) {
  const int error = errno;
  EraseProgressInSignalHandler();
  struct sigaction by_default {};
  struct sigaction this_one {};
  by_default.sa_handler = SIG_DFL;
  sigaction(number, &by_default, &this_one);
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, number);
  raise(number);
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);  // stops here
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  sigaction(number, &this_one, nullptr);
  errno = error;
}

// The previous handlers, in the order of kSignals, and that of SIGTSTP.
std::array<struct sigaction, kSignals.size()> before{};
struct sigaction before_suspend {};

void Catch() {
  struct sigaction action {};
  action.sa_handler = OnInterrupt;
  action.sa_flags = SA_RESTART;  // what is being written is written whole
  sigemptyset(&action.sa_mask);
  for (const int number : kSignals) sigaddset(&action.sa_mask, number);
  for (std::size_t k = 0; k < kSignals.size(); ++k) {
    sigaction(kSignals[k], nullptr, &before[k]);
    if (before[k].sa_handler != SIG_IGN) sigaction(kSignals[k], &action, nullptr);
  }
  sigaction(SIGTSTP, nullptr, &before_suspend);
  action.sa_handler = OnSuspend;
  if (before_suspend.sa_handler == SIG_DFL) sigaction(SIGTSTP, &action, nullptr);
}

}  // namespace

Interrupt::Interrupt() : finish_(eventfd(0, EFD_CLOEXEC)) {
  wake = eventfd(0, EFD_CLOEXEC);
  waiter_ = std::thread([this] { Wait(); });
  Catch();
}

Interrupt::~Interrupt() {
  for (std::size_t k = 0; k < kSignals.size(); ++k) sigaction(kSignals[k], &before[k], nullptr);
  sigaction(SIGTSTP, &before_suspend, nullptr);
  Write(finish_);
  waiter_.join();
  close(wake.exchange(-1));
  close(finish_);
}

int Interrupt::Signal() { return first_signal; }

void Interrupt::Wait() {
  for (;;) {
    std::array<pollfd, 2> ready = {pollfd{wake, POLLIN, 0}, pollfd{finish_, POLLIN, 0}};
    if (poll(ready.data(), ready.size(), -1) < 0) continue;  // interrupted
    if (ready[1].revents != 0) return;
    source_.request_stop();
    ready[0].fd = -1;
    while (poll(&ready[1], 1, -1) < 0) continue;
    return;
  }
}

}  // namespace dlcs::client
