// SPDX-License-Identifier: Apache-2.0
// Certificates and private keys in PEM form.

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

// Errors of both: InvalidArgument with a message to be appended to the name of the file; clears OpenSSL's error queue
// of this thread.

// All certificates in `pem`: at least one, all valid.
absl::StatusOr<std::vector<X509Certificate>> ParseCertificates(const std::string& pem);
// A private key without a passphrase.
absl::StatusOr<PrivateKey> ParsePrivateKey(const std::string& pem);

}  // namespace dlcs

#endif  // DLCS_PROTO_SHARED_PEM_H_
