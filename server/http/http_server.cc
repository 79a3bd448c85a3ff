// SPDX-License-Identifier: Apache-2.0
#include "server/http/http_server.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <openssl/ssl.h>
#include <sys/socket.h>

#include <optional>
#include <thread>
#include <vector>

#include "boost/asio/buffer.hpp"
#include "boost/asio/executor_work_guard.hpp"
#include "boost/asio/io_context.hpp"
#include "boost/asio/ip/tcp.hpp"
#include "boost/asio/ssl/context.hpp"
#include "boost/asio/strand.hpp"
#include "server/http/http_connection.h"
#include "server/net/connection_listener.h"
#include "spdlog/spdlog.h"

namespace dlcs {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;
using std::chrono::milliseconds;

// Notices a broken link within some 15 s, as gRPC's keepalive does.
void SetKeepalive(int socket) {
  const auto set = [socket](int level, int name, int value) { setsockopt(socket, level, name, &value, sizeof value); };
  set(SOL_SOCKET, SO_KEEPALIVE, 1);
  set(IPPROTO_TCP, TCP_KEEPIDLE, 10);
  set(IPPROTO_TCP, TCP_KEEPINTVL, 3);
  set(IPPROTO_TCP, TCP_KEEPCNT, 2);
}

// Null, with a line in the log, for files that OpenSSL does not accept.
std::shared_ptr<asio::ssl::context> ContextOf(const TlsFiles& files) {
  auto context = std::make_shared<asio::ssl::context>(asio::ssl::context::tls_server);
  error_code error;
  const auto ok = [&error] { return !error; };
  context->set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_sslv2 |
                           asio::ssl::context::no_sslv3 | asio::ssl::context::no_tlsv1 | asio::ssl::context::no_tlsv1_1,
                       error);
  if (ok()) context->use_certificate_chain(asio::buffer(files.certificate), error);
  if (ok()) context->use_private_key(asio::buffer(files.key), asio::ssl::context::pem, error);
  if (ok() && !files.client_ca.empty()) {
    context->add_certificate_authority(asio::buffer(files.client_ca), error);
    if (ok()) context->set_verify_mode(asio::ssl::verify_peer | asio::ssl::verify_fail_if_no_peer_cert, error);
    SSL_CTX_set_session_id_context(context->native_handle(), reinterpret_cast<const unsigned char*>("dlcs"), 4);
  }
  if (error) {
    spdlog::error("the certificate cannot be used for HTTPS: {}", error.message());
    return nullptr;
  }
  return context;
}

}  // namespace

class HttpServer::State {
 public:
  State(HttpServerOptions options, HttpHandler handler)
      : shared_(std::move(options), std::move(handler)), context_(shared_.options.threads) {}

  absl::Status Listen(ListenAddress& address) {
    absl::StatusOr<std::unique_ptr<ConnectionListener>> listener = ConnectionListener::Open(address);
    if (!listener.ok()) return listener.status();
    listener_ = *std::move(listener);
    for (int k = 0; k < shared_.options.threads; ++k) {
      threads_.emplace_back([this] { context_.run(); });
    }
    listener_->Start([this](int /*listener*/, int connection) { Serve(connection); });
    return absl::OkStatus();
  }

  void Close(milliseconds delivery) {
    if (threads_.empty()) return;
    listener_.reset();
    shared_.closing = true;
    CloseAll(false);
    if (!WaitUntilAllEnded(delivery)) CloseAll(true);
    WaitUntilAllEnded(std::nullopt);
    guard_.reset();
    threads_.clear();
  }

  int connections() {
    const std::lock_guard lock(shared_.mutex);
    return static_cast<int>(shared_.connections.size());
  }

 private:
  void CloseAll(bool force) {
    std::vector<std::shared_ptr<HttpConnection>> open;  // released without the mutex, which their destructors lock
    {
      const std::lock_guard lock(shared_.mutex);
      for (HttpConnection* const connection : shared_.connections) {
        if (auto alive = connection->weak_from_this().lock()) open.push_back(std::move(alive));
      }
    }
    for (const auto& connection : open) connection->CloseSoon(force);
  }

  // If `limit` is absent, waits as long as it takes, and closes connections that were accepted late.
  bool WaitUntilAllEnded(std::optional<milliseconds> limit) {
    const auto all_ended = [this] { return shared_.connections.empty(); };
    std::unique_lock lock(shared_.mutex);
    if (limit) return shared_.ended.wait_for(lock, *limit, all_ended);
    while (!shared_.ended.wait_for(lock, milliseconds(100), all_ended)) {
      lock.unlock();
      CloseAll(true);
      lock.lock();
    }
    return true;
  }

  void Serve(int descriptor) {
    SetKeepalive(descriptor);
    HttpSocket socket(asio::make_strand(context_.get_executor()));
    error_code error;
    sockaddr_storage address{};
    socklen_t size = sizeof address;
    getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size);
    socket.assign(address.ss_family == AF_INET6 ? asio::ip::tcp::v6() : asio::ip::tcp::v4(), descriptor, error);
    if (error) return;
    std::shared_ptr<asio::ssl::context> tls;
    if (shared_.options.tls) {
      tls = CurrentTls();
      if (tls == nullptr) return;
    }
    ServeHttpConnection(shared_, std::move(socket), std::move(tls));
  }

  std::shared_ptr<asio::ssl::context> CurrentTls() {
    const std::shared_ptr<const TlsFiles> files = shared_.options.tls();
    if (files != tls_files_) {
      tls_files_ = files;
      tls_ = ContextOf(*files);
    }
    return tls_;
  }

  HttpConnections shared_;
  asio::io_context context_;
  asio::executor_work_guard<asio::io_context::executor_type> guard_{context_.get_executor()};
  // Used by the thread of the listener.
  std::shared_ptr<const TlsFiles> tls_files_;
  std::shared_ptr<asio::ssl::context> tls_;
  std::vector<std::jthread> threads_;
  std::unique_ptr<ConnectionListener> listener_;
};

HttpServer::HttpServer(std::unique_ptr<State> state) : state_(std::move(state)) {}

HttpServer::~HttpServer() { Close(milliseconds(0)); }

void HttpServer::Close(milliseconds delivery) { state_->Close(delivery); }

int HttpServer::connections() const { return state_->connections(); }

absl::StatusOr<std::unique_ptr<HttpServer>> HttpServer::Start(ListenAddress& address, HttpServerOptions options,
                                                              HttpHandler handler) {
  if (absl::Status can_listen = CheckCanListen(address); !can_listen.ok()) return can_listen;
  auto state = std::make_unique<State>(std::move(options), std::move(handler));
  if (absl::Status listens = state->Listen(address); !listens.ok()) return listens;
  return std::unique_ptr<HttpServer>(new HttpServer(std::move(state)));
}

}  // namespace dlcs
