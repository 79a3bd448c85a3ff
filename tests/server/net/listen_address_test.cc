// SPDX-License-Identifier: Apache-2.0
#include "server/net/listen_address.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>
#include <string>

namespace dlcs {
namespace {

using ::testing::HasSubstr;

TEST(ListenAddressTest, ReadsHostsAndPorts) {
  EXPECT_EQ(ParseListenAddress("127.0.0.1:50051")->host, "127.0.0.1");
  EXPECT_EQ(ParseListenAddress("127.0.0.1:50051")->port, 50051);
  EXPECT_EQ(ParseListenAddress("localhost:0")->port, 0);
  EXPECT_EQ(ParseListenAddress("[::1]:80")->host, "::1");
  EXPECT_EQ(ToString(*ParseListenAddress("[::1]:80")), "[::1]:80");
}

TEST(ListenAddressTest, RefusesWhatIsNotAnAddress) {
  for (const char* text :
       {"", "localhost", "localhost:", ":80", "a:b", "a:-1", "a:65536", "a:80x", "::1:80", "[]:80"}) {
    EXPECT_EQ(ParseListenAddress(text).status().code(), absl::StatusCode::kInvalidArgument) << text;
  }
}

TEST(ListenAddressTest, OffersAUnixSocketOnlyWhereOneMayBe) {
  EXPECT_THAT(std::string(ParseListenAddress("8080").status().message()), HasSubstr("nor unix:/PATH"));
  for (const char* text : {"8080", "unix:/run/dlcs/socket"}) {
    const std::string message(ParseHostPort(text).status().message());
    EXPECT_THAT(message, HasSubstr("is not HOST:PORT")) << text;
    EXPECT_THAT(message, ::testing::Not(HasSubstr("unix:/PATH"))) << text;
  }
}

TEST(ListenAddressTest, ReadsUnixSockets) {
  const absl::StatusOr<ListenAddress> address = ParseListenAddress("unix:/run/dlcs/socket");
  ASSERT_TRUE(address.ok());
  EXPECT_EQ(address->path, "/run/dlcs/socket");
  EXPECT_EQ(ToString(*address), "unix:/run/dlcs/socket");
  EXPECT_TRUE(IsLoopback(*address));
  const std::string too_long = "unix:/" + std::string(107, 'a');
  for (const std::string& text : {std::string("unix:"), std::string("unix:relative"), too_long}) {
    EXPECT_EQ(ParseListenAddress(text).status().code(), absl::StatusCode::kInvalidArgument) << text;
  }
}

TEST(ListenAddressTest, RefusesAFileAndALiveSocketButNoDeadOne) {
  const std::string path = ::testing::TempDir() + "listen_address_" + std::to_string(getpid());
  const ListenAddress address{.host = {}, .port = 0, .path = path};
  EXPECT_TRUE(CheckCanListen(address).ok());
  std::ofstream(path) << "data";
  EXPECT_EQ(CheckCanListen(address).code(), absl::StatusCode::kInvalidArgument);
  unlink(path.c_str());
  const int other = socket(AF_UNIX, SOCK_STREAM, 0);
  const sockaddr_un name = UnixAddress(address);
  ASSERT_EQ(bind(other, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
  ASSERT_EQ(listen(other, 1), 0);
  EXPECT_EQ(CheckCanListen(address).code(), absl::StatusCode::kAlreadyExists);
  close(other);
  EXPECT_TRUE(CheckCanListen(address).ok());
  unlink(path.c_str());
}

TEST(ListenAddressTest, SaysThatAPortIsTaken) {
  const int other = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof(address);
  ASSERT_EQ(bind(other, reinterpret_cast<sockaddr*>(&address), length), 0);
  ASSERT_EQ(listen(other, 1), 0);
  ASSERT_EQ(getsockname(other, reinterpret_cast<sockaddr*>(&address), &length), 0);
  const ListenAddress taken{.host = "127.0.0.1", .port = ntohs(address.sin_port), .path = {}};
  const absl::Status status = CheckCanListen(taken);
  EXPECT_EQ(status.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(std::string(status.message()), HasSubstr(ToString(taken) + ": the port is taken"));
  close(other);
  EXPECT_TRUE(CheckCanListen(taken).ok());
}

TEST(ListenAddressTest, SaysThatAHostIsUnknownOrElsewhere) {
  const absl::Status unknown = CheckCanListen({.host = "no-such-host.invalid", .port = 50051, .path = {}});
  EXPECT_EQ(unknown.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(unknown.message()), HasSubstr("unknown host no-such-host.invalid"));
  // An address for documentation, which no machine has.
  const absl::Status elsewhere = CheckCanListen({.host = "192.0.2.1", .port = 50051, .path = {}});
  EXPECT_EQ(elsewhere.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(elsewhere.message()), HasSubstr("this machine does not have that address"));
}

}  // namespace
}  // namespace dlcs
