// SPDX-License-Identifier: Apache-2.0
// Who did what: a line of the log for every call that changes something, and for every call that was refused for who
// made it.

#ifndef DLCS_SERVER_ACCESS_AUDIT_H_
#define DLCS_SERVER_ACCESS_AUDIT_H_

#include <string_view>

#include "absl/status/status.h"

namespace dlcs {

struct AuditRecord {
  std::string_view user;    // empty: nobody, or a server without users
  std::string_view method;  // "CreateSolveJob"
  std::string_view object;  // "jobs/...", "problems/..."; empty where it is about none
  absl::StatusCode outcome = absl::StatusCode::kOk;
  std::string_view peer = {};  // address; empty where a call was refused before gRPC tells it
};

void Audit(const AuditRecord& record);

}  // namespace dlcs

#endif  // DLCS_SERVER_ACCESS_AUDIT_H_
