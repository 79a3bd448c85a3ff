// SPDX-License-Identifier: Apache-2.0
// The settings that say who may call and how connections are protected. Each is a flag of dlcsd.

#ifndef DLCS_SERVER_ACCESS_ACCESS_SETTINGS_H_
#define DLCS_SERVER_ACCESS_ACCESS_SETTINGS_H_

#include <string>

#include "absl/status/status.h"

namespace dlcs {

struct AccessSettings {
  // PEM files (tls_files.h). Without a certificate nothing is encrypted.
  std::string tls_cert;
  std::string tls_key;
  // If it is set, clients need a certificate from one of these authorities.
  std::string tls_client_ca;
  // The file of users (users.h). Without it every caller may do everything.
  std::string tokens;
  // Allows unencrypted connections from other machines: for trusted networks, and behind proxies that encrypt.
  bool insecure_listen = false;
  // Concurrent calls on one connection. Further calls wait in the client.
  int max_streams_per_connection = 1000;
  // Concurrent watches of jobs per user; callers without a name count as one user.
  int max_watches_per_user = 1000;
};

// Errors: InvalidArgument with the flag, its value and the rule. Files are not read yet.
absl::Status Validate(const AccessSettings& settings);

}  // namespace dlcs

#endif  // DLCS_SERVER_ACCESS_ACCESS_SETTINGS_H_
