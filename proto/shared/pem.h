// SPDX-License-Identifier: Apache-2.0
// Certificates and private keys in PEM form, as servers and clients are given them.

#ifndef DLCS_PROTO_SHARED_PEM_H_
#define DLCS_PROTO_SHARED_PEM_H_

#include <openssl/evp.h>
#include <openssl/x509.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace dlcs {

// Deletes with a function of OpenSSL.
template <auto free>
struct FreeWith {
  template <typename T>
  void operator()(T* owned) const {
    free(owned);
  }
};
using X509Certificate = std::unique_ptr<X509, FreeWith<X509_free>>;
using PrivateKey = std::unique_ptr<EVP_PKEY, FreeWith<EVP_PKEY_free>>;

// Errors of both: InvalidArgument with what is wrong, as it stands behind the name of a file; OpenSSL's errors of this
// thread are gone then.

// All that are in `pem`: at least one, and no broken one.
absl::StatusOr<std::vector<X509Certificate>> ParseCertificates(const std::string& pem);
// One that is not locked with a passphrase.
absl::StatusOr<PrivateKey> ParsePrivateKey(const std::string& pem);

}  // namespace dlcs

#endif  // DLCS_PROTO_SHARED_PEM_H_
