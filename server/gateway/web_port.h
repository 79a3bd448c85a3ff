// SPDX-License-Identifier: Apache-2.0
// The port for browsers and scripts: calls over HTTP/1.1 (rpc_gateway.h) and the web page.

#ifndef DLCS_SERVER_GATEWAY_WEB_PORT_H_
#define DLCS_SERVER_GATEWAY_WEB_PORT_H_

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "grpcpp/channel.h"
#include "server/access/access.h"

namespace dlcs {

struct WebPortOptions {
  std::string listen;  // HOST:PORT
  // Other origins whose pages may call this server ("https://plots.example.org"); none by default.
  std::vector<std::string> origins;
  // Names that requests may use for this server besides localhost, IP addresses and the host of `listen`. A page of
  // another site that points a name of its own to this server (DNS rebinding) is refused.
  std::vector<std::string> hosts;
  std::size_t max_message_bytes = 0;
};

class WebPort {
 public:
  // Serves when it returns. Uses the certificate of `access` if it has one. `channel` leads to the gRPC server of this
  // process, which must outlive this object, as `access` must. Errors: as HttpServer::Start().
  static absl::StatusOr<std::unique_ptr<WebPort>> Start(const WebPortOptions& options, const Access& access,
                                                        std::shared_ptr<grpc::Channel> channel);
  ~WebPort();

  // "127.0.0.1:8080", with the actual port.
  const std::string& address() const;
  int connections() const;

  // Lets responses under way finish for up to `delivery`, then closes all connections.
  void Close(std::chrono::milliseconds delivery);

 private:
  class State;
  explicit WebPort(std::unique_ptr<State> state);
  const std::unique_ptr<State> state_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_GATEWAY_WEB_PORT_H_
