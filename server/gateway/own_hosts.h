// SPDX-License-Identifier: Apache-2.0
// The names by which a request may ask for this server.
//
// A page of another site can point its own name to this server (DNS rebinding); the browser then treats it as a page of
// this server. Its requests still have that name in the header Host, so they can be refused.

#ifndef DLCS_SERVER_GATEWAY_OWN_HOSTS_H_
#define DLCS_SERVER_GATEWAY_OWN_HOSTS_H_

#include <string>
#include <string_view>
#include <vector>

namespace dlcs {

// The host of "[::1]:8080" or "example.org:8080", in lower case and without brackets; empty for anything else.
std::string HostIn(std::string_view authority);

// IP addresses, localhost and names below it, and the names that were added.
class OwnHosts {
 public:
  explicit OwnHosts(const std::vector<std::string>& names);
  void Add(std::string_view name);

  // Whether the value of a header Host is one of them, with or without a port.
  bool Has(std::string_view authority) const;

 private:
  std::vector<std::string> names_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_GATEWAY_OWN_HOSTS_H_
