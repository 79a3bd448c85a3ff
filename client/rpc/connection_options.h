// SPDX-License-Identifier: Apache-2.0
// Which server to call, and how.

#ifndef DLCS_CLIENT_RPC_CONNECTION_OPTIONS_H_
#define DLCS_CLIENT_RPC_CONNECTION_OPTIONS_H_

#include <string>
#include <utility>

namespace dlcs::client {

// An address alone is a connection without encryption and without a token. With any of the `tls` fields it is
// encrypted, and the server has to prove that it is the one of the address.
struct ConnectionOptions {
  ConnectionOptions(std::string server) : address(std::move(server)) {}  // NOLINT: an address is one
  ConnectionOptions(const char* server) : address(server) {}             // NOLINT

  bool UsesTls() const { return tls || !tls_ca.empty() || !tls_cert.empty() || !tls_key.empty(); }

  std::string address;  // HOST:PORT ([::1]:PORT for IPv6), or unix:/PATH
  bool tls = false;
  // PEM files. The authorities to trust; empty: those of this machine.
  std::string tls_ca;
  // The certificate that identifies the client, and its key; both or none.
  std::string tls_cert;
  std::string tls_key;
  // When to repeat idempotent calls that get no answer. kAlways: from the first call on. kAfterAnswer: only after the
  // server has answered once, since a lost connection may recover but a wrong address does not. kNever: not at all.
  enum class Repeat { kAlways, kAfterAnswer, kNever };
  Repeat repeat = Repeat::kAlways;
  // Sent with every call. Without encryption only allowed to this machine (127.0.0.0/8, ::1, localhost).
  std::string token;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RPC_CONNECTION_OPTIONS_H_
