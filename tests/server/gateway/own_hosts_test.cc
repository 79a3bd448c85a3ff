// SPDX-License-Identifier: Apache-2.0
#include "server/gateway/own_hosts.h"

#include <gtest/gtest.h>

namespace dlcs {
namespace {

TEST(OwnHostsTest, AreAddressesLocalhostAndTheNamesGiven) {
  const OwnHosts hosts({"Solver.example.org"});
  for (const char* own : {"127.0.0.1", "127.0.0.1:8080", "[::1]:8080", "[::1]", "localhost", "LOCALHOST:1",
                          "a.localhost", "solver.example.org", "SOLVER.example.org.:443", "10.1.2.3:"}) {
    EXPECT_TRUE(hosts.Has(own)) << own;
  }
  for (const char* other : {"", ":8080", "example.org", "solver.example.org.evil.com", "evil.com:80",
                            "localhost.evil.com", "127.0.0.1.evil.com", "127.0.0.1:80:80", "localhost:http", "[::1",
                            "[evil.com]", "[::1]x", "localhost@evil.com", "evil.com/localhost", "user:pass@localhost",
                            "evil.com/a.localhost", "evil.com@a.localhost", "localhost, evil.com", "\tlocalhost"}) {
    EXPECT_FALSE(hosts.Has(other)) << other;
  }
}

}  // namespace
}  // namespace dlcs
