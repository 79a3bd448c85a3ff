// SPDX-License-Identifier: Apache-2.0
#include "server/access/users.h"

#include <openssl/crypto.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "fmt/format.h"
#include "proto/shared/small_file.h"
#include "server/access/token.h"

namespace dlcs {
namespace {

constexpr std::string_view kHashPrefix = "sha256:";
constexpr std::size_t kHashBytes = 32;
constexpr std::size_t kMaxNameBytes = 128;

std::optional<std::string> FromHex(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  if (text.size() != 2 * kHashBytes || text.find_first_not_of(kDigits) != std::string_view::npos) return std::nullopt;
  std::string bytes;
  for (std::size_t k = 0; k < text.size(); k += 2) {
    bytes += static_cast<char>(16 * kDigits.find(text[k]) + kDigits.find(text[k + 1]));
  }
  return bytes;
}

std::vector<std::string_view> WordsOf(std::string_view line) {
  constexpr std::string_view kBlanks = " \t\r";
  std::vector<std::string_view> words;
  line = line.substr(0, line.find('#'));
  for (std::size_t begin = 0; (begin = line.find_first_not_of(kBlanks, begin)) != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBlanks, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    begin = end;
  }
  return words;
}

}  // namespace

bool IsUserName(std::string_view text) {
  constexpr std::string_view kAllowed = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._@:/+-";
  return !text.empty() && text.size() <= kMaxNameBytes && text.find_first_not_of(kAllowed) == std::string_view::npos;
}

absl::StatusOr<Users::Entry> Users::ParseLine(const std::vector<std::string_view>& words) {
  // Messages do not repeat words of the line, which may be a token in the wrong place.
  if (words.size() != 3) {
    return absl::InvalidArgumentError(
        fmt::format("has {} words; must be NAME RIGHT sha256:HASH, or NAME RIGHT certificate", words.size()));
  }
  Entry entry;
  if (!IsUserName(words[0])) {
    return absl::InvalidArgumentError("the name must be 1 to 128 letters, digits or . _ @ : / + -");
  }
  entry.user.name = words[0];
  const std::optional<Right> right = RightNamed(words[1]);
  if (!right) return absl::InvalidArgumentError("the right must be reader, submitter or admin");
  entry.user.right = *right;
  if (words[2] == "certificate") return entry;
  const std::optional<std::string> hash =
      words[2].starts_with(kHashPrefix) ? FromHex(words[2].substr(kHashPrefix.size())) : std::nullopt;
  if (!hash) {
    return absl::InvalidArgumentError(
        "the third word must be sha256: and 64 hexadecimal digits in lower case, as dlcsd token prints them, or "
        "certificate");
  }
  entry.hash = *hash;
  return entry;
}

absl::Status Users::Add(Entry entry) {
  for (const Entry& earlier : entries_) {
    if (earlier.user.name == entry.user.name && earlier.user.right != entry.user.right) {
      return absl::InvalidArgumentError(
          fmt::format("{} has the right {} on an earlier line, and {} here; must be the same", entry.user.name,
                      RightName(earlier.user.right), RightName(entry.user.right)));
    }
    if (!entry.hash.empty() && earlier.hash == entry.hash) {
      return absl::InvalidArgumentError(fmt::format(
          "has the same hash as an earlier line, of {}; every token must belong to one user", earlier.user.name));
    }
  }
  entries_.push_back(std::move(entry));
  return absl::OkStatus();
}

absl::StatusOr<Users> Users::Parse(std::string_view text, const std::string& file) {
  Users users;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::vector<std::string_view> words = WordsOf(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (words.empty()) continue;
    absl::StatusOr<Entry> entry = ParseLine(words);
    const absl::Status added = entry.ok() ? users.Add(*std::move(entry)) : entry.status();
    if (!added.ok()) {
      return absl::InvalidArgumentError(fmt::format("{}:{}: {}", file, number, std::string(added.message())));
    }
  }
  // A file that is being written is empty for a moment; that must not lock out all users.
  if (users.entries_.empty()) return absl::InvalidArgumentError(fmt::format("{}: must hold at least one user", file));
  return users;
}

absl::StatusOr<Users> Users::Read(const std::string& file) {
  const absl::StatusOr<std::string> text = ReadSmallFile(file);
  if (!text.ok()) return text.status();
  return Parse(*text, file);
}

const User* Users::WithToken(std::string_view token) const {
  const std::string hash = TokenHash(token);
  const User* found = nullptr;
  for (const Entry& entry : entries_) {
    const bool same =
        entry.hash.size() == hash.size() && CRYPTO_memcmp(entry.hash.data(), hash.data(), hash.size()) == 0;
    if (same) found = &entry.user;
  }
  return found;
}

const User* Users::WithCertificate(std::span<const std::string> names) const {
  for (const Entry& entry : entries_) {
    if (entry.hash.empty() && std::find(names.begin(), names.end(), entry.user.name) != names.end()) return &entry.user;
  }
  return nullptr;
}

}  // namespace dlcs
