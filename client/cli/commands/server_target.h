// SPDX-License-Identifier: Apache-2.0
// Where a command runs.

#ifndef DLCS_CLIENT_CLI_COMMANDS_SERVER_TARGET_H_
#define DLCS_CLIENT_CLI_COMMANDS_SERVER_TARGET_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/rpc/connection_options.h"

namespace dlcs::client {

struct ServerTarget {
  std::string address;  // HOST:PORT; empty if a command runs in this process
  bool tls = false;
  std::string tls_ca;
  std::string tls_cert;
  std::string tls_key;
  std::string token_file;  // empty: the environment variable DLCS_TOKEN, if set

  bool typed = false;   // --server was given
  bool local = false;   // --local: in this process, in spite of the environment
  std::string context;  // --context, or the context used by Complete() (contexts.h)
  std::string origin;   // the origin of an address that was not typed: "DLCS_SERVER", "context lab"
};

inline ServerTarget ServerAt(const std::string& address) {
  ServerTarget target;
  target.address = address;
  return target;
}

// The connection options, with the token. Errors: InvalidArgument with the option, the file and the rule.
absl::StatusOr<ConnectionOptions> ConnectionTo(const ServerTarget& target);

// An error of Connection::Open() with the name of the option: "tls_ca: ..." becomes --tls-ca.
absl::Status InOptions(const absl::Status& status, const ServerTarget& target);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMANDS_SERVER_TARGET_H_
