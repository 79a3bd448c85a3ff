// SPDX-License-Identifier: Apache-2.0
#include "server/http/http_message.h"

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

}  // namespace

std::string_view HttpRequest::Header(std::string_view name) const {
  const auto found = headers.find(boost::beast::string_view(name.data(), name.size()));
  if (found == headers.end()) return {};
  return {found->value().data(), found->value().size()};
}

void SetHead(const HttpHead& head, HttpRequest& request) {
  request.method = std::string(head.method_string());
  const std::string_view target(head.target().data(), head.target().size());
  request.path = std::string(target.substr(0, target.find('?')));
  request.headers = head;
}

const char* WhatIsAmbiguous(const HttpHead& head) {
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
