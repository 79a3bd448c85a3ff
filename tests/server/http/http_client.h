// SPDX-License-Identifier: Apache-2.0
// An HTTP/1.1 client that blocks, and bare connections for requests that no client would send.

#ifndef DLCS_TESTS_SERVER_HTTP_HTTP_CLIENT_H_
#define DLCS_TESTS_SERVER_HTTP_HTTP_CLIENT_H_

#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace dlcs::testing {

struct HttpAnswer {
  int status = 0;                              // 0: no response
  std::map<std::string, std::string> headers;  // names in lower case
  std::string body;
};

struct HttpCall {
  std::string method = "GET";
  std::string path = "/";
  std::vector<std::pair<std::string, std::string>> headers = {};
  std::string body = {};
};

// The authority that a client trusts, and its own certificate, in PEM. Empty `authority`: no encryption.
struct HttpTls {
  std::string authority = {};
  std::string certificate = {};
  std::string key = {};
};

// One request on a connection of its own, to "127.0.0.1:8080".
HttpAnswer Fetch(const std::string& address, const HttpCall& call, const HttpTls& tls = {});
inline HttpAnswer Get(const std::string& address, const std::string& path) { return Fetch(address, {.path = path}); }

// A TCP connection.
class BareConnection {
 public:
  explicit BareConnection(const std::string& address);
  ~BareConnection();
  BareConnection(const BareConnection&) = delete;
  BareConnection& operator=(const BareConnection&) = delete;

  // False if the server has closed the connection.
  bool Send(const std::string& bytes);
  // Reads until `end` has arrived, the server closes the connection, or `patience` has passed.
  std::string ReadUntil(const std::string& end, std::chrono::milliseconds patience = std::chrono::seconds(60));
  // Whether the server closes the connection in time.
  bool IsClosed(std::chrono::milliseconds patience);
  void Close();

 private:
  int socket_;
};

// A request as text, for BareConnection::Send().
std::string RequestText(const HttpCall& call);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SERVER_HTTP_HTTP_CLIENT_H_
