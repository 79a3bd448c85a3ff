// SPDX-License-Identifier: Apache-2.0
#include "server/http/certificate_names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <memory>
#include <string>
#include <utility>

namespace dlcs {
namespace {

using ::testing::ElementsAre;

GENERAL_NAME* AlternativeName(int type, const std::string& bytes) {
  ASN1_STRING* const text = type == GEN_IPADD ? ASN1_OCTET_STRING_new() : ASN1_IA5STRING_new();
  ASN1_STRING_set(text, bytes.data(), static_cast<int>(bytes.size()));
  GENERAL_NAME* const name = GENERAL_NAME_new();
  GENERAL_NAME_set0_value(name, type, text);
  return name;
}

// What is not an address would be read beyond its end.
TEST(CertificateNamesTest, LeavesOutAddressesOfAnotherLength) {
  const std::unique_ptr<X509, decltype(&X509_free)> certificate(X509_new(), X509_free);
  const std::unique_ptr<GENERAL_NAMES, decltype(&GENERAL_NAMES_free)> names(GENERAL_NAMES_new(), GENERAL_NAMES_free);
  for (const auto& [type, bytes] : {std::pair(GEN_IPADD, std::string("\x0a\0\0\x07", 4)),
                                    {GEN_IPADD, std::string("\x0a\0\0\x07\xff", 5)},
                                    {GEN_IPADD, std::string()},
                                    {GEN_IPADD, std::string(15, '\0') + '\x01'},
                                    {GEN_IPADD, std::string(17, '\x01')},
                                    {GEN_DNS, std::string("client.example")}}) {
    sk_GENERAL_NAME_push(names.get(), AlternativeName(type, bytes));
  }
  ASSERT_EQ(X509_add1_ext_i2d(certificate.get(), NID_subject_alt_name, names.get(), 0, 0), 1);
  EXPECT_THAT(NamesIn(*certificate), ElementsAre("10.0.0.7", "::1", "client.example"));
}

}  // namespace
}  // namespace dlcs
