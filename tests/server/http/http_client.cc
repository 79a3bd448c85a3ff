// SPDX-License-Identifier: Apache-2.0
#include "tests/server/http/http_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <limits>

#include "boost/asio/buffer.hpp"
#include "boost/asio/io_context.hpp"
#include "boost/asio/ip/tcp.hpp"
#include "boost/asio/ssl.hpp"
#include "boost/asio/write.hpp"
#include "boost/beast/core/flat_buffer.hpp"
#include "boost/beast/http/read.hpp"
#include "boost/beast/http/string_body.hpp"

namespace dlcs::testing {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using std::chrono::steady_clock;

tcp::endpoint EndpointOf(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  return {asio::ip::make_address(address.substr(0, colon)),
          static_cast<std::uint16_t>(std::atoi(address.c_str() + colon + 1))};
}

template <typename Stream>
HttpAnswer Exchange(Stream& stream, const HttpCall& call) {
  boost::system::error_code error;
  HttpCall last = call;
  last.headers.emplace_back("connection", "close");
  asio::write(stream, asio::buffer(RequestText(last)), error);  // a server may refuse before it has read all
  boost::beast::flat_buffer buffer;
  boost::beast::http::response_parser<boost::beast::http::string_body> parser;
  parser.body_limit(std::numeric_limits<std::uint64_t>::max());
  if (call.method == "HEAD") parser.skip(true);
  error = {};
  boost::beast::http::read(stream, buffer, parser, error);
  if (error) return {};
  HttpAnswer answer;
  answer.status = static_cast<int>(parser.get().result_int());
  for (const auto& header : parser.get().base()) {
    std::string name(header.name_string().data(), header.name_string().size());
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
    answer.headers[name] = std::string(header.value().data(), header.value().size());
  }
  answer.body = std::move(parser.get().body());
  return answer;
}

}  // namespace

HttpAnswer Fetch(const std::string& address, const HttpCall& call, const HttpTls& tls) {
  boost::system::error_code error;
  asio::io_context context;
  if (tls.authority.empty()) {
    tcp::socket socket(context);
    socket.connect(EndpointOf(address), error);
    return error ? HttpAnswer() : Exchange(socket, call);
  }
  asio::ssl::context files(asio::ssl::context::tls_client);
  files.add_certificate_authority(asio::buffer(tls.authority));
  files.set_verify_mode(asio::ssl::verify_peer);
  if (!tls.certificate.empty()) {
    files.use_certificate_chain(asio::buffer(tls.certificate));
    files.use_private_key(asio::buffer(tls.key), asio::ssl::context::pem);
  }
  asio::ssl::stream<tcp::socket> stream(context, files);
  stream.next_layer().connect(EndpointOf(address), error);
  if (!error) stream.handshake(asio::ssl::stream_base::client, error);
  return error ? HttpAnswer() : Exchange(stream, call);
}

std::string RequestText(const HttpCall& call) {
  std::string text = call.method + " " + call.path + " HTTP/1.1\r\n";
  const auto has = [&call](const char* name) {
    return std::any_of(call.headers.begin(), call.headers.end(),
                       [name](const auto& header) { return header.first == name; });
  };
  if (!has("host")) text += "host: localhost\r\n";
  if (!has("content-length") && (call.method == "POST" || !call.body.empty())) {
    text += "content-length: " + std::to_string(call.body.size()) + "\r\n";
  }
  for (const auto& [name, value] : call.headers) text += name + ": " + value + "\r\n";
  return text + "\r\n" + call.body;
}

BareConnection::BareConnection(const std::string& address) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const tcp::endpoint endpoint = EndpointOf(address);
  if (connect(socket_, endpoint.data(), static_cast<socklen_t>(endpoint.size())) != 0) Close();
}

BareConnection::~BareConnection() { Close(); }

void BareConnection::Close() {
  if (socket_ >= 0) close(socket_);
  socket_ = -1;
}

bool BareConnection::Send(const std::string& bytes) {
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    const ssize_t now = send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (now <= 0) return false;
    sent += static_cast<std::size_t>(now);
  }
  return true;
}

std::string BareConnection::ReadUntil(const std::string& end, std::chrono::milliseconds patience) {
  const auto give_up = steady_clock::now() + patience;
  std::string text;
  std::array<char, 65536> piece{};
  while (text.find(end) == std::string::npos) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(give_up - steady_clock::now());
    pollfd readable{socket_, POLLIN, 0};
    if (left.count() <= 0 || poll(&readable, 1, static_cast<int>(left.count())) <= 0) break;
    const ssize_t now = recv(socket_, piece.data(), piece.size(), 0);
    if (now <= 0) break;
    text.append(piece.data(), static_cast<std::size_t>(now));
  }
  return text;
}

bool BareConnection::IsClosed(std::chrono::milliseconds patience) {
  const auto give_up = steady_clock::now() + patience;
  std::array<char, 4096> piece{};
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(give_up - steady_clock::now());
    pollfd readable{socket_, POLLIN, 0};
    if (left.count() <= 0 || poll(&readable, 1, static_cast<int>(left.count())) <= 0) return false;
    if (recv(socket_, piece.data(), piece.size(), 0) <= 0) return true;
  }
}

}  // namespace dlcs::testing
