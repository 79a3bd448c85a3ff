// SPDX-License-Identifier: Apache-2.0
// Checks the files of an encrypted connection, and finds out why such a connection fails. gRPC does neither.

#ifndef DLCS_CLIENT_RPC_TLS_H_
#define DLCS_CLIENT_RPC_TLS_H_

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "client/rpc/connection_options.h"

namespace dlcs::client {

// The contents of the files; empty for those that are not given.
struct TlsTexts {
  std::string ca;
  std::string certificate;
  std::string key;
};

// Errors: InvalidArgument with the field ("tls_ca"), the file and the rule.
absl::StatusOr<TlsTexts> ReadTls(const ConnectionOptions& options);

// Connects again without gRPC, and describes the problem if it is one of TLS: the certificate of the server or of the
// client, or only one end uses TLS. Absent otherwise. Takes at most some seconds.
std::optional<std::string> DiagnoseTls(const ConnectionOptions& options);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RPC_TLS_H_
