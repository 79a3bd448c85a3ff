// SPDX-License-Identifier: Apache-2.0
// An HTTP/1.1 server: connections, TLS, requests and responses, within bounds. A handler makes the responses.

#ifndef DLCS_SERVER_HTTP_HTTP_SERVER_H_
#define DLCS_SERVER_HTTP_HTTP_SERVER_H_

#include <chrono>
#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/http/http_exchange.h"
#include "server/net/listen_address.h"

namespace dlcs {

// Answers requests with `handler`, one at a time per connection, on a few threads; a waiting response costs no thread.
// Accepts as many connections as there are file descriptors for (net/connection_listener.h).
class HttpServer {
 public:
  // Serves when it returns; sets the port of `address` where it is 0. Errors: as CheckCanListen() and
  // ConnectionListener::Open().
  static absl::StatusOr<std::unique_ptr<HttpServer>> Start(ListenAddress& address, HttpServerOptions options,
                                                           HttpHandler handler);
  // Close(0).
  ~HttpServer();

  // Accepts no more connections, lets responses under way finish for up to `delivery`, then closes all connections and
  // waits until their handlers have returned. May be called more than once.
  void Close(std::chrono::milliseconds delivery);

  int connections() const;

 private:
  class State;
  explicit HttpServer(std::unique_ptr<State> state);
  const std::unique_ptr<State> state_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_HTTP_HTTP_SERVER_H_
