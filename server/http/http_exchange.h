// SPDX-License-Identifier: Apache-2.0
// One request to the HTTP server and its response, and within which bounds it is served.

#ifndef DLCS_SERVER_HTTP_HTTP_EXCHANGE_H_
#define DLCS_SERVER_HTTP_HTTP_EXCHANGE_H_

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "boost/asio/any_io_executor.hpp"
#include "boost/asio/awaitable.hpp"
#include "server/access/tls_files.h"
#include "server/http/http_message.h"

namespace dlcs {

// One request and its response. Used by its handler alone, on the executor of its connection. What is sent to a client
// that has disconnected is dropped.
class HttpExchange {
 public:
  virtual ~HttpExchange() = default;

  virtual const HttpRequest& request() const = 0;
  virtual boost::asio::any_io_executor executor() const = 0;

  // Reads the body, of which nothing was read before. Errors: ResourceExhausted for more than `max_bytes`, or if the
  // server has no memory for it at the moment; InvalidArgument for a malformed one; Cancelled if the client
  // disconnected or sent nothing for too long.
  virtual boost::asio::awaitable<absl::StatusOr<std::string>> ReadBody(std::size_t max_bytes) = 0;

  // Calls `disconnected` once, on the executor, when the client closes the connection before the response is complete.
  virtual void OnDisconnect(std::function<void()> disconnected) = 0;

  // Sends a whole response. Do so once, or Begin() one, Write() its body in pieces and End() it. Write() returns when
  // the operating system has taken the piece, so a slow reader slows the writer; false if the client is gone.
  virtual boost::asio::awaitable<void> Reply(HttpResponse response) = 0;
  virtual boost::asio::awaitable<void> Begin(int status, HttpHeaders headers) = 0;
  virtual boost::asio::awaitable<bool> Write(std::string piece) = 0;
  virtual boost::asio::awaitable<void> End() = 0;
};

using HttpHandler = std::function<boost::asio::awaitable<void>(HttpExchange&)>;

struct HttpServerOptions {
  int threads = 2;
  // Returns the newest certificate; called before each handshake. No encryption if the function is empty.
  std::function<std::shared_ptr<const TlsFiles>()> tls = {};
  std::size_t max_header_bytes = 16 << 10;  // beyond: 431
  // The bodies of all requests that are being read or answered; beyond, requests are refused.
  std::size_t max_held_bytes = std::size_t{256} << 20;
  // Closes connections that do not finish a handshake or the headers of a request, or do not send more of a body, for
  // this long.
  std::chrono::milliseconds patience{10'000};
  std::chrono::milliseconds idle{75'000};  // the same limit between two requests
};

}  // namespace dlcs

#endif  // DLCS_SERVER_HTTP_HTTP_EXCHANGE_H_
