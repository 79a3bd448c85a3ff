// SPDX-License-Identifier: Apache-2.0
// What monitoring asks for over HTTP: /metrics, /livez, /readyz.

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

// What the pages say. Called from threads of the endpoint, as long as it lives.
struct HttpPages {
  std::function<std::string()> metrics;
  std::function<std::string()> why_not_ready;  // to take calls; empty: it is
  std::function<std::string()> why_no_jobs;    // likewise jobs
};

// Plain HTTP without users: numbers about the server, none about what it computes or for whom. Two threads, one request
// a connection; others wait.
class HttpEndpoint {
 public:
  // Answers when it returns. `address` is HOST:PORT as for gRPC, port 0 picks one. Errors: as ParseListenAddress() and
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
