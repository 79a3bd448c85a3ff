// SPDX-License-Identifier: Apache-2.0
// A server with more connections than it has file descriptors.
#include "server/net/connection_listener.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "tests/server/dlcsd_process.h"
#include "tests/server/service_fixture.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;

constexpr int kDescriptors = 160;

// Descriptors that processes started meanwhile may have.
class FewDescriptors {
 public:
  FewDescriptors() {
    getrlimit(RLIMIT_NOFILE, &before_);
    rlimit few = before_;
    few.rlim_cur = kDescriptors;
    setrlimit(RLIMIT_NOFILE, &few);
  }
  ~FewDescriptors() { setrlimit(RLIMIT_NOFILE, &before_); }
  FewDescriptors(const FewDescriptors&) = delete;
  FewDescriptors& operator=(const FewDescriptors&) = delete;

 private:
  rlimit before_{};
};

// A connection that sends nothing.
class SilentConnection {
 public:
  explicit SilentConnection(const std::string& address) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  }
  ~SilentConnection() { close(socket_); }
  SilentConnection(const SilentConnection&) = delete;
  SilentConnection& operator=(const SilentConnection&) = delete;

  // Whether the server sends its HTTP/2 preface; false if it closes the connection.
  bool IsGreeted() {
    pollfd readable{socket_, POLLIN, 0};
    char byte = 0;
    return poll(&readable, 1, 10'000) == 1 && recv(socket_, &byte, 1, MSG_PEEK) == 1;
  }

 private:
  const int socket_;
};

std::ptrdiff_t OpenDescriptors(const testing::DlcsdProcess& process) {
  return std::distance(std::filesystem::directory_iterator("/proc/" + std::to_string(process.pid()) + "/fd"), {});
}

TEST(ConnectionListenerTest, AServerThatIsConnectedToTooOftenStillServes) {
  const auto dlcsd = [] {
    const FewDescriptors few;
    return std::make_unique<testing::DlcsdProcess>(std::vector<std::string>{"--listen", "localhost:0"});
  }();
  const std::string address = dlcsd->ReadAddress();
  ASSERT_NE(address, "");
  const auto early = v1::SolverService::NewStub(testing::Connect(address));
  EXPECT_TRUE(testing::Solve(*early, testing::SwitchingRequest(100)).status.ok());
  {
    std::vector<std::unique_ptr<SilentConnection>> many;
    int greeted = 0;
    for (int k = 0; k < 2 * kDescriptors; ++k) {
      many.push_back(std::make_unique<SilentConnection>(address));
      greeted += many.back()->IsGreeted() ? 1 : 0;
    }
    EXPECT_GT(greeted, 20);
    EXPECT_LE(greeted, kDescriptors - ConnectionListener::kKeptDescriptors);
    // The server may have opened files meanwhile; these descriptors are reserved for that.
    EXPECT_GE(kDescriptors - OpenDescriptors(*dlcsd), ConnectionListener::kKeptDescriptors / 2);
    // Earlier connections still work.
    EXPECT_TRUE(testing::Solve(*early, testing::SwitchingRequest(100)).status.ok());
  }
  // When they have closed, there is room again soon.
  bool is_greeted = false;
  for (int k = 0; k < 1000 && !is_greeted; ++k) {
    is_greeted = SilentConnection(address).IsGreeted();
    if (!is_greeted) usleep(10'000);
  }
  EXPECT_TRUE(is_greeted);
  dlcsd->Signal(SIGTERM);
  EXPECT_EQ(dlcsd->Wait(), 0);
  EXPECT_THAT(dlcsd->ReadErrors(), HasSubstr("connections refused: the remaining file descriptors are reserved"));
}

TEST(ConnectionListenerTest, ListensOnEveryAddressOfAName) {
  ListenAddress everywhere{.host = "0.0.0.0", .port = 0};
  const auto listener = ConnectionListener::Open(everywhere);
  ASSERT_TRUE(listener.ok()) << listener.status();
  EXPECT_GT(everywhere.port, 0);
  const SilentConnection reaches_it(ToString(everywhere));
  ListenAddress unknown{.host = "no.such.host.invalid", .port = 0};
  EXPECT_EQ(ConnectionListener::Open(unknown).status().code(), absl::StatusCode::kUnavailable);
  // An address of this machine whose port is taken.
  const auto taken = ConnectionListener::Open(everywhere);
  EXPECT_EQ(taken.status().code(), absl::StatusCode::kUnavailable) << taken.status();
}

}  // namespace
}  // namespace dlcs
