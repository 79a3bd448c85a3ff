// SPDX-License-Identifier: Apache-2.0
// Who may call, and what: users with their rights, known by a token or by a certificate.

#ifndef DLCS_SERVER_ACCESS_ACCESS_H_
#define DLCS_SERVER_ACCESS_ACCESS_H_

#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/access/access_settings.h"
#include "server/access/forwarded_caller.h"
#include "server/access/permissions.h"
#include "server/access/tls_files.h"
#include "server/access/users.h"
#include "server/access/watched_file.h"

namespace dlcs {

// Who calls.
struct Caller {
  std::string user;  // empty if the server has no users
  Right right = Right::kAdmin;
  std::string peer = {};  // address, as gRPC writes it: "ipv4:10.0.0.7:40312"

  // The user whose jobs the caller may see; absent: all users.
  std::optional<std::string> SeesJobsOf() const { return right == Right::kAdmin ? std::nullopt : std::optional(user); }
};

// Safe from any thread.
class Access {
 public:
  // Reads the files of the valid `settings`. A thread checks every second whether a file has changed. Errors:
  // InvalidArgument with flag, file and rule.
  static absl::StatusOr<std::unique_ptr<Access>> Open(const AccessSettings& settings);

  // Checks the files of `settings` as Open() does, without keeping or starting anything.
  static absl::Status Check(const AccessSettings& settings);

  // Whether callers must authenticate. If not, every caller is an admin without a name.
  bool HasUsers() const { return users_ != nullptr; }
  // The certificate and key for TLS; null if connections are not encrypted.
  std::shared_ptr<const TlsFiles> Tls() const { return tls_ ? tls_->get() : nullptr; }

  // The caller, identified by `authorization`, the value of that header if it was sent, or else by a certificate for
  // one of `certificate_names`. Errors: Unauthenticated, with what is expected.
  absl::StatusOr<Caller> Identify(std::optional<std::string_view> authorization,
                                  std::span<const std::string> certificate_names) const;

  // OK if the caller may call the method at `path`; a refused call is logged (audit.h). Other arguments as above.
  // Errors: Unauthenticated; PermissionDenied, with the right that is missing; Unimplemented for a method that has no
  // rule.
  absl::Status MayCall(std::string_view path, std::optional<std::string_view> authorization,
                       std::span<const std::string> certificate_names) const;

  // Checks for changed files now.
  void Refresh();

  // The key of calls that this process forwards to itself.
  const ForwardingKey& forwarding_key() const { return forwarding_key_; }

 private:
  Access() = default;

  const ForwardingKey forwarding_key_;
  std::unique_ptr<WatchedFile<Users>> users_;   // null: everybody may do everything
  std::unique_ptr<WatchedFile<TlsFiles>> tls_;  // null: no encryption
  std::mutex refreshing_;
  std::jthread refresher_;  // last: it uses the others
};

}  // namespace dlcs

#endif  // DLCS_SERVER_ACCESS_ACCESS_H_
