// SPDX-License-Identifier: Apache-2.0
// Ctrl-C and SIGTERM as a stop token.

#ifndef DLCS_CLIENT_CLI_COMMANDS_INTERRUPT_H_
#define DLCS_CLIENT_CLI_COMMANDS_INTERRUPT_H_

#include <stop_token>
#include <thread>

namespace dlcs::client {

// While it lives, the first SIGINT or SIGTERM requests the stop, and the second one ends the process at once with the
// exit code of a killed program, 128 plus the number of the signal. A signal that was ignored when the program started
// (by the shell's `&` or nohup) stays ignored. Works whichever thread receives the signal. Before the second signal
// ends the process, and before Ctrl-Z stops it, the progress display is erased. One object at a time.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();

  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  std::stop_token token() const { return source_.get_token(); }

  // The first signal received while any of these objects lived, SIGINT or SIGTERM; 0 if none.
  static int Signal();

 private:
  void Wait();

  std::stop_source source_;
  int finish_;  // a descriptor that becomes readable when this object is destroyed
  std::thread waiter_;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMANDS_INTERRUPT_H_
