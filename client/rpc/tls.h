// SPDX-License-Identifier: Apache-2.0
// The files of an encrypted connection, checked, and why such a connection does not come about: gRPC says neither.

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

// Connects once more, without gRPC, and says what is wrong between both ends where that is TLS: the certificate of the
// server or of the client, or that one end speaks TLS and the other does not. Nothing where it is something else. Takes
// at most some seconds.
std::optional<std::string> DiagnoseTls(const ConnectionOptions& options);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RPC_TLS_H_
