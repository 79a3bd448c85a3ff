// SPDX-License-Identifier: Apache-2.0
#include "client/cli/commands/server_target.h"

#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "proto/shared/small_file.h"

namespace dlcs::client {

absl::StatusOr<ConnectionOptions> ConnectionTo(const ServerTarget& target) {
  ConnectionOptions options(target.address);
  options.repeat = ConnectionOptions::Repeat::kAfterAnswer;
  options.tls = target.tls;
  options.tls_ca = target.tls_ca;
  options.tls_cert = target.tls_cert;
  options.tls_key = target.tls_key;
  if (target.token_file.empty()) {
    if (const char* token = std::getenv("DLCS_TOKEN")) options.token = token;
    return options;
  }
  absl::StatusOr<std::string> text = ReadSmallFile(target.token_file);
  if (!text.ok()) {
    return absl::InvalidArgumentError(fmt::format("--token-file: {}", std::string(text.status().message())));
  }
  options.token = *std::move(text);
  const std::size_t end = options.token.find_last_not_of(" \t\r\n");
  options.token.resize(end == std::string::npos ? 0 : end + 1);
  if (options.token.empty()) {
    return absl::InvalidArgumentError(fmt::format("--token-file: {}: is empty; must hold a token", target.token_file));
  }
  return options;
}

absl::Status InOptions(const absl::Status& status, const ServerTarget& target) {
  const std::string address = target.origin.empty() ? "--server" : target.origin;
  const std::string token = target.token_file.empty() ? "DLCS_TOKEN" : "--token-file: " + target.token_file;
  const std::array<std::pair<std::string_view, std::string_view>, 5> names = {{{"address", address},
                                                                               {"tls_ca", "--tls-ca"},
                                                                               {"tls_cert", "--tls-cert"},
                                                                               {"tls_key", "--tls-key"},
                                                                               {"token", token}}};
  const std::string message(status.message());
  for (const auto& [field, option] : names) {
    if (!message.starts_with(fmt::format("{}: ", field))) continue;
    return absl::Status(status.code(), fmt::format("{}{}", option, message.substr(field.size())));
  }
  return status;
}

}  // namespace dlcs::client
