// SPDX-License-Identifier: Apache-2.0
// Access control for gRPC: credentials of a listening socket, and the caller of a call.

#ifndef DLCS_SERVER_ACCESS_CREDENTIALS_H_
#define DLCS_SERVER_ACCESS_CREDENTIALS_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "grpcpp/security/server_credentials.h"
#include "grpcpp/server_context.h"
#include "server/access/access.h"

namespace dlcs {

// Credentials for a listening socket. It uses TLS if `access` has a certificate, always the newest one. It refuses
// calls for which access.MayCall() is not OK, before their first message is read. `access` and the returned credentials
// must outlive the server.
std::shared_ptr<grpc::ServerCredentials> CredentialsFor(const Access& access);

// Whether this process forwards the call to itself (server/gateway).
bool IsForwarded(const grpc::ServerContextBase& context);
// The address of the caller, as gRPC writes it; for a call that this process forwards, that of the original caller.
std::string PeerOf(const Access& access, const grpc::ServerContextBase& context);
// The caller of an admitted call. Errors: Unauthenticated, if the token was removed meanwhile.
absl::StatusOr<Caller> CallerOf(const Access& access, const grpc::ServerContextBase& context);
// The user's name for the log; empty if the server has no users, or this user was removed.
std::string UserOf(const Access& access, const grpc::ServerContextBase& context);

}  // namespace dlcs

#endif  // DLCS_SERVER_ACCESS_CREDENTIALS_H_
