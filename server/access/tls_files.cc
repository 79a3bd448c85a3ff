// SPDX-License-Identifier: Apache-2.0
#include "server/access/tls_files.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/x509.h>

#include <ctime>
#include <memory>
#include <utility>

#include "fmt/format.h"
#include "proto/shared/pem.h"
#include "proto/shared/small_file.h"

namespace dlcs {
namespace {

using Bio = std::unique_ptr<BIO, FreeWith<BIO_free>>;

absl::Status Broken(const char* flag, const std::string& path, const std::string& rule) {
  return absl::InvalidArgumentError(fmt::format("{} {}: {}", flag, path, rule));
}

// Reads the file at `path` into `text`, and returns its content parsed by `parse`.
template <typename Parse>
auto Read(const char* flag, const std::string& path, std::string& text, Parse parse) -> decltype(parse(text)) {
  absl::StatusOr<std::string> read = ReadSmallFile(path);
  if (!read.ok()) return absl::InvalidArgumentError(fmt::format("{} {}", flag, std::string(read.status().message())));
  text = *std::move(read);
  auto parsed = parse(text);
  if (!parsed.ok()) return Broken(flag, path, std::string(parsed.status().message()));
  return parsed;
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
  TlsFiles files;
  const auto certificates = Read("--tls-cert", paths.certificate, files.certificate, ParseCertificates);
  if (!certificates.ok()) return certificates.status();
  const auto key = Read("--tls-key", paths.key, files.key, ParsePrivateKey);
  if (!key.ok()) return key.status();
  if (X509_check_private_key(certificates->front().get(), key->get()) != 1) {
    ERR_clear_error();  // of this thread: other code checks it too
    return Broken("--tls-key", paths.key,
                  fmt::format("is not the key of the first certificate in {}", paths.certificate));
  }
  files.warning = WhenValid(*certificates->front(), paths.certificate);
  if (paths.client_ca.empty()) return files;
  const auto authorities = Read("--tls-client-ca", paths.client_ca, files.client_ca, ParseCertificates);
  if (!authorities.ok()) return authorities.status();
  return files;
}

}  // namespace dlcs
