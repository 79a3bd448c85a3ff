// SPDX-License-Identifier: Apache-2.0
#include "client/cli/commands/contexts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>
#include <vector>

#include "client/cli/output/atomic_file.h"
#include "proto/shared/nearest_name.h"
#include "proto/shared/small_file.h"

namespace dlcs::client {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<std::pair<const char*, std::string ServerTarget::*>, 5> kFields = {{
    {"server", &ServerTarget::address},
    {"tls_ca", &ServerTarget::tls_ca},
    {"tls_cert", &ServerTarget::tls_cert},
    {"tls_key", &ServerTarget::tls_key},
    {"token_file", &ServerTarget::token_file},
}};

Json ToJson(const ServerTarget& target) {
  Json json = Json::object();
  for (const auto& [key, field] : kFields) {
    if (!(target.*field).empty()) json[key] = target.*field;
  }
  if (target.tls) json["tls"] = true;
  return json;
}

// Throws an nlohmann exception if a value has the wrong type.
ServerTarget FromJson(const Json& json) {
  ServerTarget target;
  for (const auto& [key, field] : kFields) target.*field = json.value(key, "");
  target.tls = json.value("tls", false);
  return target;
}

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

std::string ContextsPath() {
  const char* const config = std::getenv("XDG_CONFIG_HOME");
  if (config != nullptr && *config != '\0') return std::string(config) + "/dlcs/contexts.json";
  const char* const home = std::getenv("HOME");
  return home == nullptr || *home == '\0' ? "" : std::string(home) + "/.config/dlcs/contexts.json";
}

absl::StatusOr<Contexts> ReadContexts() {
  const std::string path = ContextsPath();
  std::error_code ignored;
  if (path.empty() || !std::filesystem::exists(path, ignored)) return Contexts();
  const absl::StatusOr<std::string> text = ReadSmallFile(path);
  if (!text.ok()) return absl::InvalidArgumentError(std::string(text.status().message()));
  try {
    const Json json = Json::parse(*text);
    Contexts contexts;
    contexts.current = json.value("current", "");
    for (const auto& [name, target] : json.at("contexts").items()) contexts.targets.emplace(name, FromJson(target));
    return contexts;
  } catch (const Json::exception& error) {
    return absl::InvalidArgumentError(
        fmt::format("{}: is not what dlcs context writes; correct or remove it ({})", path, error.what()));
  }
}

absl::Status WriteContexts(const Contexts& contexts) {
  const std::string path = ContextsPath();
  if (path.empty()) return absl::InvalidArgumentError("HOME is not set: there is no place for contexts");
  std::error_code error;
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), error);
  auto file = AtomicFile::Create(path);
  if (!file.ok()) return file.status();
  Json json;
  json["current"] = contexts.current;
  json["contexts"] = Json::object();
  for (const auto& [name, target] : contexts.targets) json["contexts"][name] = ToJson(target);
  fmt::print((*file)->stream(), "{}\n", json.dump(2));
  return (*file)->Commit();
}

absl::StatusOr<ServerTarget> FindContext(const Contexts& contexts, const std::string& name) {
  const auto found = contexts.targets.find(name);
  if (found != contexts.targets.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [known, target] : contexts.targets) names.push_back(known);
  if (names.empty()) {
    return absl::InvalidArgumentError(
        fmt::format("there is no context \"{}\"; make it with: dlcs context set {} --server HOST:PORT", name, name));
  }
  return absl::InvalidArgumentError(fmt::format("there is no context \"{}\", but {}{}", name, fmt::join(names, ", "),
                                                DidYouMean(NearestName(name, names))));
}

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

}  // namespace dlcs::client
