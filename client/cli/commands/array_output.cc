// SPDX-License-Identifier: Apache-2.0
#include "client/cli/commands/array_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <string_view>
#include <utility>

namespace dlcs::client {

bool IsOfArrays(OutputFormat format) { return format >= OutputFormat::kNpy; }

std::optional<NamedFormat> FormatByEnding(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array<std::pair<std::string_view, NamedFormat>, 8> kEndings = {{
      {".csv", {"csv", OutputFormat::kCsv}},
      {".json", {"json", OutputFormat::kJson}},
      {".npy", {"npy", OutputFormat::kNpy}},
      {".npz", {"npz", OutputFormat::kNpz}},
      {".h5", {"hdf5", OutputFormat::kHdf5}},
      {".hdf5", {"hdf5", OutputFormat::kHdf5}},
      {".mat", {"mat", OutputFormat::kMat}},
      {".raw", {"raw", OutputFormat::kRaw}},
  }};
  for (const auto& [known, format] : kEndings) {
    if (ending == known) return format;
  }
  return std::nullopt;
}

absl::Status WriteArrays(OutputFormat format, const std::string& title, const SolveResult& result, std::FILE* out) {
  switch (format) {
    case OutputFormat::kNpy:
      return WriteNpy(result, out);
    case OutputFormat::kRaw:
      return WriteRaw(title, result, out);
    default:
      return WriteArrays(format, ArraysOf(title, result), out);
  }
}

absl::Status WriteArrays(OutputFormat format, const ResultArrays& all, std::FILE* out) {
  switch (format) {
    case OutputFormat::kNpz:
      return WriteNpz(all, out);
    case OutputFormat::kHdf5:
      return WriteHdf5(all, out);
    case OutputFormat::kMat:
      return WriteMat(all, out);
    case OutputFormat::kNpy:
    case OutputFormat::kRaw:
    case OutputFormat::kTable:
    case OutputFormat::kJson:
    case OutputFormat::kCsv:
    case OutputFormat::kName:
      break;
  }
  return absl::InternalError("is not an array format");
}

absl::Status WithFile(const absl::Status& error, const std::string& path) {
  return absl::Status(error.code(), fmt::format("cannot write {}: {}", path, std::string(error.message())));
}

}  // namespace dlcs::client
