// SPDX-License-Identifier: Apache-2.0
// Real certificates, made when they are needed.

#ifndef DLCS_TESTS_SERVER_TEST_AUTHORITY_H_
#define DLCS_TESTS_SERVER_TEST_AUTHORITY_H_

#include <openssl/evp.h>
#include <openssl/x509.h>

#include <memory>
#include <string>

namespace dlcs::testing {

// PEM.
struct Issued {
  std::string certificate;
  std::string key;
};

// A new authority, known to no other test.
class TestAuthority {
 public:
  TestAuthority();

  // Its own certificate.
  const std::string& certificate() const { return certificate_; }

  // For `name` as common name, valid from yesterday until `days` from now, which may lie behind.
  // `alternative_names` as OpenSSL writes them.
  Issued Issue(const std::string& name, int days = 30,
               const std::string& alternative_names = "DNS:localhost,IP:127.0.0.1") const;

 private:
  std::shared_ptr<EVP_PKEY> key_;
  std::shared_ptr<X509> issuer_;
  std::string certificate_;
};

// Replaces the content of `file` at once, as `mv` does.
void ReplaceFile(const std::string& file, const std::string& content);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SERVER_TEST_AUTHORITY_H_
