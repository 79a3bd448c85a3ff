// SPDX-License-Identifier: Apache-2.0
// What dlcsd is told: flags, environment, a file of settings.

#ifndef DLCS_SERVER_FLAGS_H_
#define DLCS_SERVER_FLAGS_H_

#include <optional>
#include <string>
#include <vector>

#include "server/access/token_command.h"
#include "server/config/server_config.h"

namespace dlcs {

struct Flags {
  ServerConfig config;
  std::optional<TokenRequest> new_token;  // make one, and end
  double grace_s = 10;
  std::string log_level = "info";
  std::string log_format = "text";
  std::vector<std::string> warnings;  // of what was set and counts for nothing
};

// Reads all settings and checks them. A flag --max-steps is also the variable DLCSD_MAX_STEPS and the key max-steps of
// the file that --config or DLCSD_CONFIG names; where a setting is given more than once, the flag counts before the
// variable, and the variable before the file.
//
// Nothing when the program is to end at once with `exit_status`: after --help, --version, --check-config (0), or an
// error (2), which was printed with the flag, its value, the rule, and where the value comes from.
std::optional<Flags> ReadFlags(int argc, char** argv, int& exit_status);

}  // namespace dlcs

#endif  // DLCS_SERVER_FLAGS_H_
