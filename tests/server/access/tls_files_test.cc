// SPDX-License-Identifier: Apache-2.0
#include "server/access/tls_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/store/temporary_folder.h"
#include "tests/server/test_authority.h"

namespace dlcs {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class TlsFilesTest : public ::testing::Test {
 protected:
  TlsPaths Paths(const std::string& certificate, const std::string& key, const std::string& client_ca = "") {
    testing::ReplaceFile(paths_.certificate, certificate);
    testing::ReplaceFile(paths_.key, key);
    TlsPaths paths = paths_;
    if (client_ca.empty()) {
      paths.client_ca = "";
    } else {
      testing::ReplaceFile(paths.client_ca, client_ca);
    }
    return paths;
  }
  std::string WhatIsWrong(const TlsPaths& paths) { return std::string(ReadTlsFiles(paths).status().message()); }

  jobs::testing::TemporaryFolder folder_;
  const TlsPaths paths_{folder_.File("server.pem"), folder_.File("server.key"), folder_.File("ca.pem")};
  const testing::TestAuthority authority_;
  const testing::Issued server_ = authority_.Issue("localhost");
};

TEST_F(TlsFilesTest, TakesWhatBelongsTogether) {
  const auto files =
      ReadTlsFiles(Paths(server_.certificate + authority_.certificate(), server_.key, authority_.certificate()));
  ASSERT_TRUE(files.ok()) << files.status();
  EXPECT_EQ(files->key, server_.key);
  EXPECT_EQ(files->client_ca, authority_.certificate());
  EXPECT_EQ(files->warning, "");
}

TEST_F(TlsFilesTest, WarnsOfACertificateThatHasExpired) {
  const testing::Issued old = authority_.Issue("localhost", -1);
  const auto files = ReadTlsFiles(Paths(old.certificate, old.key));
  ASSERT_TRUE(files.ok()) << files.status();
  EXPECT_THAT(files->warning, AllOf(HasSubstr(paths_.certificate), HasSubstr("expired on")));
}

TEST_F(TlsFilesTest, NamesFlagFileAndRule) {
  const std::string& certificate = server_.certificate;
  EXPECT_THAT(WhatIsWrong(Paths(certificate, authority_.Issue("other").key)),
              AllOf(HasSubstr("--tls-key " + paths_.key),
                    HasSubstr("is not the key of the first certificate in " + paths_.certificate)));
  EXPECT_THAT(WhatIsWrong(Paths(server_.key, server_.key)),
              AllOf(HasSubstr("--tls-cert " + paths_.certificate), HasSubstr("no certificate in PEM form")));
  EXPECT_THAT(WhatIsWrong(Paths(certificate, certificate)), HasSubstr("no private key in PEM form"));
  EXPECT_THAT(WhatIsWrong(Paths("", server_.key)), HasSubstr("no certificate"));
  EXPECT_THAT(WhatIsWrong(Paths(certificate, server_.key, "authorities")),
              AllOf(HasSubstr("--tls-client-ca " + paths_.client_ca), HasSubstr("no certificate")));
  EXPECT_THAT(WhatIsWrong({folder_.File("none"), paths_.key, ""}),
              AllOf(HasSubstr("--tls-cert " + folder_.File("none")), HasSubstr("No such file")));
  EXPECT_THAT(WhatIsWrong({folder_.path().string(), paths_.key, ""}), HasSubstr("Is a directory"));
}

// Files that a program is still writing.
TEST_F(TlsFilesTest, EveryHalfOfTheFilesIsRefusedOrWhole) {
  for (std::size_t bytes = 0; bytes < server_.certificate.size() - 1; bytes += 7) {
    EXPECT_FALSE(ReadTlsFiles(Paths(server_.certificate.substr(0, bytes), server_.key)).ok()) << bytes;
  }
  for (std::size_t bytes = 0; bytes < server_.key.size() - 1; bytes += 7) {
    EXPECT_FALSE(ReadTlsFiles(Paths(server_.certificate, server_.key.substr(0, bytes))).ok()) << bytes;
  }
  const std::string chain = server_.certificate + authority_.certificate().substr(0, 200);
  EXPECT_THAT(WhatIsWrong(Paths(chain, server_.key)), HasSubstr("certificate 2 is damaged"));
}

}  // namespace
}  // namespace dlcs
