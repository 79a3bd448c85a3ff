// SPDX-License-Identifier: Apache-2.0
#include "server/gateway/own_hosts.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "boost/asio/ip/address.hpp"

namespace dlcs {

namespace asio = boost::asio;

std::string HostIn(std::string_view authority) {
  const bool bracketed = authority.starts_with('[');
  const std::size_t end = std::min(bracketed ? authority.find(']') : authority.find(':'), authority.size());
  std::string host(authority.substr(0, end));
  std::string_view port = authority.substr(end);
  if (bracketed) {
    if (port.empty()) return "";
    host.erase(0, 1);
    port.remove_prefix(1);
    boost::system::error_code is_no_address;
    asio::ip::make_address_v6(host, is_no_address);
    if (is_no_address) return "";
  }
  // Otherwise "evil.com/a.localhost" would end like a name of this server.
  const auto may_be_in_host = [bracketed](unsigned char c) {
    return absl::ascii_isalnum(c) || c == '-' || c == '.' || c == '_' || (bracketed && (c == ':' || c == '%'));
  };
  if (!std::all_of(host.begin(), host.end(), may_be_in_host)) return "";
  const auto is_digit = [](unsigned char c) { return absl::ascii_isdigit(c); };
  if (!port.empty() && (port[0] != ':' || !std::all_of(port.begin() + 1, port.end(), is_digit))) return "";
  if (host.ends_with('.')) host.pop_back();
  return absl::AsciiStrToLower(host);
}

OwnHosts::OwnHosts(const std::vector<std::string>& names) {
  for (const std::string& name : names) Add(name);
}

void OwnHosts::Add(std::string_view name) { names_.push_back(absl::AsciiStrToLower(std::string(name))); }

bool OwnHosts::Has(std::string_view authority) const {
  const std::string host = HostIn(authority);
  if (host.empty()) return false;
  boost::system::error_code is_name;
  asio::ip::make_address(host, is_name);
  return !is_name || host == "localhost" || host.ends_with(".localhost") ||
         std::find(names_.begin(), names_.end(), host) != names_.end();
}

}  // namespace dlcs
