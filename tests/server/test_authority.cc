// SPDX-License-Identifier: Apache-2.0
#include "tests/server/test_authority.h"

#include <openssl/bio.h>
#include <openssl/ec.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include <atomic>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace dlcs::testing {
namespace {

std::shared_ptr<EVP_PKEY> NewKey() { return {EVP_EC_gen("P-256"), &EVP_PKEY_free}; }

template <typename Write>
std::string Pem(Write write) {
  const std::shared_ptr<BIO> out(BIO_new(BIO_s_mem()), &BIO_free);
  write(out.get());
  char* data = nullptr;
  const long size = BIO_get_mem_data(out.get(), &data);
  return std::string(data, static_cast<std::size_t>(size));
}

std::string Pem(X509* certificate) {
  return Pem([&](BIO* out) { PEM_write_bio_X509(out, certificate); });
}

void AddExtension(int kind, const std::string& value, X509* issuer, X509* certificate) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  X509_EXTENSION* const extension = X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str());
  X509_add_ext(certificate, extension, -1);
  X509_EXTENSION_free(extension);
}

std::shared_ptr<X509> NewCertificate(const std::string& name, int days, EVP_PKEY* key) {
  static std::atomic<long> serial{1};
  constexpr long kDay = 24 * 3600;
  std::shared_ptr<X509> certificate(X509_new(), &X509_free);
  X509_set_version(certificate.get(), X509_VERSION_3);
  ASN1_INTEGER_set(X509_get_serialNumber(certificate.get()), ++serial);
  X509_gmtime_adj(X509_getm_notBefore(certificate.get()), days > 0 ? -kDay : (days - 1) * kDay);
  X509_gmtime_adj(X509_getm_notAfter(certificate.get()), days * kDay);
  X509_set_pubkey(certificate.get(), key);
  X509_NAME_add_entry_by_txt(X509_get_subject_name(certificate.get()), "CN", MBSTRING_UTF8,
                             reinterpret_cast<const unsigned char*>(name.c_str()), -1, -1, 0);
  return certificate;
}

}  // namespace

TestAuthority::TestAuthority() : key_(NewKey()), issuer_(NewCertificate("authority of a test", 30, key_.get())) {
  X509_set_issuer_name(issuer_.get(), X509_get_subject_name(issuer_.get()));
  AddExtension(NID_basic_constraints, "critical,CA:TRUE", issuer_.get(), issuer_.get());
  X509_sign(issuer_.get(), key_.get(), EVP_sha256());
  certificate_ = Pem(issuer_.get());
}

Issued TestAuthority::Issue(const std::string& name, int days, const std::string& alternative_names) const {
  const std::shared_ptr<EVP_PKEY> key = NewKey();
  const std::shared_ptr<X509> certificate = NewCertificate(name, days, key.get());
  X509_set_issuer_name(certificate.get(), X509_get_subject_name(issuer_.get()));
  AddExtension(NID_subject_alt_name, alternative_names, issuer_.get(), certificate.get());
  X509_sign(certificate.get(), key_.get(), EVP_sha256());
  return {Pem(certificate.get()),
          Pem([&](BIO* out) { PEM_write_bio_PrivateKey(out, key.get(), nullptr, nullptr, 0, nullptr, nullptr); })};
}

void ReplaceFile(const std::string& file, const std::string& content) {
  const std::string beside = file + ".new";
  std::ofstream(beside) << content;
  std::filesystem::rename(beside, file);
}

}  // namespace dlcs::testing
