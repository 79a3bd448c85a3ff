// SPDX-License-Identifier: Apache-2.0
// Where a command runs, as it was typed, and as the environment and the contexts complete it.

#ifndef DLCS_CLIENT_CLI_COMMANDS_SERVER_TARGET_H_
#define DLCS_CLIENT_CLI_COMMANDS_SERVER_TARGET_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/rpc/connection_options.h"

namespace dlcs::client {

struct ServerTarget {
  std::string address;  // HOST:PORT; empty where a command runs in this process
  bool tls = false;
  std::string tls_ca;
  std::string tls_cert;
  std::string tls_key;
  std::string token_file;  // empty: the environment's DLCS_TOKEN, where there is one

  bool typed = false;   // with --server
  bool local = false;   // --local: in this process, whatever the environment says
  std::string context;  // --context, or where Complete() took the rest from
  std::string origin;   // where the address is from if it was not typed: "DLCS_SERVER", "context lab"
};

inline ServerTarget ServerAt(const std::string& address) {
  ServerTarget target;
  target.address = address;
  return target;
}

// Takes what was not typed from, in this order: the context of --context; DLCS_SERVER, an address; the context that
// DLCS_CONTEXT names; the current one (contexts.h). What was typed beside a context counts before it. Errors:
// InvalidArgument with the option or the variable, and the rule.
absl::Status Complete(ServerTarget& target);

// With the token. Errors: InvalidArgument with the option, the file and the rule.
absl::StatusOr<ConnectionOptions> ConnectionTo(const ServerTarget& target);

// An error of Connection::Open() in the words of the command line: "tls_ca: ..." is --tls-ca.
absl::Status InOptions(const absl::Status& status, const ServerTarget& target);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMANDS_SERVER_TARGET_H_
