// SPDX-License-Identifier: Apache-2.0
// The settings of dlcsd: flags, environment, configuration file.

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
  std::optional<TokenRequest> new_token;  // only make a token
  double grace_s = 10;
  std::string log_level = "info";
  std::string log_format = "text";
  std::vector<std::string> warnings;  // about settings without effect
};

// Reads all settings and checks them. A flag --max-steps is also the variable DLCSD_MAX_STEPS and the key max-steps of
// the file that --config or DLCSD_CONFIG names; if a setting is given more than once, the flag takes precedence over
// the variable, and the variable over the file.
//
// Absent if the program should exit at once with `exit_status`: after --help, --version, --check-config (0), or an
// error (2), which has been printed with the flag, its value, the rule, and the origin of the value.
std::optional<Flags> ReadFlags(int argc, char** argv, int& exit_status);

}  // namespace dlcs

#endif  // DLCS_SERVER_FLAGS_H_
