// SPDX-License-Identifier: Apache-2.0
#include "client/files/npz_file.h"

#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <set>
#include <string>

#include "client/files/npy_array.h"
#include "proto/shared/truncate_text.h"

namespace dlcs::client {
namespace {

constexpr std::string_view kMemberEnding = ".npy";
// A directory of this many takes some megabytes.
constexpr std::int64_t kMaxMembers = 10'000;

using ZipArchive = std::unique_ptr<zip_t, decltype(&zip_discard)>;

absl::StatusOr<ZipArchive> OpenZip(std::string_view bytes) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), /*freep=*/0, &error);
  zip_t* archive = source != nullptr ? zip_open_from_source(source, ZIP_RDONLY, &error) : nullptr;
  if (archive == nullptr) {
    const std::string reason = zip_error_strerror(&error);
    if (source != nullptr) zip_source_free(source);
    zip_error_fini(&error);
    return absl::InvalidArgumentError(fmt::format("cannot be read as a zip archive: {}", reason));
  }
  zip_error_fini(&error);
  return ZipArchive(archive, zip_discard);
}

// The unpacked content of a member.
absl::StatusOr<std::string> ReadMember(zip_t* archive, zip_uint64_t index, ReadingBudget& budget) {
  zip_stat_t about;
  if (zip_stat_index(archive, index, 0, &about) != 0 || (about.valid & ZIP_STAT_SIZE) == 0) {
    return absl::InvalidArgumentError(fmt::format("cannot be unpacked: {}", zip_strerror(archive)));
  }
  if (const absl::Status taken = budget.Take(about.size); !taken.ok()) return taken;
  const std::unique_ptr<zip_file_t, decltype(&zip_fclose)> file(zip_fopen_index(archive, index, 0), zip_fclose);
  if (file == nullptr) {
    return absl::InvalidArgumentError(fmt::format("cannot be unpacked: {}", zip_strerror(archive)));
  }
  std::string content;
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  std::string block(std::min<std::size_t>(about.size + 1, kBlock), '\0');
  // It may unpack to more or less than its directory declares; the sum of the archive is checked at the end.
  for (;;) {
    const zip_int64_t count = zip_fread(file.get(), block.data(), block.size());
    if (count < 0) {
      return absl::InvalidArgumentError(fmt::format("cannot be unpacked: {}", zip_file_strerror(file.get())));
    }
    if (count == 0) break;
    content.append(block.data(), static_cast<std::size_t>(count));
    if (content.size() > about.size) break;
  }
  if (content.size() != about.size) {
    return absl::InvalidArgumentError(
        fmt::format("is damaged: it does not unpack to the {} bytes that the archive declares", about.size));
  }
  return content;
}

}  // namespace

absl::StatusOr<StoredVariables> ParseNpz(std::string_view bytes, const Wanted& wanted, ReadingBudget& budget) {
  const absl::StatusOr<ZipArchive> archive = OpenZip(bytes);
  if (!archive.ok()) return archive.status();
  const zip_int64_t members = zip_get_num_entries(archive->get(), 0);
  if (members > kMaxMembers) {
    return absl::ResourceExhaustedError(fmt::format("has {} members; must have at most {}", members, kMaxMembers));
  }
  StoredVariables variables;
  std::set<std::string> seen;
  for (zip_int64_t index = 0; index < members; ++index) {
    const char* const member = zip_get_name(archive->get(), static_cast<zip_uint64_t>(index), 0);
    std::string name = member != nullptr ? member : "";
    const bool is_array = name.ends_with(kMemberEnding);
    if (is_array) name.resize(name.size() - kMemberEnding.size());
    if (!seen.insert(name).second) {
      return absl::InvalidArgumentError(
          fmt::format("holds \"{}\" twice; names must be unique", TruncateUtf8(name, 40)));
    }
    variables.names.push_back(name);
    if (!wanted(name)) continue;
    if (!is_array) {
      variables.arrays.emplace(name, absl::InvalidArgumentError("is not a NumPy array; must be a member NAME.npy"));
      continue;
    }
    const auto content = ReadMember(archive->get(), static_cast<zip_uint64_t>(index), budget);
    variables.arrays.emplace(name, content.ok() ? ParseNpy(*content, budget) : content.status());
  }
  return variables;
}

}  // namespace dlcs::client
