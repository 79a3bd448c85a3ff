// SPDX-License-Identifier: Apache-2.0
// Takes connections for gRPC, as many as there are file descriptors for.

#ifndef DLCS_SERVER_NET_CONNECTION_LISTENER_H_
#define DLCS_SERVER_NET_CONNECTION_LISTENER_H_

#include <chrono>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "grpcpp/server_builder.h"
#include "server/net/listen_address.h"

namespace dlcs {

// gRPC 1.51 counts no connections, and once a process is out of descriptors its own listener is deaf for good: whoever
// can connect, a thousand times by default, ends the service. This one closes connections that would take the last
// kKeptDescriptors, which the store, its files and the probes need, as they come, and never gives up.
class ConnectionListener {
 public:
  static constexpr int kKeptDescriptors = 64;

  // Listens on every address that the host stands for, of which one at least must work; connections wait until Start().
  // Sets the port where it is 0. Errors: Unavailable, with the address and why.
  static absl::StatusOr<std::unique_ptr<ConnectionListener>> Open(ListenAddress& address);
  ~ConnectionListener();

  // Hands connections to `acceptor`, from a thread, until it is destroyed, which is to be before the server shuts down.
  // Call it once.
  void Start(std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor);

 private:
  class Socket;

  ConnectionListener();
  void Run();
  // False where the process has no descriptors left.
  bool Accept(int listener);
  // In the log, at most once a second.
  void SayRefused(const char* why);

  std::vector<std::unique_ptr<Socket>> listeners_;
  std::unique_ptr<Socket> wake_;  // tells the thread to end
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor_;
  std::int64_t refused_ = 0;  // since the last word about it
  std::chrono::steady_clock::time_point next_word_;
  std::thread thread_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_NET_CONNECTION_LISTENER_H_
