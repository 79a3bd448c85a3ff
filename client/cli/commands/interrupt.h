// SPDX-License-Identifier: Apache-2.0
// Ctrl-C and SIGTERM as a stop token.

#ifndef DLCS_CLIENT_CLI_COMMANDS_INTERRUPT_H_
#define DLCS_CLIENT_CLI_COMMANDS_INTERRUPT_H_

#include <stop_token>
#include <thread>

namespace dlcs::client {

// While it lives, the first SIGINT or SIGTERM requests the stop, and the second one ends the process at once with the
// exit code of a program that it killed, 128 and its number. A signal that was ignored when the program began, as the
// shell's `&` and nohup arrange it, stays ignored. Which thread the system gives a signal to does not matter: libraries
// start some before main(). One object at a time.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();

  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  std::stop_token token() const { return source_.get_token(); }

  // The first signal that came while any of these objects lived, SIGINT or SIGTERM; 0 where none did.
  static int Signal();

 private:
  void Wait();

  std::stop_source source_;
  int finish_;  // a descriptor that is readable when this object goes
  std::thread waiter_;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMANDS_INTERRUPT_H_
