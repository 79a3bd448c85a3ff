// SPDX-License-Identifier: Apache-2.0
// The certificate of a server, its key, and the authorities of its clients: read and checked.

#ifndef DLCS_SERVER_ACCESS_TLS_FILES_H_
#define DLCS_SERVER_ACCESS_TLS_FILES_H_

#include <string>

#include "absl/status/statusor.h"

namespace dlcs {

struct TlsPaths {
  std::string certificate;  // PEM: the server's certificate, followed by intermediate certificates
  std::string key;          // PEM, without a passphrase
  std::string client_ca;    // PEM: authorities of clients; empty: clients need no certificate
};

// The contents of the files, checked to belong together.
struct TlsFiles {
  std::string certificate;
  std::string key;
  std::string client_ca;
  // A warning for the operator, if the certificate is usable but not valid now; otherwise empty.
  std::string warning;
};

// Errors: InvalidArgument with flag, path and rule. (gRPC itself would only fail every connection.)
absl::StatusOr<TlsFiles> ReadTlsFiles(const TlsPaths& paths);

}  // namespace dlcs

#endif  // DLCS_SERVER_ACCESS_TLS_FILES_H_
