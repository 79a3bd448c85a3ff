// SPDX-License-Identifier: Apache-2.0
#include "server/http/certificate_names.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <openssl/x509v3.h>

#include <array>
#include <cstddef>

namespace dlcs {

std::vector<std::string> NamesIn(X509& certificate) {
  std::vector<std::string> names;
  const X509_NAME* const subject = X509_get_subject_name(&certificate);
  for (int at = -1; (at = X509_NAME_get_index_by_NID(subject, NID_commonName, at)) >= 0;) {
    unsigned char* text = nullptr;
    const int size = ASN1_STRING_to_UTF8(&text, X509_NAME_ENTRY_get_data(X509_NAME_get_entry(subject, at)));
    if (size < 0) continue;
    names.emplace_back(reinterpret_cast<const char*>(text), static_cast<std::size_t>(size));
    OPENSSL_free(text);
  }
  auto* const others =
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(&certificate, NID_subject_alt_name, nullptr, nullptr));
  for (int k = 0; k < sk_GENERAL_NAME_num(others); ++k) {
    const GENERAL_NAME* const name = sk_GENERAL_NAME_value(others, k);
    if (name->type == GEN_IPADD) {
      const ASN1_OCTET_STRING* const bytes = name->d.iPAddress;
      std::array<char, INET6_ADDRSTRLEN> text{};
      const auto size = static_cast<std::size_t>(ASN1_STRING_length(bytes));
      if (size != sizeof(in_addr) && size != sizeof(in6_addr)) continue;
      const int family = size == sizeof(in_addr) ? AF_INET : AF_INET6;
      if (inet_ntop(family, ASN1_STRING_get0_data(bytes), text.data(), text.size()) != nullptr) {
        names.emplace_back(text.data());
      }
      continue;
    }
    if (name->type != GEN_DNS && name->type != GEN_URI && name->type != GEN_EMAIL) continue;
    const ASN1_IA5STRING* const text = name->d.ia5;  // the same member for all three
    names.emplace_back(reinterpret_cast<const char*>(ASN1_STRING_get0_data(text)),
                       static_cast<std::size_t>(ASN1_STRING_length(text)));
  }
  GENERAL_NAMES_free(others);
  return names;
}

}  // namespace dlcs
