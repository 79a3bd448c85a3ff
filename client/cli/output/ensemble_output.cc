// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/ensemble_output.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "client/cli/terminal/columns.h"
#include "client/cli/terminal/words.h"
#include "client/cli/terminal/wrapped_text.h"
#include "client/result/names.h"

namespace dlcs::client {
namespace {

constexpr std::size_t kMaxValues = 12;
constexpr int kMaxMessages = 10;

// A column of texts, at the right edge as numbers are.
template <typename TextOf, typename Rows>
Column TextColumn(std::string title, const Rows& rows, const TextOf& text_of) {
  Column column{std::move(title), {}, 0};
  column.width = column.title.size();
  for (const auto& [member, row] : rows) {
    column.cells.push_back(text_of(member, row));
    column.width = std::max(column.width, column.cells.back().size());
  }
  return column;
}

std::string Size(double value) { return std::isnan(value) ? "-" : fmt::format("{:.1e}", value); }

}  // namespace

void EnsembleTable::Add(const MemberResult& member) {
  const SolveResult& result = member.result;
  names_ = result.names;
  Row row{.label = member.label,
          .success = Succeeded(result.summary),
          .verdict = VerdictName(result.summary),
          .message = result.summary.message(),
          .time = std::numeric_limits<double>::quiet_NaN(),
          .error = result.summary.accuracy().has_error() ? result.summary.accuracy().error()
                                                         : std::numeric_limits<double>::quiet_NaN(),
          .certificate = result.summary.certificate(),
          .measurements = {},
          .values = {}};
  if (measurement_names_.empty()) {
    for (const v1::MeasurementResult& one : result.summary.measurements()) measurement_names_.push_back(one.name());
  }
  for (const v1::MeasurementResult& one : result.summary.measurements()) {
    row.measurements.push_back(one.has_value() ? Cell(one.value()) : "none");
  }
  if (!result.times.empty()) {
    row.time = result.times.back();
    const std::size_t last = result.times.size() - 1;
    const auto values = result.has_outputs() ? result.outputs_at(last) : result.x_at(last);
    const auto shown = static_cast<std::ptrdiff_t>(std::min(values.size(), kMaxValues));
    row.values.assign(values.begin(), values.begin() + shown);
  }
  rows_.insert_or_assign(member.member, std::move(row));
}

void EnsembleTable::Print(const std::string& name, const v1::EnsembleSummary& summary, int width,
                          std::FILE* out) const {
  fmt::print(out, "{}: {}\n", name, CountText(summary));
  if (rows_.empty()) return;
  const auto any = [this](const auto& is) {
    return std::any_of(rows_.begin(), rows_.end(), [&](const auto& entry) { return is(entry.second); });
  };
  std::vector<Column> columns;
  columns.push_back(
      TextColumn("member", rows_, [](std::int64_t member, const Row&) { return fmt::format("{}", member); }));
  if (any([](const Row& row) { return !row.label.empty(); })) {
    columns.push_back(TextColumn("label", rows_, [](std::int64_t, const Row& row) { return row.label; }));
  }
  columns.push_back(TextColumn("", rows_, [](std::int64_t, const Row& row) { return row.verdict; }));
  columns.push_back(TextColumn("residual", rows_,
                               [](std::int64_t, const Row& row) { return Size(row.certificate.node_residual()); }));
  if (any([](const Row& row) { return !std::isnan(row.error); })) {
    columns.push_back(TextColumn("error", rows_, [](std::int64_t, const Row& row) { return Size(row.error); }));
  }
  columns.push_back(
      TextColumn("t", rows_, [](std::int64_t, const Row& row) { return std::isnan(row.time) ? "-" : Cell(row.time); }));
  for (std::size_t i = 0; i < measurement_names_.size(); ++i) {
    columns.push_back(TextColumn(measurement_names_[i], rows_, [i](std::int64_t, const Row& row) {
      return i < row.measurements.size() ? row.measurements[i] : "-";
    }));
  }
  std::size_t shown = 0;
  for (const auto& [member, row] : rows_) shown = std::max(shown, row.values.size());
  for (std::size_t i = 0; i < shown; ++i) {
    const bool is_state = names_.outputs.empty();
    const std::string title = ColumnName(is_state ? "x" : "output", is_state ? names_.OfX(i) : names_.outputs[i],
                                         {"member", "label", "residual", "error", "t"});
    columns.push_back(TextColumn(
        title, rows_, [i](std::int64_t, const Row& row) { return i < row.values.size() ? Cell(row.values[i]) : "-"; }));
  }
  PrintColumns(columns, rows_.size(), static_cast<std::size_t>(width), out);

  Paragraphs paper(width, out);
  int told = 0;
  for (const auto& [member, row] : rows_) {
    if (row.success || told == kMaxMessages) continue;
    if (told++ == 0) fmt::print(out, "\n");
    paper.Print(fmt::format("Member {}: ", member), row.message);
  }
  if (!summary.message().empty()) paper.Print("", summary.message());
  fmt::print(out, "\n{:.2g} s; set-ups: {} made, {} shared\n", summary.seconds(), summary.setup_misses(),
             summary.setup_hits());
}

std::string CountText(const v1::EnsembleSummary& summary) {
  std::vector<std::string> parts;
  const auto add = [&parts](std::int64_t count, const char* what) {
    if (count > 0) parts.push_back(fmt::format("{} {}", count, what));
  };
  add(summary.solved(), "solved");
  add(summary.reached(), "reached T");
  add(summary.failed(), "failed");
  add(summary.stopped(), "stopped");
  add(summary.not_begun(), "not begun");
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string CountText(const v1::EnsembleCounts& counts) {
  v1::EnsembleSummary summary;
  summary.set_solved(static_cast<std::int32_t>(counts.solved()));
  summary.set_reached(static_cast<std::int32_t>(counts.reached()));
  summary.set_failed(static_cast<std::int32_t>(counts.failed()));
  return CountText(summary);
}

std::int64_t Ended(const v1::EnsembleCounts& counts) { return counts.solved() + counts.reached() + counts.failed(); }

}  // namespace dlcs::client
