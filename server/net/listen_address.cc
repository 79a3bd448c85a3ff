// SPDX-License-Identifier: Apache-2.0
#include "server/net/listen_address.h"

#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>
#include <string_view>

#include "fmt/format.h"

namespace dlcs {
namespace {

constexpr std::string_view kUnixPrefix = "unix:";

absl::Status CheckUnixSocket(const ListenAddress& address) {
  struct stat file {};
  if (stat(address.path.c_str(), &file) != 0) return absl::OkStatus();  // ConnectionListener reports other problems
  if (!S_ISSOCK(file.st_mode)) {
    return absl::InvalidArgumentError(
        fmt::format("cannot listen on {}: the file there is not a socket", ToString(address)));
  }
  const int probe = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_un name = UnixAddress(address);
  const bool taken = connect(probe, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0;
  close(probe);
  if (!taken) return absl::OkStatus();
  return absl::AlreadyExistsError(
      fmt::format("cannot listen on {}: another server listens there; choose another path", ToString(address)));
}

// Returns 0 or the errno of the attempt.
int TryBind(const addrinfo& candidate) {
  const int socket_fd = socket(candidate.ai_family, candidate.ai_socktype | SOCK_CLOEXEC, candidate.ai_protocol);
  if (socket_fd < 0) return errno;
  // As gRPC does: a port whose last connections are in TIME_WAIT is free.
  const int on = 1;
  setsockopt(socket_fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  if (candidate.ai_family == AF_INET6) setsockopt(socket_fd, IPPROTO_IPV6, IPV6_V6ONLY, &on, sizeof(on));
  const int error = bind(socket_fd, candidate.ai_addr, candidate.ai_addrlen) == 0 ? 0 : errno;
  close(socket_fd);
  return error;
}

using AddressList = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

// The resolved addresses of `address`; null if there are none, and `error` says why.
AddressList LookUp(const ListenAddress& address, int& error) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  error = getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &hints, &found);
  return AddressList(error == 0 ? found : nullptr, &freeaddrinfo);
}

bool IsLoopback(const addrinfo& address) {
  if (address.ai_family == AF_INET) {
    const auto* const ipv4 = reinterpret_cast<const sockaddr_in*>(address.ai_addr);
    return ntohl(ipv4->sin_addr.s_addr) >> 24 == 127;
  }
  if (address.ai_family != AF_INET6) return false;
  const in6_addr& ipv6 = reinterpret_cast<const sockaddr_in6*>(address.ai_addr)->sin6_addr;
  return IN6_IS_ADDR_LOOPBACK(&ipv6) || (IN6_IS_ADDR_V4MAPPED(&ipv6) && ipv6.s6_addr[12] == 127);
}

}  // namespace

sockaddr_un UnixAddress(const ListenAddress& address) {
  sockaddr_un result{};
  result.sun_family = AF_UNIX;
  address.path.copy(result.sun_path, sizeof result.sun_path - 1);
  return result;
}

absl::StatusOr<ListenAddress> ParseHostPort(const std::string& text) {
  const absl::Status malformed = absl::InvalidArgumentError(
      fmt::format("\"{}\" is not HOST:PORT with a port up to 65535, for example 127.0.0.1:50051, 0.0.0.0:50051, "
                  "[::1]:50051 or localhost:0",
                  text));
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return malformed;
  ListenAddress address;
  address.host = text.substr(0, colon);
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data() + colon + 1, end, address.port);
  if (error != std::errc() || rest != end || address.port < 0 || address.port > 65535) return malformed;
  if (address.host.front() == '[' && address.host.back() == ']') {
    address.host = address.host.substr(1, address.host.size() - 2);
  } else if (address.host.find(':') != std::string::npos) {
    return malformed;  // "::1:50051" has two readings
  }
  if (address.host.empty()) return malformed;
  return address;
}

absl::StatusOr<ListenAddress> ParseListenAddress(const std::string& text) {
  if (text.starts_with(kUnixPrefix)) {
    const std::string path = text.substr(kUnixPrefix.size());
    const bool is_path = path.starts_with('/') && path.size() < sizeof(sockaddr_un::sun_path);
    if (is_path) return ListenAddress{.host = {}, .port = 0, .path = path};
    return absl::InvalidArgumentError(fmt::format("\"{}\" is not unix: and an absolute path of at most {} bytes", text,
                                                  sizeof(sockaddr_un::sun_path) - 1));
  }
  absl::StatusOr<ListenAddress> address = ParseHostPort(text);
  if (address.ok()) return address;
  return absl::InvalidArgumentError(fmt::format("{}, nor unix:/PATH", std::string(address.status().message())));
}

std::string ToString(const ListenAddress& address) {
  if (address.is_unix()) return std::string(kUnixPrefix) + address.path;
  const bool brackets = address.host.find(':') != std::string::npos;
  const std::string host = brackets ? "[" + address.host + "]" : address.host;
  return host + ":" + std::to_string(address.port);
}

absl::Status CheckCanListen(const ListenAddress& address) {
  if (address.is_unix()) return CheckUnixSocket(address);
  int lookup = 0;
  const AddressList addresses = LookUp(address, lookup);
  if (addresses == nullptr) {
    return absl::InvalidArgumentError(fmt::format("cannot listen on {}: unknown host {} ({})", ToString(address),
                                                  address.host, gai_strerror(lookup)));
  }

  int free = 0;
  int error = 0;
  for (const addrinfo* candidate = addresses.get(); candidate != nullptr; candidate = candidate->ai_next) {
    const int attempt = TryBind(*candidate);
    if (attempt == EADDRINUSE) {
      return absl::AlreadyExistsError(
          fmt::format("cannot listen on {}: the port is taken by another program; choose another one, or 0 for "
                      "any free port",
                      ToString(address)));
    }
    if (attempt == 0) {
      ++free;
    } else {
      error = attempt;
    }
  }
  // A name may resolve to an address that this machine does not have (::1 without IPv6); one that works is enough.
  if (free > 0) return absl::OkStatus();
  if (error == EADDRNOTAVAIL) {
    return absl::InvalidArgumentError(
        fmt::format("cannot listen on {}: this machine does not have that address; give one of its own, or 0.0.0.0 for "
                    "all of them",
                    ToString(address)));
  }
  const std::string message = fmt::format("cannot listen on {}: {}", ToString(address), std::strerror(error));
  if (error == EACCES) return absl::PermissionDeniedError(message);
  return absl::InvalidArgumentError(message);
}

bool IsLoopback(const ListenAddress& address) {
  if (address.is_unix()) return true;
  int error = 0;
  const AddressList addresses = LookUp(address, error);
  for (const addrinfo* found = addresses.get(); found != nullptr; found = found->ai_next) {
    if (!IsLoopback(*found)) return false;
  }
  return addresses != nullptr;
}

}  // namespace dlcs
