// SPDX-License-Identifier: Apache-2.0
#include "tests/load/cut_proxy.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <vector>

namespace dlcs::testing {
namespace {

constexpr std::size_t kMaxWaiting = 64 << 10;

[[noreturn]] void Fail(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

sockaddr_in Loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

int NewSocket() {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (socket < 0) Fail("socket");
  const int yes = 1;
  setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  return socket;
}

// The other side receives a reset, not an orderly end.
void Reset(int socket) {
  const linger at_once{.l_onoff = 1, .l_linger = 0};
  setsockopt(socket, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  close(socket);
}

void MakeNonBlocking(int socket) { fcntl(socket, F_SETFL, fcntl(socket, F_GETFL) | O_NONBLOCK); }

}  // namespace

CutProxy::CutProxy(const std::string& upstream) : upstream_port_(std::stoi(upstream.substr(upstream.rfind(':') + 1))) {
  if (pipe2(wake_, O_CLOEXEC | O_NONBLOCK) != 0) Fail("pipe");
  reserved_ = NewSocket();
  sockaddr_in address = Loopback(0);
  socklen_t size = sizeof address;
  if (bind(reserved_, reinterpret_cast<sockaddr*>(&address), size) != 0) Fail("bind");
  getsockname(reserved_, reinterpret_cast<sockaddr*>(&address), &size);
  port_ = ntohs(address.sin_port);
  Listen();
  address_ = "127.0.0.1:" + std::to_string(port_);
  thread_ = std::thread([this] { Run(); });
}

CutProxy::~CutProxy() {
  Do([this] { ending_ = true; });
  thread_.join();
  CutAll();
  if (listener_ >= 0) close(listener_);
  close(reserved_);
  close(wake_[0]);
  close(wake_[1]);
}

void CutProxy::Cut() {
  Do([this] { CutAll(); });
}

void CutProxy::Close() {
  Do([this] {
    CutAll();
    if (listener_ < 0) return;
    // The thread may be polling it, and it would listen until that ends.
    shutdown(listener_, SHUT_RDWR);
    close(listener_);
    listener_ = -1;
  });
}

void CutProxy::Open() {
  Do([this] {
    if (listener_ < 0) Listen();
  });
}

void CutProxy::Stall(bool stalled) {
  Do([this, stalled] { stalled_ = stalled; });
}

void CutProxy::Do(const std::function<void()>& what) {
  {
    const std::lock_guard lock(mutex_);
    what();
  }
  const char byte = 0;
  [[maybe_unused]] const ssize_t written = write(wake_[1], &byte, 1);  // a full pipe wakes as well
}

void CutProxy::Listen() {
  listener_ = NewSocket();
  const sockaddr_in address = Loopback(port_);
  if (bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) Fail("bind");
  if (listen(listener_, 128) != 0) Fail("listen");
  MakeNonBlocking(listener_);
}

void CutProxy::Accept() {
  const int client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) return;
  const int server = NewSocket();
  sockaddr_in address = Loopback(upstream_port_);
  if (connect(server, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    Reset(client);
    close(server);
    return;
  }
  MakeNonBlocking(client);
  MakeNonBlocking(server);
  connections_.push_back({.up = {client, server, {}}, .down = {server, client, {}}});
}

void CutProxy::CutAll() {
  for (const Connection& connection : connections_) {
    Reset(connection.up.from);
    Reset(connection.up.to);
  }
  connections_.clear();
}

bool CutProxy::Pass(Direction& direction, short readable) {
  constexpr short kSomething = POLLIN | POLLHUP | POLLERR;
  if ((readable & kSomething) != 0 && direction.waiting.size() < kMaxWaiting) {
    char buffer[kMaxWaiting];
    const ssize_t count = read(direction.from, buffer, sizeof buffer);
    if (count == 0 || (count < 0 && errno != EAGAIN)) return false;
    if (count > 0) direction.waiting.append(buffer, static_cast<std::size_t>(count));
  }
  if (direction.waiting.empty()) return true;
  const ssize_t count = send(direction.to, direction.waiting.data(), direction.waiting.size(), MSG_NOSIGNAL);
  if (count < 0) return errno == EAGAIN;
  direction.waiting.erase(0, static_cast<std::size_t>(count));
  return true;
}

void CutProxy::Run() {
  std::vector<pollfd> polled;
  for (;;) {
    polled.clear();
    polled.push_back({wake_[0], POLLIN, 0});
    {
      const std::lock_guard lock(mutex_);
      if (ending_) return;
      polled.push_back({listener_, POLLIN, 0});  // a negative one is passed over
      for (const Connection& connection : connections_) {
        if (stalled_) break;
        const auto events = [](const Direction& in, const Direction& out) {
          return static_cast<short>((in.waiting.size() < kMaxWaiting ? POLLIN : 0) |
                                    (out.waiting.empty() ? 0 : POLLOUT));
        };
        polled.push_back({connection.up.from, events(connection.up, connection.down), 0});
        polled.push_back({connection.up.to, events(connection.down, connection.up), 0});
      }
    }
    poll(polled.data(), polled.size(), -1);
    char drained[64];
    while (read(wake_[0], drained, sizeof drained) > 0) {
    }
    const std::lock_guard lock(mutex_);
    if (listener_ >= 0 && polled[1].fd == listener_ && polled[1].revents != 0) Accept();
    if (stalled_) continue;
    std::size_t next = 2;
    for (auto connection = connections_.begin(); connection != connections_.end() && next + 1 < polled.size();) {
      // Connections were cut since: the next round finds out.
      if (polled[next].fd != connection->up.from || polled[next + 1].fd != connection->up.to) break;
      const short client = polled[next].revents, server = polled[next + 1].revents;
      next += 2;
      const bool is_alive = Pass(connection->up, client) && Pass(connection->down, server);
      if (is_alive) {
        ++connection;
        continue;
      }
      close(connection->up.from);
      close(connection->up.to);
      connection = connections_.erase(connection);
    }
  }
}

}  // namespace dlcs::testing
