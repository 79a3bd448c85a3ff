// SPDX-License-Identifier: Apache-2.0
#include "server/net/listen_address.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

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

TEST(ListenAddressTest, SaysThatAPortIsTaken) {
  const int other = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof(address);
  ASSERT_EQ(bind(other, reinterpret_cast<sockaddr*>(&address), length), 0);
  ASSERT_EQ(listen(other, 1), 0);
  ASSERT_EQ(getsockname(other, reinterpret_cast<sockaddr*>(&address), &length), 0);
  const ListenAddress taken{"127.0.0.1", ntohs(address.sin_port)};
  const absl::Status status = CheckCanListen(taken);
  EXPECT_EQ(status.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(std::string(status.message()), HasSubstr(ToString(taken) + ": the port is taken"));
  close(other);
  EXPECT_TRUE(CheckCanListen(taken).ok());
}

TEST(ListenAddressTest, SaysThatAHostIsUnknownOrElsewhere) {
  const absl::Status unknown = CheckCanListen({"no-such-host.invalid", 50051});
  EXPECT_EQ(unknown.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(unknown.message()), HasSubstr("unknown host no-such-host.invalid"));
  // An address for documentation, which no machine has.
  EXPECT_EQ(CheckCanListen({"192.0.2.1", 50051}).code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace dlcs
