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
  // Where it is given, clients need a certificate of one of these authorities.
  std::string tls_client_ca;
  // The file of users (users.h). Without one everybody may do everything.
  std::string tokens;
  // Without encryption also to other machines: for networks that are trusted, and behind proxies that encrypt.
  bool insecure_listen = false;
  // Calls at the same time on one connection. More wait at the client.
  int max_streams_per_connection = 1000;
  // Watches of jobs at the same time of one user; callers without a name are one user.
  int max_watches_per_user = 1000;
};

// Errors: InvalidArgument with the flag, its value and the rule. Files are looked at later.
absl::Status Validate(const AccessSettings& settings);

}  // namespace dlcs

#endif  // DLCS_SERVER_ACCESS_ACCESS_SETTINGS_H_
