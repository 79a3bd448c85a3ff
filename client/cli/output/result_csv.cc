// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <initializer_list>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/output/ensemble_output.h"
#include "client/cli/output/result_output.h"

namespace dlcs::client {
namespace {

void AppendFields(std::span<const double> numbers, fmt::memory_buffer& line) {
  for (const double number : numbers) {
    line.push_back(',');
    if (std::isfinite(number)) fmt::format_to(std::back_inserter(line), "{}", number);
  }
}

void PrintLine(std::string_view begin, double time, std::initializer_list<std::span<const double>> parts,
               std::FILE* out) {
  fmt::memory_buffer line;
  fmt::format_to(std::back_inserter(line), "{}{}", begin, time);
  for (const std::span<const double> part : parts) AppendFields(part, line);
  line.push_back('\n');
  std::fwrite(line.data(), 1, line.size(), out);
}

}  // namespace

std::string CsvField(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

namespace {

// `first`: the columns before those of the components.
void PrintHeader(std::initializer_list<std::string_view> first, const DisplayNames& names, std::size_t states,
                 std::size_t constraints, bool has_w, std::FILE* out) {
  fmt::print(out, "{}", fmt::join(first, ","));
  const auto add = [&](const char* kind, const std::string& name) {
    fmt::print(out, ",{}", CsvField(ColumnName(kind, name, first)));
  };
  for (const std::string& name : names.outputs) add("output", name);
  if (!names.outputs.empty()) states = constraints = 0;
  for (std::size_t i = 0; i < states; ++i) add("x", names.OfX(i));
  for (std::size_t i = 0; i < constraints; ++i) add("y", names.OfY(i));
  for (std::size_t i = 0; has_w && i < constraints; ++i) add("w", names.OfW(i));
  fmt::print(out, "\n");
}

}  // namespace

void PrintCsvHeader(const DisplayNames& names, std::size_t states, std::size_t constraints, bool has_w,
                    std::FILE* out) {
  PrintHeader({"t"}, names, states, constraints, has_w, out);
}

void PrintCsvLines(const v1::TrajectoryChunk& chunk, std::FILE* out) {
  const auto times = static_cast<std::size_t>(chunk.times_size());
  if (times == 0) return;
  const auto at = [times](const google::protobuf::RepeatedField<double>& values, std::size_t k) {
    const std::size_t size = static_cast<std::size_t>(values.size()) / times;
    return std::span(values.data() + k * size, size);
  };
  for (std::size_t k = 0; k < times; ++k) {
    const double time = chunk.times(static_cast<int>(k));
    if (!chunk.outputs().empty()) {
      PrintLine("", time, {at(chunk.outputs(), k)}, out);
    } else {
      PrintLine("", time, {at(chunk.x(), k), at(chunk.y(), k), at(chunk.w(), k)}, out);
    }
  }
}

void PrintCsv(const SolveResult& result, std::FILE* out) {
  PrintCsvHeader(result.names, result.states, result.constraints, result.times.empty() || result.has_w(), out);
  for (std::size_t k = 0; k < result.times.size(); ++k) {
    if (result.has_outputs()) {
      PrintLine("", result.times[k], {result.outputs_at(k)}, out);
    } else {
      PrintLine("", result.times[k], {result.x_at(k), result.y_at(k), result.w_at(k)}, out);
    }
  }
}

void PrintMemberCsvHeader(const DisplayNames& names, std::size_t states, std::size_t constraints, std::FILE* out) {
  PrintHeader({"member", "label", "t"}, names, states, constraints, /*has_w=*/true, out);
}

void PrintMemberCsvLines(const MemberResult& member, std::FILE* out) {
  const SolveResult& result = member.result;
  const std::string begin = fmt::format("{},{},", member.member, CsvField(member.label));
  const std::vector<double> unknown(result.constraints, std::numeric_limits<double>::quiet_NaN());
  for (std::size_t k = 0; k < result.times.size(); ++k) {
    if (result.has_outputs()) {
      PrintLine(begin, result.times[k], {result.outputs_at(k)}, out);
      continue;
    }
    PrintLine(begin, result.times[k], {result.x_at(k), result.y_at(k), result.has_w() ? result.w_at(k) : unknown}, out);
  }
}

}  // namespace dlcs::client
