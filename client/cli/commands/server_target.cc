// SPDX-License-Identifier: Apache-2.0
#include "client/cli/commands/server_target.h"

#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "client/cli/commands/contexts.h"
#include "proto/shared/small_file.h"

namespace dlcs::client {
namespace {

// A variable that is set but empty is an error: most likely a script's own variable was not set.
absl::StatusOr<std::string> Variable(const char* name) {
  const char* const value = std::getenv(name);
  if (value != nullptr && *value == '\0') {
    return absl::InvalidArgumentError(fmt::format("{} is set but empty; give it a value, or unset it", name));
  }
  return std::string(value == nullptr ? "" : value);
}

// The first of the options for a server that was typed; null if none was.
const char* FirstTyped(const ServerTarget& target) {
  if (target.tls) return "--tls";
  if (!target.tls_ca.empty()) return "--tls-ca";
  if (!target.tls_cert.empty()) return "--tls-cert";
  if (!target.tls_key.empty()) return "--tls-key";
  return target.token_file.empty() ? nullptr : "--token-file";
}

void FillFrom(const ServerTarget& context, ServerTarget& target) {
  target.address = context.address;
  target.tls = target.tls || context.tls;
  for (std::string ServerTarget::*field :
       {&ServerTarget::tls_ca, &ServerTarget::tls_cert, &ServerTarget::tls_key, &ServerTarget::token_file}) {
    if ((target.*field).empty()) target.*field = context.*field;
  }
}

}  // namespace

absl::Status Complete(ServerTarget& target) {
  if (target.local) {
    target = ServerTarget();
    return absl::OkStatus();
  }
  if (target.typed) return absl::OkStatus();
  const absl::StatusOr<std::string> server = Variable("DLCS_SERVER");
  if (!server.ok()) return server.status();
  const absl::StatusOr<std::string> variable = Variable("DLCS_CONTEXT");
  if (!variable.ok()) return variable.status();
  if (target.context.empty() && !server->empty()) {
    target.address = *server;
    target.origin = "DLCS_SERVER";
    return absl::OkStatus();
  }
  const absl::StatusOr<Contexts> contexts = ReadContexts();
  if (!contexts.ok()) return contexts.status();
  if (target.context.empty()) target.context = *variable;
  if (target.context.empty()) target.context = contexts->current;
  if (!target.context.empty()) {
    const absl::StatusOr<ServerTarget> context = FindContext(*contexts, target.context);
    if (!context.ok()) return context.status();
    FillFrom(*context, target);
    target.origin = "context " + target.context;
    return absl::OkStatus();
  }
  // If a command can also run in this process, these options have no effect without a server.
  const char* const typed = FirstTyped(target);
  if (typed == nullptr || !target.address.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(fmt::format("{} requires --server", typed));
}

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
