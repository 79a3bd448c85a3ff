// SPDX-License-Identifier: Apache-2.0
#include "client/cli/interrupt.h"

#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdint>

#include "client/cli/exit_code.h"

namespace dlcs::client {
namespace {

sigset_t InterruptSignals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}

}  // namespace

Interrupt::Interrupt() : finish_(eventfd(0, EFD_CLOEXEC)) {
  const sigset_t set = InterruptSignals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  signals_ = signalfd(-1, &set, SFD_CLOEXEC);
  waiter_ = std::thread([this] { Wait(); });
}

Interrupt::~Interrupt() {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = write(finish_, &one, sizeof one);
  waiter_.join();
  close(signals_);
  close(finish_);
  const sigset_t set = InterruptSignals();
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
}

void Interrupt::Wait() {
  for (;;) {
    std::array<pollfd, 2> ready = {pollfd{signals_, POLLIN, 0}, pollfd{finish_, POLLIN, 0}};
    if (poll(ready.data(), ready.size(), -1) < 0) continue;  // interrupted by a debugger
    if (ready[1].revents != 0) return;
    signalfd_siginfo info;
    if (read(signals_, &info, sizeof info) != sizeof info) continue;
    // The engine looks at its token several times a second; who is in a greater hurry presses twice.
    if (!source_.request_stop()) _exit(kServiceFailed);
  }
}

}  // namespace dlcs::client
