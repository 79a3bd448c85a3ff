// SPDX-License-Identifier: Apache-2.0
// Listening addresses, with clear errors if one cannot be used (gRPC has none).

#ifndef DLCS_SERVER_NET_LISTEN_ADDRESS_H_
#define DLCS_SERVER_NET_LISTEN_ADDRESS_H_

#include <sys/un.h>

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace dlcs {

struct ListenAddress {
  std::string host = {};  // a name, an IPv4 address, or an IPv6 address without brackets
  int port = 0;           // 0 picks a free one
  std::string path = {};  // of a Unix socket; then host and port are not used

  bool is_unix() const { return !path.empty(); }
};

// Reads "HOST:PORT" and "[IPV6]:PORT". Errors: InvalidArgument.
absl::StatusOr<ListenAddress> ParseHostPort(const std::string& text);

// Reads these and "unix:/PATH", an absolute path of at most 107 bytes. Errors: InvalidArgument.
absl::StatusOr<ListenAddress> ParseListenAddress(const std::string& text);

// As text again, with brackets where they are needed.
std::string ToString(const ListenAddress& address);

// Binds every address that the host resolves to, and releases it again. For a Unix socket, checks whether a server
// accepts connections there; the socket file of a killed server does no harm. Errors: InvalidArgument when the host is
// unknown or is not of this machine, or if the file there is not a socket; AlreadyExists when the port is taken (on
// any of the addresses, or half of the clients would reach the other server); PermissionDenied.
absl::Status CheckCanListen(const ListenAddress& address);

// Whether all addresses that the host resolves to can be reached from this machine only, as a Unix socket can. Blocks
// on the name lookup.
bool IsLoopback(const ListenAddress& address);

// The path, in the form for bind() and connect().
sockaddr_un UnixAddress(const ListenAddress& address);

}  // namespace dlcs

#endif  // DLCS_SERVER_NET_LISTEN_ADDRESS_H_
