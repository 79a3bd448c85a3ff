// SPDX-License-Identifier: Apache-2.0
#include "server/net/connection_listener.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>

#include "fmt/format.h"
#include "spdlog/spdlog.h"

namespace dlcs {
namespace {

using std::chrono::steady_clock;

constexpr std::chrono::milliseconds kUntilDescriptorsAreFree{100};

void SetOption(int socket, int level, int name, int value) { setsockopt(socket, level, name, &value, sizeof value); }

// The first descriptor that connections may not use. A new descriptor is the lowest free one, so its number shows how
// many are in use.
int FirstKeptDescriptor() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  const auto most = static_cast<int>(std::min<rlim_t>(limit.rlim_cur, 1 << 20));
  return std::max(most - ConnectionListener::kKeptDescriptors, most / 2);
}

// As in gRPC, listening on all addresses of one family includes the other family.
bool IsWildcard(const addrinfo& address) {
  if (address.ai_family == AF_INET) {
    return reinterpret_cast<const sockaddr_in*>(address.ai_addr)->sin_addr.s_addr == htonl(INADDR_ANY);
  }
  return address.ai_family == AF_INET6 &&
         IN6_IS_ADDR_UNSPECIFIED(&reinterpret_cast<const sockaddr_in6*>(address.ai_addr)->sin6_addr);
}

}  // namespace

class ConnectionListener::Socket {
 public:
  explicit Socket(int descriptor) : descriptor_(descriptor) {}
  ~Socket() { close(descriptor_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int descriptor() const { return descriptor_; }

  // Null, with errno set, on failure.
  static std::unique_ptr<Socket> Listen(const sockaddr* address, socklen_t size, bool dual_stack) {
    const int descriptor = socket(address->sa_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (descriptor < 0) return nullptr;
    auto result = std::make_unique<Socket>(descriptor);
    if (address->sa_family == AF_UNIX) fchmod(descriptor, S_IRUSR | S_IWUSR);  // bind() creates the file with this mode
    // A port whose last connections are in TIME_WAIT is free.
    SetOption(descriptor, SOL_SOCKET, SO_REUSEADDR, 1);
    if (address->sa_family == AF_INET6) SetOption(descriptor, IPPROTO_IPV6, IPV6_V6ONLY, dual_stack ? 0 : 1);
    if (bind(descriptor, address, size) != 0 || listen(descriptor, SOMAXCONN) != 0) return nullptr;
    return result;
  }

  int port() const {
    sockaddr_storage address{};
    socklen_t size = sizeof address;
    getsockname(descriptor_, reinterpret_cast<sockaddr*>(&address), &size);
    return ntohs(address.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6*>(&address)->sin6_port
                                               : reinterpret_cast<sockaddr_in*>(&address)->sin_port);
  }

 private:
  const int descriptor_;
};

ConnectionListener::ConnectionListener() : wake_(std::make_unique<Socket>(eventfd(0, EFD_CLOEXEC))) {}

absl::StatusOr<std::unique_ptr<ConnectionListener>> ConnectionListener::Open(ListenAddress& address) {
  std::unique_ptr<ConnectionListener> result(new ConnectionListener());
  if (address.is_unix()) {
    const sockaddr_un name = UnixAddress(address);
    unlink(name.sun_path);
    auto socket = Socket::Listen(reinterpret_cast<const sockaddr*>(&name), sizeof name, false);
    if (socket == nullptr) {
      return absl::UnavailableError(fmt::format("cannot listen on {}: {}", ToString(address), std::strerror(errno)));
    }
    result->path_ = address.path;
    result->listeners_.push_back(std::move(socket));
    return result;
  }
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  const int unknown = getaddrinfo(address.host.c_str(), nullptr, &hints, &found);
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> addresses(unknown == 0 ? found : nullptr, &freeaddrinfo);
  std::string why = unknown == 0 ? "" : gai_strerror(unknown);
  for (const addrinfo* one = addresses.get(); one != nullptr; one = one->ai_next) {
    std::unique_ptr<Socket> socket;
    const auto port = htons(static_cast<std::uint16_t>(address.port));
    if (IsWildcard(*one)) {
      sockaddr_in6 both{};
      both.sin6_family = AF_INET6;
      both.sin6_port = port;
      socket = Socket::Listen(reinterpret_cast<const sockaddr*>(&both), sizeof both, true);
    }
    if (socket == nullptr) {
      // The wildcard address of both families.
      reinterpret_cast<sockaddr_in*>(one->ai_addr)->sin_port = port;
      socket = Socket::Listen(one->ai_addr, one->ai_addrlen, false);
    }
    if (socket == nullptr) {
      why = std::strerror(errno);
      continue;
    }
    address.port = socket->port();  // the others of a name get the same
    result->listeners_.push_back(std::move(socket));
  }
  if (result->listeners_.empty()) {
    return absl::UnavailableError(fmt::format("cannot listen on {}: {}", ToString(address), why));
  }
  return result;
}

ConnectionListener::~ConnectionListener() {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = write(wake_->descriptor(), &one, sizeof one);
  if (thread_.joinable()) thread_.join();
  if (!path_.empty()) unlink(path_.c_str());
}

void ConnectionListener::Start(Acceptor acceptor) {
  acceptor_ = std::move(acceptor);
  thread_ = std::thread([this] { Run(); });
}

void ConnectionListener::LogRefused(const char* why) {
  ++refused_;
  const auto now = steady_clock::now();
  if (now < next_log_) return;
  next_log_ = now + std::chrono::seconds(1);
  spdlog::warn("connections refused: {}; {} since the last such message; see ulimit -n", why,
               std::exchange(refused_, 0));
}

void ConnectionListener::Run() {
  std::vector<pollfd> polled{{wake_->descriptor(), POLLIN, 0}};
  for (const auto& listener : listeners_) polled.push_back({listener->descriptor(), POLLIN, 0});
  for (;;) {
    poll(polled.data(), polled.size(), -1);
    if (polled[0].revents != 0) return;
    for (std::size_t k = 1; k < polled.size(); ++k) {
      if (polled[k].revents == 0 || Accept(polled[k].fd)) continue;
      // The pending connection would wake the thread again at once.
      poll(polled.data(), 1, static_cast<int>(kUntilDescriptorsAreFree.count()));
    }
  }
}

bool ConnectionListener::Accept(int listener) {
  const int connection = accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (connection < 0) {
    // All other errors concern the connection, which is gone.
    const bool exhausted = errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM;
    if (exhausted) LogRefused(std::strerror(errno));
    return !exhausted;
  }
  if (connection >= FirstKeptDescriptor()) {
    close(connection);
    LogRefused("the remaining file descriptors are reserved for the server itself");
    return true;
  }
  SetOption(connection, IPPROTO_TCP, TCP_NODELAY, 1);
  acceptor_(listener, connection);
  return true;
}

}  // namespace dlcs
