// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <span>

#include "client/cli/result_output.h"

namespace dlcs::client {
namespace {

void AppendFields(std::span<const double> numbers, fmt::memory_buffer& line) {
  for (const double number : numbers) {
    line.push_back(',');
    if (std::isfinite(number)) fmt::format_to(std::back_inserter(line), "{}", number);
  }
}

}  // namespace

void PrintCsv(const SolveResult& result, std::FILE* out) {
  fmt::print(out, "t");
  for (std::size_t i = 1; i <= result.states; ++i) fmt::print(out, ",x{}", i);
  for (std::size_t i = 1; i <= result.constraints; ++i) fmt::print(out, ",y{}", i);
  fmt::print(out, "\n");
  for (std::size_t k = 0; k < result.times.size(); ++k) {
    fmt::memory_buffer line;
    fmt::format_to(std::back_inserter(line), "{}", result.times[k]);
    AppendFields(result.x_at(k), line);
    AppendFields(result.y_at(k), line);
    line.push_back('\n');
    std::fwrite(line.data(), 1, line.size(), out);
  }
}

}  // namespace dlcs::client
