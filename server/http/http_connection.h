// SPDX-License-Identifier: Apache-2.0
// One connection of the HTTP server: handshake, requests, responses.

#ifndef DLCS_SERVER_HTTP_HTTP_CONNECTION_H_
#define DLCS_SERVER_HTTP_HTTP_CONNECTION_H_

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <set>
#include <utility>

#include "boost/asio/basic_stream_socket.hpp"
#include "boost/asio/io_context.hpp"
#include "boost/asio/ip/tcp.hpp"
#include "boost/asio/ssl/context.hpp"
#include "boost/asio/strand.hpp"
#include "server/http/http_exchange.h"

namespace dlcs {

using HttpSocket =
    boost::asio::basic_stream_socket<boost::asio::ip::tcp, boost::asio::strand<boost::asio::io_context::executor_type>>;

// Counts the bytes of the bodies that the server holds.
class HeldBytes {
 public:
  explicit HeldBytes(std::size_t most) : most_(most) {}

  bool Take(std::size_t bytes) {
    if (held_.fetch_add(bytes) + bytes <= most_) return true;
    held_ -= bytes;
    return false;
  }
  void Release(std::size_t bytes) { held_ -= bytes; }

 private:
  const std::size_t most_;
  std::atomic<std::size_t> held_ = 0;
};

class HttpConnection;

// What connections share with their server.
struct HttpConnections {
  HttpConnections(HttpServerOptions the_options, HttpHandler the_handler)
      : options(std::move(the_options)), handler(std::move(the_handler)), held(options.max_held_bytes) {}

  const HttpServerOptions options;
  const HttpHandler handler;
  HeldBytes held;
  std::atomic<bool> closing = false;

  std::mutex mutex;  // guards the following member
  std::condition_variable ended;
  std::set<HttpConnection*> connections;
};

// A connection, from accept to close. Everything happens on its strand.
class HttpConnection : public HttpExchange, public std::enable_shared_from_this<HttpConnection> {
 public:
  explicit HttpConnection(HttpConnections& shared) : shared_(shared) {
    const std::lock_guard lock(shared_.mutex);
    shared_.connections.insert(this);
  }
  ~HttpConnection() override {
    const std::lock_guard lock(shared_.mutex);
    shared_.connections.erase(this);
    shared_.ended.notify_all();
  }

  // Closes the connection if it is idle between two requests, or in any case if `force` is set. From any thread; the
  // caller holds a reference.
  virtual void CloseSoon(bool force) = 0;

 protected:
  HttpConnections& shared_;
};

// Serves requests on `socket` until the connection is closed, encrypted unless `tls` is null. `connections` must
// outlive it.
void ServeHttpConnection(HttpConnections& connections, HttpSocket socket,
                         std::shared_ptr<boost::asio::ssl::context> tls);

}  // namespace dlcs

#endif  // DLCS_SERVER_HTTP_HTTP_CONNECTION_H_
