// SPDX-License-Identifier: Apache-2.0
#include "server/http/http_message.h"

#include <algorithm>

#include "boost/beast/core/string.hpp"
#include "boost/beast/http/field.hpp"
#include "boost/beast/http/status.hpp"
#include "fmt/format.h"

namespace dlcs {
namespace {

namespace beast = boost::beast;
namespace beast_http = boost::beast::http;

// The standard text of an HTTP status: "Not Found".
std::string_view HttpReason(int status) {
  if (status == 499) return "Client Closed Request";
  const boost::beast::string_view text = beast_http::obsolete_reason(static_cast<beast_http::status>(status));
  return {text.data(), text.size()};
}

// Proxies may send the whole URL, "http://HOST/PATH", which counts more than a Host header (RFC 9112, 3.2.2). Removes
// scheme and authority from `target` and returns the authority; empty if the target has none.
std::string_view TakeAuthority(std::string_view& target) {
  const std::size_t scheme = target.find("://");
  if (target.starts_with('/') || scheme == std::string_view::npos) return {};
  const std::string_view rest = target.substr(scheme + 3);
  const std::size_t end = std::min(rest.find_first_of("/?"), rest.size());
  target = rest.substr(end);
  return rest.substr(0, end);
}

}  // namespace

std::string_view HttpRequest::Header(std::string_view name) const {
  const auto found = headers.find(boost::beast::string_view(name.data(), name.size()));
  if (found == headers.end()) return {};
  return {found->value().data(), found->value().size()};
}

void SetHead(const HttpHead& head, HttpRequest& request) {
  request.method = std::string(head.method_string());
  request.headers = head;
  std::string_view target(head.target().data(), head.target().size());
  if (const std::string_view host = TakeAuthority(target); !host.empty()) {
    request.headers.set(beast_http::field::host, boost::beast::string_view(host.data(), host.size()));
  }
  request.path = std::string(target.substr(0, target.find('?')));
  if (request.path.empty()) request.path = "/";
}

const char* AmbiguityOf(const HttpHead& head) {
  if (head.count(beast_http::field::host) > 1) return "more than one Host";
  const auto coding = head.find(beast_http::field::transfer_encoding);
  if (coding == head.end()) return nullptr;
  if (head.version() < 11) return "Transfer-Encoding in HTTP/1.0";
  return beast::iequals(coding->value(), "chunked") ? nullptr : "a Transfer-Encoding other than chunked";
}

std::string ResponseHead(int status, const HttpHeaders& headers) {
  std::string text = fmt::format("HTTP/1.1 {} {}\r\n", status, HttpReason(status));
  for (const auto& [name, value] : headers) text += fmt::format("{}: {}\r\n", name, value);
  return text + "\r\n";
}

HttpResponse TextResponse(int status, std::string text) {
  return {.status = status, .headers = {{"content-type", "text/plain; charset=utf-8"}}, .body = std::move(text)};
}

}  // namespace dlcs
