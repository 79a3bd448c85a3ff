// SPDX-License-Identifier: Apache-2.0
// The audit log: a line for every call that changes something, and for every call that was refused because of its
// caller.

#ifndef DLCS_SERVER_ACCESS_AUDIT_H_
#define DLCS_SERVER_ACCESS_AUDIT_H_

#include <string_view>

#include "absl/status/status.h"

namespace dlcs {

struct AuditRecord {
  std::string_view user;    // empty: not authenticated, or a server without users
  std::string_view method;  // "CreateSolveJob"
  std::string_view object;  // "jobs/...", "problems/..."; may be empty
  absl::StatusCode outcome = absl::StatusCode::kOk;
  std::string_view peer = {};  // address; empty if the call was refused before gRPC provides it
};

void Audit(const AuditRecord& record);

}  // namespace dlcs

#endif  // DLCS_SERVER_ACCESS_AUDIT_H_
