// SPDX-License-Identifier: Apache-2.0
// Where a command runs, as it was typed.

#ifndef DLCS_CLIENT_CLI_SERVER_TARGET_H_
#define DLCS_CLIENT_CLI_SERVER_TARGET_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/connection_options.h"

namespace dlcs::client {

struct ServerTarget {
  std::string address;  // HOST:PORT; empty where a command runs in this process
  bool tls = false;
  std::string tls_ca;
  std::string tls_cert;
  std::string tls_key;
  std::string token_file;  // empty: the environment's DLCS_TOKEN, where there is one
};

inline ServerTarget ServerAt(const std::string& address) {
  ServerTarget target;
  target.address = address;
  return target;
}

// With the token. Errors: InvalidArgument with the option, the file and the rule.
absl::StatusOr<ConnectionOptions> ConnectionTo(const ServerTarget& target);

// An error of Connection::Open() in the words of the command line: "tls_ca: ..." is --tls-ca.
absl::Status InOptions(const absl::Status& status, const ServerTarget& target);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_SERVER_TARGET_H_
