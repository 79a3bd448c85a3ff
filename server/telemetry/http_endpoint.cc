// SPDX-License-Identifier: Apache-2.0
#include "server/telemetry/http_endpoint.h"

#include <sys/socket.h>

#include <chrono>
#include <utility>

#include "fmt/format.h"
#include "httplib.h"
#include "server/net/listen_address.h"

namespace dlcs {
namespace {

constexpr int kThreads = 2;
constexpr std::size_t kMaxRequestBytes = 64 << 10;
constexpr std::chrono::seconds kPatience{5};  // with a client that is slow to ask or to read

httplib::Server::Handler Probe(const std::function<std::string()>& why_not) {
  return [&why_not](const httplib::Request&, httplib::Response& response) {
    const std::string reason = why_not();
    if (!reason.empty()) response.status = 503;
    response.set_content(reason.empty() ? "ok\n" : reason + "\n", "text/plain");
  };
}

}  // namespace

HttpEndpoint::HttpEndpoint(HttpPages pages) : pages_(std::move(pages)), server_(std::make_unique<httplib::Server>()) {
  httplib::Server& server = *server_;
  server.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
  server.set_keep_alive_max_count(1);
  server.set_read_timeout(kPatience);
  server.set_write_timeout(kPatience);
  server.set_payload_max_length(kMaxRequestBytes);
  // The library's own options share the port with a second server, which silently takes half of the requests.
  server.set_socket_options([](socket_t socket) {
    const int on = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  });
  server.Get("/metrics", [this](const httplib::Request&, httplib::Response& response) {
    response.set_content(pages_.metrics(), "text/plain; version=0.0.4; charset=utf-8");
  });
  server.Get("/livez",
             [](const httplib::Request&, httplib::Response& response) { response.set_content("ok\n", "text/plain"); });
  server.Get("/readyz", Probe(pages_.why_not_ready));
  server.Get("/readyz/jobs", Probe(pages_.why_no_jobs));
}

absl::StatusOr<std::unique_ptr<HttpEndpoint>> HttpEndpoint::Start(const std::string& address, HttpPages pages) {
  absl::StatusOr<ListenAddress> place = ParseListenAddress(address);
  if (!place.ok()) return place.status();
  if (absl::Status can_listen = CheckCanListen(*place); !can_listen.ok()) return can_listen;
  std::unique_ptr<HttpEndpoint> result(new HttpEndpoint(std::move(pages)));
  httplib::Server& server = *result->server_;
  const bool bound = place->port == 0 ? (place->port = server.bind_to_any_port(place->host)) > 0
                                      : server.bind_to_port(place->host, place->port);
  if (!bound) return absl::UnavailableError(fmt::format("cannot listen on {}", address));
  result->address_ = ToString(*place);
  result->thread_ = std::thread([&server] { server.listen_after_bind(); });
  // A stop() before it has started would be lost.
  while (!server.is_running()) std::this_thread::yield();
  return result;
}

HttpEndpoint::~HttpEndpoint() {
  server_->stop();
  if (thread_.joinable()) thread_.join();
}

}  // namespace dlcs
