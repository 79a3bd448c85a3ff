// SPDX-License-Identifier: Apache-2.0
#include "proto/shared/pem.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>

#include "absl/strings/str_cat.h"

namespace dlcs {
namespace {

using Bio = std::unique_ptr<BIO, FreeWith<BIO_free>>;

Bio Reader(const std::string& pem) { return Bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size()))); }

// Without a callback OpenSSL would ask on the terminal.
int NoPassphrase(char*, int, int, void* asked) {
  *static_cast<bool*>(asked) = true;
  return -1;
}

absl::Status Broken(const std::string& rule) {
  ERR_clear_error();  // of this thread: other code checks it too
  return absl::InvalidArgumentError(rule);
}

}  // namespace

absl::StatusOr<std::vector<X509Certificate>> ParseCertificates(const std::string& pem) {
  const Bio reader = Reader(pem);
  std::vector<X509Certificate> certificates;
  while (X509* certificate = PEM_read_bio_X509(reader.get(), nullptr, nullptr, nullptr)) {
    certificates.emplace_back(certificate);
  }
  const bool at_end = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
  if (!at_end) return Broken(absl::StrCat("certificate ", certificates.size() + 1, " is damaged"));
  if (certificates.empty()) {
    return Broken("holds no certificate in PEM form, which begins with -----BEGIN CERTIFICATE-----");
  }
  ERR_clear_error();
  return certificates;
}

absl::StatusOr<PrivateKey> ParsePrivateKey(const std::string& pem) {
  bool asked = false;
  PrivateKey key(PEM_read_bio_PrivateKey(Reader(pem).get(), nullptr, NoPassphrase, &asked));
  if (asked) return Broken("is locked with a passphrase; must be without (openssl pkey -in ... -out ...)");
  if (key == nullptr) return Broken("holds no private key in PEM form");
  return key;
}

}  // namespace dlcs
