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

// What may stand as a name in the file: 1 to 128 letters, digits or . _ @ : / + -.
bool IsUserName(std::string_view text);

// A line of the file for each:
//
//     NAME RIGHT sha256:HASH      who has the token with this hash (dlcsd token makes both)
//     NAME RIGHT certificate      who has a client certificate for this name, as its common name or an alternative name
//
// RIGHT is reader, submitter or admin. A name may stand on several lines, with the same right, so that an old token
// works until all know the new one. # begins a comment.
class Users {
 public:
  // `file` for messages. Errors: InvalidArgument with file, line and rule, never with what should be secret.
  static absl::StatusOr<Users> Parse(std::string_view text, const std::string& file);
  // The same from the file itself.
  static absl::StatusOr<Users> Read(const std::string& file);

  // Null for a token that nobody has. Takes the same time for all tokens.
  const User* WithToken(std::string_view token) const;
  // The first user who is known by a certificate for one of `names`; null where there is none.
  const User* WithCertificate(std::span<const std::string> names) const;

  std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    User user;
    std::string hash;  // empty: by certificate
  };
  static absl::StatusOr<Entry> ParseLine(const std::vector<std::string_view>& words);
  // Errors: InvalidArgument when it contradicts one that is there.
  absl::Status Add(Entry entry);

  std::vector<Entry> entries_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_ACCESS_USERS_H_
