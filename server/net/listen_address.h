// SPDX-License-Identifier: Apache-2.0
// Says in plain words why an address cannot be listened on, which gRPC does not.

#ifndef DLCS_SERVER_NET_LISTEN_ADDRESS_H_
#define DLCS_SERVER_NET_LISTEN_ADDRESS_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace dlcs {

struct ListenAddress {
  std::string host;  // a name, an IPv4 address, or an IPv6 address without brackets
  int port = 0;      // 0 picks a free one
};

// Reads "HOST:PORT" and "[IPV6]:PORT". Errors: InvalidArgument.
absl::StatusOr<ListenAddress> ParseListenAddress(const std::string& text);

// As text again, with brackets where they are needed.
std::string ToString(const ListenAddress& address);

// Tries to bind every address that the host stands for, and lets go again.
// Errors: InvalidArgument when the host is unknown or is not of this machine; AlreadyExists when the port is
// taken (on any of the addresses, or half of the clients would reach the other server); PermissionDenied.
absl::Status CheckCanListen(const ListenAddress& address);

// Whether all addresses that the host stands for can be reached from this machine only. Blocks on a look-up.
bool IsLoopback(const ListenAddress& address);

}  // namespace dlcs

#endif  // DLCS_SERVER_NET_LISTEN_ADDRESS_H_
