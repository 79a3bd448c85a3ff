// SPDX-License-Identifier: Apache-2.0
// Accepts connections, as many as there are file descriptors for.

#ifndef DLCS_SERVER_NET_CONNECTION_LISTENER_H_
#define DLCS_SERVER_NET_CONNECTION_LISTENER_H_

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "server/net/listen_address.h"

namespace dlcs {

// gRPC 1.51 does not limit connections, and once the process has run out of descriptors (a thousand by default) its own
// listener never accepts again. So any client could end the service by opening connections. This listener closes new
// connections that would take the last kKeptDescriptors, which the store, its files and the probes need, and keeps
// accepting.
class ConnectionListener {
 public:
  static constexpr int kKeptDescriptors = 64;

  // Listens on every address that the host resolves to, of which at least one must work; connections wait until
  // Start(). Sets the port where it is 0. A Unix socket replaces one that is there, admits the user of this process
  // alone, and is removed at the end. Errors: Unavailable, with the address and why.
  static absl::StatusOr<std::unique_ptr<ConnectionListener>> Open(ListenAddress& address);
  ~ConnectionListener();

  // Calls `acceptor` from a thread with the descriptors of the listening socket and of each new connection, until this
  // object is destroyed. Call it once.
  using Acceptor = std::function<void(int listener, int connection)>;
  void Start(Acceptor acceptor);

 private:
  class Socket;

  ConnectionListener();
  void Run();
  // False if the process has no descriptors left.
  bool Accept(int listener);
  // Logs refused connections, at most once a second.
  void LogRefused(const char* why);

  std::vector<std::unique_ptr<Socket>> listeners_;
  std::string path_;              // of a Unix socket
  std::unique_ptr<Socket> wake_;  // ends the thread
  Acceptor acceptor_;
  std::int64_t refused_ = 0;  // since the last log line about it
  std::chrono::steady_clock::time_point next_log_;
  std::thread thread_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_NET_CONNECTION_LISTENER_H_
