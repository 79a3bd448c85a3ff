// SPDX-License-Identifier: Apache-2.0
// Access, as gRPC asks for it: credentials of a listening socket, and who a call is from.

#ifndef DLCS_SERVER_ACCESS_CREDENTIALS_H_
#define DLCS_SERVER_ACCESS_CREDENTIALS_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "grpcpp/security/server_credentials.h"
#include "grpcpp/server_context.h"
#include "server/access/access.h"

namespace dlcs {

// With them a socket speaks TLS where `access` has a certificate, always the newest one, and refuses a call of any
// service, before its first message is read, unless access.MayCall() it. Both `access` and what is returned must
// outlive the server.
std::shared_ptr<grpc::ServerCredentials> CredentialsFor(const Access& access);

// Who made a call that was let in. Errors: Unauthenticated, where the token was taken away meanwhile.
absl::StatusOr<Caller> CallerOf(const Access& access, const grpc::ServerContextBase& context);
// The user's name, for the log; empty where the server knows no users, or this one no more.
std::string UserOf(const Access& access, const grpc::ServerContextBase& context);

}  // namespace dlcs

#endif  // DLCS_SERVER_ACCESS_CREDENTIALS_H_
