// SPDX-License-Identifier: Apache-2.0
// Ctrl-C as a stop token.

#ifndef DLCS_CLIENT_CLI_INTERRUPT_H_
#define DLCS_CLIENT_CLI_INTERRUPT_H_

#include <stop_token>
#include <thread>

namespace dlcs::client {

// While it lives, the first SIGINT or SIGTERM requests the stop and the second one ends the process at once.
// To be made before any other thread: threads inherit which signals they leave to the one that waits here.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();

  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  std::stop_token token() const { return source_.get_token(); }

 private:
  void Wait();

  std::stop_source source_;
  int signals_;  // a descriptor that is readable when a signal came
  int finish_;   // a descriptor that is readable when this object goes
  std::thread waiter_;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_INTERRUPT_H_
