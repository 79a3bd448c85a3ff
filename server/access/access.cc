// SPDX-License-Identifier: Apache-2.0
#include "server/access/access.h"

#include <chrono>
#include <condition_variable>
#include <utility>

#include "fmt/format.h"
#include "server/access/audit.h"

namespace dlcs {
namespace {

constexpr std::chrono::seconds kLookEvery{1};

absl::StatusOr<Users> ReadUsers(const std::string& file) {
  absl::StatusOr<Users> users = Users::Read(file);
  if (users.ok()) return users;
  return absl::InvalidArgumentError(fmt::format("--tokens {}", std::string(users.status().message())));
}

absl::StatusOr<TlsFiles> ReadTls(const TlsPaths& paths) {
  absl::StatusOr<TlsFiles> files = ReadTlsFiles(paths);
  if (files.ok() && !files->warning.empty()) spdlog::warn("{}", files->warning);
  return files;
}

// The token of "Bearer TOKEN"; empty for anything else.
std::string_view TokenOf(std::string_view authorization) {
  constexpr std::string_view kScheme = "bearer ";
  if (authorization.size() < kScheme.size()) return {};
  for (std::size_t k = 0; k < kScheme.size(); ++k) {
    const char c = authorization[k];
    if ((c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c) != kScheme[k]) return {};
  }
  return authorization.substr(kScheme.size());
}

}  // namespace

absl::Status Access::Check(const AccessSettings& settings) {
  if (!settings.tokens.empty()) {
    if (const absl::StatusOr<Users> users = ReadUsers(settings.tokens); !users.ok()) return users.status();
  }
  if (settings.tls_cert.empty()) return absl::OkStatus();
  return ReadTlsFiles({settings.tls_cert, settings.tls_key, settings.tls_client_ca}).status();
}

absl::StatusOr<std::unique_ptr<Access>> Access::Open(const AccessSettings& settings) {
  std::unique_ptr<Access> access(new Access);
  if (!settings.tokens.empty()) {
    auto users = WatchedFile<Users>::Open({settings.tokens}, [file = settings.tokens] { return ReadUsers(file); });
    if (!users.ok()) return users.status();
    access->users_ = *std::move(users);
  }
  if (!settings.tls_cert.empty()) {
    const TlsPaths paths{settings.tls_cert, settings.tls_key, settings.tls_client_ca};
    std::vector<std::string> files = {paths.certificate, paths.key};
    if (!paths.client_ca.empty()) files.push_back(paths.client_ca);
    auto tls = WatchedFile<TlsFiles>::Open(std::move(files), [paths] { return ReadTls(paths); });
    if (!tls.ok()) return tls.status();
    access->tls_ = *std::move(tls);
  }
  if (access->users_ || access->tls_) {
    access->refresher_ = std::jthread([open = access.get()](const std::stop_token& stop) {
      std::mutex mutex;
      std::condition_variable_any changed;
      std::unique_lock lock(mutex);
      while (!changed.wait_for(lock, stop, kLookEvery, [&] { return stop.stop_requested(); })) open->Refresh();
    });
  }
  return access;
}

void Access::Refresh() {
  const std::lock_guard lock(refreshing_);
  if (users_) users_->Refresh();
  if (tls_) tls_->Refresh();
}

absl::StatusOr<Caller> Access::Identify(std::optional<std::string_view> authorization,
                                        std::span<const std::string> certificate_names) const {
  if (users_ == nullptr) return Caller{};
  const std::shared_ptr<const Users> users = users_->get();
  if (authorization) {
    const std::string_view token = TokenOf(*authorization);
    if (token.empty()) {
      return absl::UnauthenticatedError("The authorization header must be \"Bearer\", a blank and the token.");
    }
    if (const User* user = users->WithToken(token)) return Caller{user->name, user->right};
    return absl::UnauthenticatedError("The token is not one of this server's. It may have been replaced.");
  }
  if (const User* user = users->WithCertificate(certificate_names)) return Caller{user->name, user->right};
  if (!certificate_names.empty()) {
    return absl::UnauthenticatedError(
        "This server has no user with the name of the client certificate, and the call has no token "
        "(authorization: Bearer TOKEN).");
  }
  return absl::UnauthenticatedError("This server requires a token with every call (authorization: Bearer TOKEN).");
}

absl::Status Access::MayCall(std::string_view path, std::optional<std::string_view> authorization,
                             std::span<const std::string> certificate_names) const {
  if (users_ == nullptr) return absl::OkStatus();
  const std::optional<MethodRule> rule = RuleOf(path);
  if (rule && rule->right == Right::kNone) return absl::OkStatus();
  const absl::StatusOr<Caller> caller = Identify(authorization, certificate_names);
  absl::Status verdict = caller.status();
  if (caller.ok() && !rule) {
    // Before rights are checked, so that a newer client gets the same error as from a server without users.
    verdict = absl::UnimplementedError("This server does not offer that method.");
  } else if (caller.ok() && caller->right < rule->right) {
    verdict = absl::PermissionDeniedError(fmt::format("This needs the right \"{}\", and {} has the right \"{}\".",
                                                      RightName(rule->right), caller->user, RightName(caller->right)));
  }
  if (!verdict.ok()) {
    const std::string_view method = path.substr(path.rfind('/') + 1);
    Audit({.user = caller.ok() ? caller->user : "", .method = method, .object = "", .outcome = verdict.code()});
  }
  return verdict;
}

}  // namespace dlcs
