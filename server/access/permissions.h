// SPDX-License-Identifier: Apache-2.0
// What a user may do: one right for every method of every service, in one table.

#ifndef DLCS_SERVER_ACCESS_PERMISSIONS_H_
#define DLCS_SERVER_ACCESS_PERMISSIONS_H_

#include <optional>
#include <string>
#include <string_view>

namespace dlcs {

// Each includes those before it.
enum class Right {
  kNone,       // nobody is asked who they are
  kReader,     // looks at what is there
  kSubmitter,  // makes the server work, and ends that work
  kAdmin,      // sees and ends everybody's
};

// "reader", "submitter", "admin".
const char* RightName(Right right);
// The right of that name that a user can have.
std::optional<Right> RightNamed(std::string_view name);

struct MethodRule {
  Right right;
  // Changes what is stored, or begins what will be: such calls are written down (audit.h).
  bool changes;
};

// The rule for the method at `path`, "/dlcs.v1.JobService/GetSolveJob"; nothing for a method that the table does not
// have, which is to be refused.
std::optional<MethodRule> RuleOf(std::string_view path);

}  // namespace dlcs

#endif  // DLCS_SERVER_ACCESS_PERMISSIONS_H_
