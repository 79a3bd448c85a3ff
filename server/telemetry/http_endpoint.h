// SPDX-License-Identifier: Apache-2.0
// The HTTP endpoint for monitoring: /metrics, /livez, /readyz.

#ifndef DLCS_SERVER_TELEMETRY_HTTP_ENDPOINT_H_
#define DLCS_SERVER_TELEMETRY_HTTP_ENDPOINT_H_

#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "absl/status/statusor.h"

namespace httplib {
class Server;
}

namespace dlcs {

// The contents of the pages. Called from threads of the endpoint as long as it lives.
struct HttpPages {
  std::function<std::string()> metrics;
  std::function<std::string()> why_not_ready;  // why the server cannot serve calls; empty if it can
  std::function<std::string()> why_no_jobs;    // why it cannot run jobs; empty if it can
};

// Plain HTTP without authentication; it shows nothing about problems or users. Two threads, one request per connection;
// further requests wait.
class HttpEndpoint {
 public:
  // Serves when it returns. `address` is HOST:PORT as for gRPC, port 0 picks one. Errors: as ParseListenAddress() and
  // CheckCanListen().
  static absl::StatusOr<std::unique_ptr<HttpEndpoint>> Start(const std::string& address, HttpPages pages);
  ~HttpEndpoint();

  const std::string& address() const { return address_; }

 private:
  explicit HttpEndpoint(HttpPages pages);

  const HttpPages pages_;
  std::string address_;
  const std::unique_ptr<httplib::Server> server_;
  std::thread thread_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_TELEMETRY_HTTP_ENDPOINT_H_
