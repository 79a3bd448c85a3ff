// SPDX-License-Identifier: Apache-2.0
// Requests and responses of HTTP/1.1, without connections.

#ifndef DLCS_SERVER_HTTP_HTTP_MESSAGE_H_
#define DLCS_SERVER_HTTP_HTTP_MESSAGE_H_

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "boost/beast/http/fields.hpp"
#include "boost/beast/http/message.hpp"

namespace dlcs {

using HttpHeaders = std::vector<std::pair<std::string, std::string>>;

// The request line and the headers of a request, and who sent it.
struct HttpRequest {
  std::string method;
  std::string path;  // of the target, without the query
  boost::beast::http::fields headers;
  std::string peer;                            // as gRPC writes it: "ipv4:10.0.0.7:40312"
  std::vector<std::string> certificate_names;  // of the verified certificate of the client

  // The value of a header; empty if it was not sent. `name` in any case.
  std::string_view Header(std::string_view name) const;
};

struct HttpResponse {
  int status = 200;
  HttpHeaders headers;
  std::string body;
};

// A response of plain text.
HttpResponse TextResponse(int status, std::string text);

// The request line and the headers, as Beast's parser has read them.
using HttpHead = boost::beast::http::header<true, boost::beast::http::fields>;

// Sets method, path and headers of `request`. Where the target is a whole URL, its host replaces the header Host.
void SetHead(const HttpHead& head, HttpRequest& request);

// Why a proxy in front of this server may parse the request differently from Beast, which ignores unknown transfer
// codings; null if there is no reason. If two programs disagree about where a request ends, it can hide a second
// request (request smuggling).
const char* AmbiguityOf(const HttpHead& head);

// The status line and the headers of a response, with the empty line that ends them.
std::string ResponseHead(int status, const HttpHeaders& headers);

}  // namespace dlcs

#endif  // DLCS_SERVER_HTTP_HTTP_MESSAGE_H_
