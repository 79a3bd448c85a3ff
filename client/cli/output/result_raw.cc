// SPDX-License-Identifier: Apache-2.0
// The raw file of SPICE, in binary, as ngspice writes and loads it: a header of lines, then the numbers time by time.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>

#include "client/cli/output/result_arrays.h"

namespace dlcs::client {
namespace {

// One line, without control characters.
std::string Line(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  return text;
}

// Blanks end a name.
std::string OneWord(std::string name) {
  name = Line(std::move(name));
  std::ranges::replace(name, ' ', '_');
  return name;
}

std::string_view TypeOf(std::string_view name) {
  const auto begins = [name](char letter) {
    return name.size() > 2 && std::tolower(static_cast<unsigned char>(name[0])) == letter && name[1] == '(';
  };
  return begins('v') ? "voltage" : begins('i') ? "current" : "notype";
}

std::vector<std::string> ColumnNames(const SolveResult& result) {
  if (result.has_outputs()) return result.names.outputs;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < result.states; ++i) names.push_back(result.names.OfX(i));
  for (std::size_t i = 0; i < result.constraints; ++i) names.push_back(result.names.OfY(i));
  for (std::size_t i = 0; i < result.constraints && ShowsW(result); ++i) names.push_back(result.names.OfW(i));
  return names;
}

}  // namespace

absl::Status WriteRaw(const std::string& title, const SolveResult& result, std::FILE* out) {
  const std::vector<std::string> names = ColumnNames(result);
  fmt::print(out,
             "Title: {}\nPlotname: Transient Analysis\nFlags: real\nNo. Variables: {}\nNo. Points: {}\nVariables:\n",
             Line(title), 1 + names.size(), result.times.size());
  fmt::print(out, "\t0\ttime\ttime\n");
  for (std::size_t i = 0; i < names.size(); ++i) {
    fmt::print(out, "\t{}\t{}\t{}\n", i + 1, OneWord(names[i]), TypeOf(names[i]));
  }
  fmt::print(out, "Binary:\n");
  const auto write = [out](std::span<const double> numbers) {
    std::fwrite(numbers.data(), sizeof(double), numbers.size(), out);
  };
  for (std::size_t k = 0; k < result.times.size() && std::ferror(out) == 0; ++k) {
    write({&result.times[k], 1});
    if (result.has_outputs()) {
      write(result.outputs_at(k));
      continue;
    }
    write(result.x_at(k));
    write(result.y_at(k));
    write(result.w_at(k));
  }
  return absl::OkStatus();  // errors of `out` are reported when it is flushed
}

}  // namespace dlcs::client
