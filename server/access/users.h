// SPDX-License-Identifier: Apache-2.0
// The users of a server, from its tokens file.

#ifndef DLCS_SERVER_ACCESS_USERS_H_
#define DLCS_SERVER_ACCESS_USERS_H_

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "server/access/permissions.h"

namespace dlcs {

struct User {
  std::string name;
  Right right = Right::kReader;
};

// Whether `text` is a valid user name: 1 to 128 letters, digits or . _ @ : / + -.
bool IsUserName(std::string_view text);

// Each user has one or more lines in the file:
//
//     NAME RIGHT sha256:HASH      who has the token with this hash (dlcsd token makes both)
//     NAME RIGHT certificate      who has a client certificate for this name, as its common name or an alternative name
//
// RIGHT is reader, submitter or admin. A name may have several lines with the same right, so that an old token works
// until all clients have the new one. # begins a comment.
class Users {
 public:
  // `file` is for messages. Errors: InvalidArgument with file, line and rule, but never with a secret.
  static absl::StatusOr<Users> Parse(std::string_view text, const std::string& file);
  // Reads and parses the file.
  static absl::StatusOr<Users> Read(const std::string& file);

  // Null if no user has this token. Takes the same time for all tokens.
  const User* WithToken(std::string_view token) const;
  // The first user with a certificate for one of `names`; null if there is none.
  const User* WithCertificate(std::span<const std::string> names) const;

  std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    User user;
    std::string hash;  // empty: by certificate
  };
  static absl::StatusOr<Entry> ParseLine(const std::vector<std::string_view>& words);
  // Errors: InvalidArgument if it contradicts an existing entry.
  absl::Status Add(Entry entry);

  std::vector<Entry> entries_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_ACCESS_USERS_H_
