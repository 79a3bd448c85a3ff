// SPDX-License-Identifier: Apache-2.0
#include "server/access/access_settings.h"

#include "fmt/format.h"

namespace dlcs {
namespace {

absl::Status Missing(const char* flag, const std::string& why) {
  return absl::InvalidArgumentError(fmt::format("{}: must be given, {}", flag, why));
}

absl::Status CheckAtLeastOne(const char* flag, int value) {
  if (value >= 1) return absl::OkStatus();
  return absl::InvalidArgumentError(fmt::format("{} {}: must be at least 1", flag, value));
}

}  // namespace

absl::Status Validate(const AccessSettings& settings) {
  if (!settings.tls_cert.empty() && settings.tls_key.empty()) {
    return Missing("--tls-key", fmt::format("since --tls-cert {} cannot be used without its key", settings.tls_cert));
  }
  if (!settings.tls_key.empty() && settings.tls_cert.empty()) {
    return Missing("--tls-cert",
                   fmt::format("since --tls-key {} cannot be used without its certificate", settings.tls_key));
  }
  if (!settings.tls_client_ca.empty() && settings.tls_cert.empty()) {
    return Missing("--tls-cert", fmt::format("since clients show the certificates of --tls-client-ca {} over TLS only",
                                             settings.tls_client_ca));
  }
  if (settings.insecure_listen && !settings.tls_cert.empty()) {
    return absl::InvalidArgumentError("--insecure-listen: must not be given with --tls-cert, which makes it secure");
  }
  if (absl::Status status = CheckAtLeastOne("--max-streams-per-connection", settings.max_streams_per_connection);
      !status.ok()) {
    return status;
  }
  return CheckAtLeastOne("--max-watches-per-user", settings.max_watches_per_user);
}

}  // namespace dlcs
