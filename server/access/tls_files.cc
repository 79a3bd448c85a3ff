// SPDX-License-Identifier: Apache-2.0
#include "server/access/tls_files.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <ctime>
#include <memory>
#include <vector>

#include "fmt/format.h"
#include "server/access/file_text.h"

namespace dlcs {
namespace {

template <auto free>
struct FreeWith {
  template <typename T>
  void operator()(T* owned) const {
    free(owned);
  }
};
using Bio = std::unique_ptr<BIO, FreeWith<BIO_free>>;
using Certificate = std::unique_ptr<X509, FreeWith<X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, FreeWith<EVP_PKEY_free>>;

// OpenSSL would ask the terminal.
int NoPassphrase(char*, int, int, void* asked) {
  *static_cast<bool*>(asked) = true;
  return -1;
}

Bio Reader(const std::string& pem) { return Bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size()))); }

absl::Status Broken(const char* flag, const std::string& path, const std::string& rule) {
  ERR_clear_error();  // of this thread, which others look at too
  return absl::InvalidArgumentError(fmt::format("{} {}: {}", flag, path, rule));
}

absl::StatusOr<std::string> ReadFile(const char* flag, const std::string& path) {
  absl::StatusOr<std::string> text = ReadSmallFile(path);
  if (text.ok()) return text;
  return absl::InvalidArgumentError(fmt::format("{} {}", flag, std::string(text.status().message())));
}

// At least one certificate, and no broken one.
absl::StatusOr<std::vector<Certificate>> ParseCertificates(const char* flag, const std::string& path,
                                                           const std::string& pem) {
  const Bio reader = Reader(pem);
  std::vector<Certificate> certificates;
  while (X509* certificate = PEM_read_bio_X509(reader.get(), nullptr, nullptr, nullptr)) {
    certificates.emplace_back(certificate);
  }
  const bool at_end = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
  if (!at_end) return Broken(flag, path, fmt::format("certificate {} is damaged", certificates.size() + 1));
  if (certificates.empty()) {
    return Broken(flag, path, "holds no certificate in PEM form, which begins with -----BEGIN CERTIFICATE-----");
  }
  ERR_clear_error();
  return certificates;
}

absl::StatusOr<Key> ParseKey(const char* flag, const std::string& path, const std::string& pem) {
  bool asked = false;
  Key key(PEM_read_bio_PrivateKey(Reader(pem).get(), nullptr, NoPassphrase, &asked));
  if (asked) return Broken(flag, path, "is locked with a passphrase; must be without (openssl pkey -in ... -out ...)");
  if (key == nullptr) return Broken(flag, path, "holds no private key in PEM form");
  return key;
}

std::string WhenValid(const X509& certificate, const std::string& path) {
  const auto text = [](const ASN1_TIME* time) {
    const Bio writer(BIO_new(BIO_s_mem()));
    ASN1_TIME_print(writer.get(), time);
    char* data = nullptr;
    const long size = BIO_get_mem_data(writer.get(), &data);
    return std::string(data, static_cast<std::size_t>(size));
  };
  const ASN1_TIME* const begin = X509_get0_notBefore(&certificate);
  const ASN1_TIME* const end = X509_get0_notAfter(&certificate);
  if (X509_cmp_current_time(end) < 0) return fmt::format("--tls-cert {}: expired on {}", path, text(end));
  if (X509_cmp_current_time(begin) > 0) return fmt::format("--tls-cert {}: is not valid before {}", path, text(begin));
  return "";
}

}  // namespace

absl::StatusOr<TlsFiles> ReadTlsFiles(const TlsPaths& paths) {
  constexpr const char* kCert = "--tls-cert";
  constexpr const char* kKey = "--tls-key";
  constexpr const char* kClientCa = "--tls-client-ca";
  TlsFiles files;
  absl::StatusOr<std::string> pem = ReadFile(kCert, paths.certificate);
  if (!pem.ok()) return pem.status();
  files.certificate = *std::move(pem);
  const auto certificates = ParseCertificates(kCert, paths.certificate, files.certificate);
  if (!certificates.ok()) return certificates.status();

  pem = ReadFile(kKey, paths.key);
  if (!pem.ok()) return pem.status();
  files.key = *std::move(pem);
  const absl::StatusOr<Key> key = ParseKey(kKey, paths.key, files.key);
  if (!key.ok()) return key.status();
  if (X509_check_private_key(certificates->front().get(), key->get()) != 1) {
    return Broken(kKey, paths.key, fmt::format("is not the key of the first certificate in {}", paths.certificate));
  }
  files.warning = WhenValid(*certificates->front(), paths.certificate);

  if (paths.client_ca.empty()) return files;
  pem = ReadFile(kClientCa, paths.client_ca);
  if (!pem.ok()) return pem.status();
  files.client_ca = *std::move(pem);
  const auto authorities = ParseCertificates(kClientCa, paths.client_ca, files.client_ca);
  if (!authorities.ok()) return authorities.status();
  return files;
}

}  // namespace dlcs
