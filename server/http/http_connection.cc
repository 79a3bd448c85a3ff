// SPDX-License-Identifier: Apache-2.0
#include "server/http/http_connection.h"

#include <openssl/ssl.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>

#include "boost/asio/buffer.hpp"
#include "boost/asio/co_spawn.hpp"
#include "boost/asio/detached.hpp"
#include "boost/asio/post.hpp"
#include "boost/asio/redirect_error.hpp"
#include "boost/asio/ssl.hpp"
#include "boost/asio/steady_timer.hpp"
#include "boost/asio/use_awaitable.hpp"
#include "boost/asio/write.hpp"
#include "boost/beast/core/flat_buffer.hpp"
#include "boost/beast/http/parser.hpp"
#include "boost/beast/http/read.hpp"
#include "boost/beast/http/string_body.hpp"
#include "fmt/format.h"
#include "server/http/certificate_names.h"
#include "spdlog/spdlog.h"

namespace dlcs {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace beast_http = boost::beast::http;
using boost::system::error_code;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr std::size_t kReadBytes = 16 << 10;
// The largest part of an unwanted body that is read before the response, and again after it before the connection is
// closed.
constexpr std::size_t kMaxDiscarded = 64 << 10;
constexpr std::size_t kMaxDrained = 1 << 20;

std::string PeerOf(const asio::ip::tcp::endpoint& endpoint) {
  const asio::ip::address& address = endpoint.address();
  if (address.is_v6() && address.to_v6().is_v4_mapped()) {
    const auto inner = asio::ip::make_address_v4(asio::ip::v4_mapped, address.to_v6());
    return fmt::format("ipv4:{}:{}", inner.to_string(), endpoint.port());
  }
  return address.is_v4() ? fmt::format("ipv4:{}:{}", address.to_string(), endpoint.port())
                         : fmt::format("ipv6:%5B{}%5D:{}", address.to_string(), endpoint.port());
}

// Whether `error` is one of the parser, and not of the connection.
bool IsMalformed(const error_code& error) {
  return error.category() == beast_http::make_error_code(beast_http::error::bad_method).category() &&
         error != beast_http::error::end_of_stream && error != beast_http::error::partial_message;
}

// `Stream`: a socket, or TLS over one.
template <typename Stream>
class Connection final : public HttpConnection {
 public:
  Connection(HttpConnections& shared, Stream stream, std::shared_ptr<asio::ssl::context> tls)
      : HttpConnection(shared),
        tls_(std::move(tls)),
        stream_(std::move(stream)),
        deadline_(stream_.get_executor()),
        was_read_(stream_.get_executor()),
        buffer_(kReadBytes + shared.options.max_header_bytes) {}

  // Serves requests until the connection is closed.
  asio::awaitable<void> Run() {
    const std::shared_ptr<HttpConnection> self = shared_from_this();
    error_code error;
    request_.peer = PeerOf(Lowest().remote_endpoint(error));
    if (!error && co_await Handshake()) {
      while (!shared_.closing && co_await ReadHeaders()) {
        idle_ = false;
        co_await Answer();
        idle_ = true;
        if (close_after_) break;
      }
      co_await Linger();
    }
    SetDeadline(std::nullopt);
    CloseSocket();
    while (reading_) co_await ReadArrived();
  }

  void CloseSoon(bool force) override {
    asio::post(stream_.get_executor(), [this, force, self = shared_from_this()] {
      if (force || idle_) CloseSocket();
    });
  }

  const HttpRequest& request() const override { return request_; }
  asio::any_io_executor executor() const override { return const_cast<Stream&>(stream_).get_executor(); }

  asio::awaitable<absl::StatusOr<std::string>> ReadBody(std::size_t max_bytes) override {
    if (body_was_read_) co_return std::string();
    parser_->body_limit(max_bytes);
    const boost::optional<std::uint64_t> announced = parser_->content_length();
    if (announced && *announced > max_bytes) {
      close_after_ = true;
      co_return absl::ResourceExhaustedError(
          fmt::format("the request has {} bytes; at most {} are accepted", *announced, max_bytes));
    }
    if (version_ >= 11 && beast::iequals(request_.headers[beast_http::field::expect], "100-continue") &&
        !parser_->is_done()) {
      const std::string proceed = "HTTP/1.1 100 Continue\r\n\r\n";
      if (!co_await Send(proceed)) co_return absl::CancelledError("the client disconnected");
    }
    while (!parser_->is_done()) {
      SetDeadline(shared_.options.patience);
      error_code error;
      co_await beast_http::async_read_some(stream_, buffer_, *parser_,
                                           asio::redirect_error(asio::use_awaitable, error));
      SetDeadline(std::nullopt);
      if (error) {
        close_after_ = true;
        if (error == beast_http::error::body_limit) {
          co_return absl::ResourceExhaustedError(fmt::format("the request has more than {} bytes", max_bytes));
        }
        if (IsMalformed(error)) {
          co_return absl::InvalidArgumentError(fmt::format("the body is malformed: {}", error.message()));
        }
        co_return absl::CancelledError("the client disconnected");
      }
      const std::size_t size = parser_->get().body().size();
      if (!shared_.held.Take(size - held_)) {
        close_after_ = true;
        co_return absl::ResourceExhaustedError("the server has no memory for this request at the moment");
      }
      held_ = size;
    }
    body_was_read_ = true;
    std::string body = std::move(parser_->get().body());
    parser_.reset();
    co_return body;
  }

  void OnDisconnect(std::function<void()> disconnected) override {
    on_disconnect_ = std::move(disconnected);
    if (gone_ && on_disconnect_) return std::exchange(on_disconnect_, nullptr)();
    if (body_was_read_) ReadAhead();
  }

  asio::awaitable<void> Reply(HttpResponse response) override {
    if (replied_) co_return;
    co_await DiscardSmallBody();
    replied_ = true;
    CloseUnlessBodyWasRead();
    response.headers.emplace_back("content-length", std::to_string(response.body.size()));
    std::string text = Head(response.status, response.headers);
    if (request_.method != "HEAD") text += response.body;
    co_await Send(text);
  }

  asio::awaitable<void> Begin(int status, HttpHeaders headers) override {
    replied_ = true;
    CloseUnlessBodyWasRead();
    chunked_ = version_ >= 11;
    if (chunked_) {
      headers.emplace_back("transfer-encoding", "chunked");
    } else {
      close_after_ = true;  // which ends the body
    }
    const std::string text = Head(status, headers);
    co_await Send(text);
  }

  asio::awaitable<bool> Write(std::string piece) override {
    if (piece.empty()) co_return !gone_;
    if (chunked_) piece = fmt::format("{:x}\r\n", piece.size()) + piece + "\r\n";
    const bool sent = co_await Send(piece);
    co_return sent;
  }

  asio::awaitable<void> End() override {
    static const std::string last_chunk = "0\r\n\r\n";
    if (chunked_) co_await Send(last_chunk);
  }

 private:
  static constexpr bool kEncrypted = !std::is_same_v<Stream, HttpSocket>;

  HttpSocket& Lowest() {
    if constexpr (kEncrypted) {
      return stream_.next_layer();
    } else {
      return stream_;
    }
  }

  // The rest of an unread body cannot be distinguished from the next request, so the connection must be closed. Called
  // before the headers of the response are written, which announce that; otherwise a client would send its next request
  // on this connection and lose it.
  void CloseUnlessBodyWasRead() {
    if (!body_was_read_) close_after_ = true;
  }

  void CloseSocket() {
    error_code ignored;
    Lowest().shutdown(asio::ip::tcp::socket::shutdown_both, ignored);
    Lowest().close(ignored);
  }

  // Closes the connection after `patience`, unless this is called again before.
  void SetDeadline(std::optional<milliseconds> patience) {
    deadline_.cancel();
    if (!patience) return;
    deadline_.expires_after(*patience);
    deadline_.async_wait([self = weak_from_this()](const error_code& error) {
      if (error) return;
      if (const auto open = self.lock()) static_cast<Connection&>(*open).CloseSocket();
    });
  }

  asio::awaitable<bool> Handshake() {
    if constexpr (kEncrypted) {
      SetDeadline(shared_.options.patience);
      error_code error;
      co_await stream_.async_handshake(asio::ssl::stream_base::server,
                                       asio::redirect_error(asio::use_awaitable, error));
      SetDeadline(std::nullopt);
      if (error) {
        spdlog::info("TLS handshake with {} failed: {}", request_.peer, error.message());
        co_return false;
      }
      X509* const certificate = SSL_get1_peer_certificate(stream_.native_handle());
      if (certificate != nullptr) request_.certificate_names = NamesIn(*certificate);
      X509_free(certificate);
    }
    co_return true;
  }

  // Starts to read while the client is not expected to send anything, to notice when it disconnects. Bytes that it
  // sends nevertheless are kept for the next request. At most one read is under way.
  void ReadAhead() {
    if (reading_ || gone_ || buffer_.size() > 0) return;
    buffer_.shrink_to_fit();
    reading_ = true;
    was_read_.expires_at(steady_clock::time_point::max());
    stream_.async_read_some(asio::buffer(ahead_),
                            [this, self = shared_from_this()](const error_code& error, std::size_t bytes) {
                              reading_ = false;
                              buffer_.commit(asio::buffer_copy(buffer_.prepare(bytes), asio::buffer(ahead_, bytes)));
                              if (error) Disconnected();
                              was_read_.cancel();
                            });
  }

  void Disconnected() {
    gone_ = true;
    if (on_disconnect_) std::exchange(on_disconnect_, nullptr)();
  }

  asio::awaitable<void> ReadArrived() {
    error_code ignored;
    co_await was_read_.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
  }

  // Reads the request line and the headers of the next request. False if there is none.
  asio::awaitable<bool> ReadHeaders() {
    ResetForNext();
    error_code error;
    SetDeadline(std::exchange(first_, false) ? shared_.options.patience : shared_.options.idle);
    ReadAhead();
    while (reading_) co_await ReadArrived();
    if (gone_) co_return false;
    SetDeadline(shared_.options.patience);
    co_await beast_http::async_read_header(stream_, buffer_, *parser_,
                                           asio::redirect_error(asio::use_awaitable, error));
    SetDeadline(std::nullopt);
    if (error) {
      close_after_ = true;
      parser_.reset();
      if (error == beast_http::error::header_limit || error == beast_http::error::buffer_overflow) {
        HttpResponse refusal = TextResponse(431, "headers too large\n");
        co_await Reply(std::move(refusal));
      } else if (IsMalformed(error)) {
        HttpResponse refusal = TextResponse(400, "malformed HTTP: " + error.message() + "\n");
        co_await Reply(std::move(refusal));
      }
      co_return false;
    }
    const auto& message = parser_->get();
    SetHead(message, request_);
    version_ = message.version();
    close_after_ = !message.keep_alive();
    body_was_read_ = parser_->is_done();
    const char* const doubt = AmbiguityOf(message);
    if (doubt != nullptr) {
      close_after_ = true;
      parser_.reset();
      HttpResponse refusal = TextResponse(400, fmt::format("malformed HTTP: {}\n", doubt));
      co_await Reply(std::move(refusal));
      co_return false;
    }
    co_return true;
  }

  void ResetForNext() {
    parser_.emplace();
    parser_->header_limit(static_cast<std::uint32_t>(shared_.options.max_header_bytes));
    parser_->body_limit(std::numeric_limits<std::uint64_t>::max());  // until ReadBody() knows it
    replied_ = chunked_ = body_was_read_ = false;
  }

  asio::awaitable<void> Answer() {
    std::exception_ptr failure;
    try {
      co_await shared_.handler(*this);
    } catch (...) {
      failure = std::current_exception();
    }
    if (failure) {
      spdlog::error("an HTTP request to {} failed in the server", request_.path);
      close_after_ = true;
    }
    on_disconnect_ = nullptr;
    if (!replied_) {
      HttpResponse sorry = TextResponse(500, "internal error\n");
      co_await Reply(std::move(sorry));
    }
    CloseUnlessBodyWasRead();
    shared_.held.Release(std::exchange(held_, 0));
    parser_.reset();
    request_.headers.clear();
    if (gone_) close_after_ = true;
  }

  // Reads the body of a request that is refused before its body was read, if it is small. So the client can send all of
  // it and reuse the connection; some clients report an error if the connection is closed before.
  asio::awaitable<void> DiscardSmallBody() {
    if (body_was_read_ || !parser_ || !request_.headers[beast_http::field::expect].empty()) co_return;
    const absl::StatusOr<std::string> ignored = co_await ReadBody(kMaxDiscarded);
    static_cast<void>(ignored);
  }

  std::string Head(int status, HttpHeaders headers) const {
    if (close_after_ || shared_.closing) headers.emplace_back("connection", "close");
    return ResponseHead(status, headers);
  }

  asio::awaitable<bool> Send(const std::string& text) {
    if (gone_) co_return false;
    error_code error;
    co_await asio::async_write(stream_, asio::buffer(text), asio::redirect_error(asio::use_awaitable, error));
    if (error) Disconnected();
    co_return !error;
  }

  // Closing a socket with unread input resets the connection, and the client may lose the response. So reads the rest,
  // up to a limit.
  asio::awaitable<void> Linger() {
    if (gone_ || reading_) co_return;
    SetDeadline(milliseconds(2000));
    error_code error;
    if (!kEncrypted) Lowest().shutdown(asio::ip::tcp::socket::shutdown_send, error);
    std::array<char, 4096> rest{};
    for (std::size_t drained = 0; !error && drained < kMaxDrained && !(kEncrypted && body_was_read_);) {
      drained += co_await stream_.async_read_some(asio::buffer(rest), asio::redirect_error(asio::use_awaitable, error));
    }
    if constexpr (kEncrypted) {
      co_await stream_.async_shutdown(asio::redirect_error(asio::use_awaitable, error));
    }
  }

  const std::shared_ptr<asio::ssl::context> tls_;  // used by `stream_`
  Stream stream_;
  asio::steady_timer deadline_;
  asio::steady_timer was_read_;  // cancelled when a read ahead has ended
  std::array<char, 256> ahead_;
  beast::flat_buffer buffer_;  // read, but not used yet
  std::optional<beast_http::request_parser<beast_http::string_body>> parser_;
  HttpRequest request_;
  std::function<void()> on_disconnect_;
  std::size_t held_ = 0;
  unsigned version_ = 11;
  bool first_ = true;
  bool idle_ = true;  // between two requests
  bool reading_ = false;
  bool gone_ = false;
  bool body_was_read_ = false;
  bool replied_ = false;
  bool chunked_ = false;
  bool close_after_ = false;
};

template <typename Stream>
void Spawn(HttpConnections& shared, Stream stream, std::shared_ptr<asio::ssl::context> tls) {
  const auto executor = stream.get_executor();
  const auto connection = std::make_shared<Connection<Stream>>(shared, std::move(stream), std::move(tls));
  asio::co_spawn(
      executor, [connection] { return connection->Run(); }, asio::detached);
}

}  // namespace

void ServeHttpConnection(HttpConnections& connections, HttpSocket socket, std::shared_ptr<asio::ssl::context> tls) {
  if (tls == nullptr) return Spawn<HttpSocket>(connections, std::move(socket), nullptr);
  asio::ssl::stream<HttpSocket> stream(std::move(socket), *tls);
  Spawn<asio::ssl::stream<HttpSocket>>(connections, std::move(stream), std::move(tls));
}

}  // namespace dlcs
