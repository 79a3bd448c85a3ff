// SPDX-License-Identifier: Apache-2.0
#include "server/access/token_command.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "fmt/format.h"
#include "server/access/token.h"
#include "server/access/users.h"

namespace dlcs {
namespace {

// Readable by its owner only. Never replaces a file: it may be the only copy of another token.
absl::Status Save(const std::string& token, const std::string& file) {
  const auto failed = [&] {
    return absl::InvalidArgumentError(
        fmt::format("--save {}: cannot be created: {}{}", file, std::strerror(errno),
                    errno == EEXIST ? "; it may hold another token: choose another name" : ""));
  };
  const int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (descriptor < 0) return failed();
  const std::string line = token + "\n";
  const bool written = write(descriptor, line.data(), line.size()) == static_cast<ssize_t>(line.size());
  if (close(descriptor) != 0 || !written) return failed();
  return absl::OkStatus();
}

}  // namespace

absl::Status MakeToken(const TokenRequest& wanted) {
  if (!IsUserName(wanted.user)) {
    return absl::InvalidArgumentError(
        fmt::format("NAME \"{}\": must be 1 to 128 letters, digits or . _ @ : / + -", wanted.user));
  }
  if (!RightNamed(wanted.right)) {
    return absl::InvalidArgumentError(fmt::format("--right {}: must be reader, submitter or admin", wanted.right));
  }
  const std::string token = RandomToken();
  const std::string line = fmt::format("{} {} {}\n", wanted.user, wanted.right, TokenHashText(token));
  if (wanted.save.empty()) {
    fmt::print(stderr, "The token of {}, shown only once: {}\n", wanted.user, token);
  } else if (absl::Status saved = Save(token, wanted.save); !saved.ok()) {
    return saved;
  }
  fmt::print("{}", line);
  return absl::OkStatus();
}

}  // namespace dlcs
