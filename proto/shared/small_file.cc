// SPDX-License-Identifier: Apache-2.0
#include "proto/shared/small_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "absl/strings/str_cat.h"
#include "proto/shared/byte_order_mark.h"

namespace dlcs {

absl::StatusOr<std::string> ReadSmallFile(const std::string& file) {
  constexpr std::size_t kMaxBytes = 1'000'000;
  const auto cannot_be_read = [&] {
    return absl::InvalidArgumentError(absl::StrCat(file, ": cannot be read: ", std::strerror(errno)));
  };
  const std::unique_ptr<std::FILE, decltype(&std::fclose)> stream(std::fopen(file.c_str(), "rbe"), &std::fclose);
  if (stream == nullptr) return cannot_be_read();
  std::string text(kMaxBytes + 1, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), stream.get()));
  if (std::ferror(stream.get()) != 0) return cannot_be_read();  // for example, a folder
  if (text.size() > kMaxBytes) {
    return absl::InvalidArgumentError(absl::StrCat(file, ": has more than ", kMaxBytes, " bytes; must have less"));
  }
  return std::string(WithoutByteOrderMark(text));
}

}  // namespace dlcs
