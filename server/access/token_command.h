// SPDX-License-Identifier: Apache-2.0
// `dlcsd token`: makes a token for a user.

#ifndef DLCS_SERVER_ACCESS_TOKEN_COMMAND_H_
#define DLCS_SERVER_ACCESS_TOKEN_COMMAND_H_

#include <string>

#include "absl/status/status.h"

namespace dlcs {

struct TokenRequest {
  std::string user;
  std::string right = "submitter";
  std::string save;  // a file for the token, which must not exist yet; empty: standard error
};

// Prints the line for the --tokens file on standard output. The token itself is written to `wanted.save` and nowhere
// else. Errors: InvalidArgument for a name or right that is not allowed in that line, or a file that cannot be created.
absl::Status MakeToken(const TokenRequest& wanted);

}  // namespace dlcs

#endif  // DLCS_SERVER_ACCESS_TOKEN_COMMAND_H_
