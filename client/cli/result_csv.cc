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

void PrintLine(double time, std::span<const double> x, std::span<const double> y, std::FILE* out) {
  fmt::memory_buffer line;
  fmt::format_to(std::back_inserter(line), "{}", time);
  AppendFields(x, line);
  AppendFields(y, line);
  line.push_back('\n');
  std::fwrite(line.data(), 1, line.size(), out);
}

}  // namespace

void PrintCsvHeader(std::size_t states, std::size_t constraints, std::FILE* out) {
  fmt::print(out, "t");
  for (std::size_t i = 1; i <= states; ++i) fmt::print(out, ",x{}", i);
  for (std::size_t i = 1; i <= constraints; ++i) fmt::print(out, ",y{}", i);
  fmt::print(out, "\n");
}

void PrintCsvLines(const v1::TrajectoryChunk& chunk, std::FILE* out) {
  const auto times = static_cast<std::size_t>(chunk.times_size());
  if (times == 0) return;
  const std::size_t states = static_cast<std::size_t>(chunk.x_size()) / times;
  const std::size_t constraints = static_cast<std::size_t>(chunk.y_size()) / times;
  for (std::size_t k = 0; k < times; ++k) {
    PrintLine(chunk.times(static_cast<int>(k)), {chunk.x().data() + k * states, states},
              {chunk.y().data() + k * constraints, constraints}, out);
  }
}

}  // namespace dlcs::client
