// SPDX-License-Identifier: Apache-2.0
// The permissions: one table with the right that each method of each service requires.

#ifndef DLCS_SERVER_ACCESS_PERMISSIONS_H_
#define DLCS_SERVER_ACCESS_PERMISSIONS_H_

#include <optional>
#include <string>
#include <string_view>

namespace dlcs {

// Each includes those before it.
enum class Right {
  kNone,       // callable without authentication
  kReader,     // may read own jobs and problems
  kSubmitter,  // may also solve, and create, cancel and delete own jobs and problems
  kAdmin,      // may do so for all users
};

// "reader", "submitter", "admin".
const char* RightName(Right right);
// The right of that name that a user can have.
std::optional<Right> RightNamed(std::string_view name);

struct MethodRule {
  Right right;
  // Whether the method changes stored data; such calls are logged (audit.h).
  bool changes;
};

// The rule for the method at `path`, "/dlcs.v1.JobService/GetSolveJob"; absent for a method that is not in the table,
// which must be refused.
std::optional<MethodRule> RuleOf(std::string_view path);

}  // namespace dlcs

#endif  // DLCS_SERVER_ACCESS_PERMISSIONS_H_
