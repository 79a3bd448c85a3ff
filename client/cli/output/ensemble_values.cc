// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/ensemble_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <utility>

#include "client/cli/output/ensemble_output.h"
#include "client/cli/output/message_json.h"
#include "client/cli/output/result_output.h"
#include "client/cli/terminal/columns.h"
#include "client/cli/terminal/wrapped_text.h"
#include "client/result/display_names.h"

namespace dlcs::client {
namespace {

constexpr std::size_t kMaxFailuresShown = 10;

// What all columns of one component are called: "t", "vC", "w(D1)", "output2".
std::string NameOf(const v1::EnsembleColumn& column) {
  // Names from the problem where it has them.
  const auto i = static_cast<std::size_t>(column.component());
  const DisplayNames none;
  const std::string& own = column.name();
  switch (column.quantity()) {
    case v1::EnsembleColumn::QUANTITY_TIME:
      return "t";
    case v1::EnsembleColumn::QUANTITY_ERROR:
      return "error";
    case v1::EnsembleColumn::QUANTITY_X:
      return own.empty() ? none.OfX(i) : own;
    case v1::EnsembleColumn::QUANTITY_Y:
      return own.empty() ? none.OfY(i) : own;
    case v1::EnsembleColumn::QUANTITY_W:
      return own.empty() ? none.OfW(i) : fmt::format("w({})", own);
    default:
      return own.empty() ? fmt::format("output{}", i + 1) : own;
  }
}

const char* KindOf(const v1::EnsembleColumn& column) {
  switch (column.quantity()) {
    case v1::EnsembleColumn::QUANTITY_X:
      return "x";
    case v1::EnsembleColumn::QUANTITY_Y:
      return "y";
    case v1::EnsembleColumn::QUANTITY_W:
      return "w";
    default:
      return "output";
  }
}

std::string NameOfStatistic(v1::EnsembleColumn::Statistic statistic, const std::string& name) {
  switch (statistic) {
    case v1::EnsembleColumn::STATISTIC_SMALLEST:
      return fmt::format("min({})", name);
    case v1::EnsembleColumn::STATISTIC_LARGEST:
      return fmt::format("max({})", name);
    default:
      return name;
  }
}

// Gives every component a name of its own, and with it to its extrema.
class NameChooser {
 public:
  // `name` if neither it nor the names of its extrema are taken; else "output:name", or "output:name:2" and so on.
  std::string Choose(const std::string& name, const char* kind) {
    std::string chosen = name;
    for (int k = 1; !Take(chosen); ++k) {
      chosen = k == 1 ? fmt::format("{}:{}", kind, name) : fmt::format("{}:{}:{}", kind, name, k);
    }
    return chosen;
  }

 private:
  // The extrema are taken even where none are kept, so that names do not depend on it.
  bool Take(const std::string& name) {
    const std::array names = {name, NameOfStatistic(v1::EnsembleColumn::STATISTIC_SMALLEST, name),
                              NameOfStatistic(v1::EnsembleColumn::STATISTIC_LARGEST, name)};
    if (std::ranges::any_of(names, [this](const std::string& one) { return taken_.contains(one); })) return false;
    taken_.insert(names.begin(), names.end());
    return true;
  }

  std::set<std::string> taken_ = {"member", "outcome", "message"};  // of every line
};

// The quantile `share` of `sorted` values, which are not empty.
double Quantile(std::span<const double> sorted, double share) {
  const double place = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const double above = sorted[std::min(below + 1, sorted.size() - 1)];
  return sorted[below] + (place - static_cast<double>(below)) * (above - sorted[below]);
}

std::span<const double> RowOf(const v1::EnsembleShard& shard, int k) {
  const auto columns = static_cast<std::size_t>(shard.values_size() / std::max(shard.outcomes_size(), 1));
  return {shard.values().data() + static_cast<std::size_t>(k) * columns, columns};
}

}  // namespace

const char* OutcomeWord(v1::MemberOutcome outcome) {
  switch (outcome) {
    case v1::MEMBER_OUTCOME_SOLVED:
      return "solved";
    case v1::MEMBER_OUTCOME_REACHED:
      return "reached";
    case v1::MEMBER_OUTCOME_FAILED:
      return "failed";
    default:
      return "missing";
  }
}

std::vector<std::string> ColumnNames(const v1::EnsembleProgress& ensemble) {
  NameChooser chooser;
  std::vector<std::string> names;
  std::string name;  // of the component
  const v1::EnsembleColumn* before = nullptr;
  for (const v1::EnsembleColumn& column : ensemble.columns()) {
    const bool same = before != nullptr && before->quantity() == column.quantity() &&
                      before->component() == column.component() && before->statistic() != column.statistic();
    if (!same) name = chooser.Choose(NameOf(column), KindOf(column));
    names.push_back(NameOfStatistic(column.statistic(), name));
    before = &column;
  }
  return names;
}

void PrintShardCsvHeader(const v1::EnsembleProgress& ensemble, std::FILE* out) {
  fmt::print(out, "member,outcome");
  for (const std::string& name : ColumnNames(ensemble)) fmt::print(out, ",{}", CsvField(name));
  fmt::print(out, "\n");
}

void PrintShardCsvLines(const v1::EnsembleShard& shard, std::FILE* out) {
  for (int k = 0; k < shard.outcomes_size(); ++k) {
    fmt::memory_buffer line;
    fmt::format_to(std::back_inserter(line), "{},{}", shard.first_member() + k, OutcomeWord(shard.outcomes(k)));
    for (const double value : RowOf(shard, k)) {
      line.push_back(',');
      if (std::isfinite(value)) fmt::format_to(std::back_inserter(line), "{}", value);
    }
    line.push_back('\n');
    std::fwrite(line.data(), 1, line.size(), out);
  }
}

void PrintShardJsonLines(const v1::EnsembleProgress& ensemble, const v1::EnsembleShard& shard, std::FILE* out) {
  const std::vector<std::string> names = ColumnNames(ensemble);
  for (int k = 0; k < shard.outcomes_size(); ++k) {
    const std::span<const double> row = RowOf(shard, k);
    nlohmann::ordered_json member = {{"member", shard.first_member() + k}, {"outcome", OutcomeWord(shard.outcomes(k))}};
    const auto failure =
        std::ranges::find(shard.failures(), shard.first_member() + k, [](const auto& one) { return one.member(); });
    if (failure != shard.failures().end()) member["message"] = failure->message();
    for (std::size_t i = 0; i < std::min(row.size(), names.size()); ++i) member[names[i]] = row[i];  // NaN is null
    fmt::print(out, "{}\n", member.dump());
  }
}

EnsembleValues::EnsembleValues(v1::EnsembleProgress ensemble)
    : ensemble_(std::move(ensemble)),
      outcomes_(static_cast<std::size_t>(ensemble_.members())),
      values_(outcomes_.size() * columns(), std::numeric_limits<double>::quiet_NaN()) {}

void EnsembleValues::Add(const v1::EnsembleShard& shard) {
  for (int k = 0; k < shard.outcomes_size(); ++k) {
    const auto member = static_cast<std::size_t>(shard.first_member() + k);
    const std::span<const double> row = RowOf(shard, k);
    if (member >= outcomes_.size() || row.size() != columns()) continue;  // of no member that was announced
    outcomes_[member] = static_cast<double>(shard.outcomes(k));
    std::ranges::copy(row, values_.begin() + static_cast<std::ptrdiff_t>(member * columns()));
    counts_.set_solved(counts_.solved() + (shard.outcomes(k) == v1::MEMBER_OUTCOME_SOLVED));
    counts_.set_reached(counts_.reached() + (shard.outcomes(k) == v1::MEMBER_OUTCOME_REACHED));
    counts_.set_failed(counts_.failed() + (shard.outcomes(k) == v1::MEMBER_OUTCOME_FAILED));
  }
  failures_.insert(failures_.end(), shard.failures().begin(), shard.failures().end());
}

void EnsembleValues::PrintTable(const std::string& title, int width, std::FILE* out) const {
  const std::int64_t ended = Ended(counts_);
  const std::string missing =
      ended < ensemble_.members() ? fmt::format(", {} missing", ensemble_.members() - ended) : "";
  fmt::print(out, "{}: {}{}\n", title, ended > 0 ? CountText(counts_) : "no results", missing);
  const std::vector<std::string> names = ColumnNames(ensemble_);
  std::vector<Column> table = {{"", {}},     {"min", {}}, {"5 %", {}}, {"median", {}},
                               {"95 %", {}}, {"max", {}}, {"mean", {}}};
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::vector<double> sorted;
    double sum = 0;
    for (std::size_t member = 0; member < outcomes_.size(); ++member) {
      const double value = values_[member * columns() + i];
      if (std::isnan(value)) continue;
      sorted.push_back(value);
      sum += value;
    }
    if (sorted.empty()) continue;
    std::ranges::sort(sorted);
    const std::vector<std::string> cells = {names[i],
                                            Cell(sorted.front()),
                                            Cell(Quantile(sorted, 0.05)),
                                            Cell(Quantile(sorted, 0.5)),
                                            Cell(Quantile(sorted, 0.95)),
                                            Cell(sorted.back()),
                                            Cell(sum / static_cast<double>(sorted.size()))};
    for (std::size_t k = 0; k < cells.size(); ++k) table[k].cells.push_back(cells[k]);
  }
  for (Column& column : table) {
    column.width = column.title.size();
    for (const std::string& cell : column.cells) column.width = std::max(column.width, cell.size());
  }
  const std::size_t rows = table.front().cells.size();
  if (rows > 0) PrintColumns(table, rows, static_cast<std::size_t>(width), out);

  std::vector<v1::MemberFailure> failures = failures_;
  std::ranges::sort(failures, {}, [](const v1::MemberFailure& failure) { return failure.member(); });
  failures.resize(std::min(failures.size(), kMaxFailuresShown));
  Paragraphs paper(width, out);
  if (!failures.empty()) fmt::print(out, "\n");
  for (const v1::MemberFailure& failure : failures) {
    paper.Print(fmt::format("Member {}: ", failure.member()), failure.message());
  }
  const std::int64_t not_shown = counts_.failed() - static_cast<std::int64_t>(failures.size());
  if (not_shown > 0) fmt::print(out, "and {} more failed\n", not_shown);
}

ResultArrays EnsembleValues::Arrays(const v1::SolveJob& job) const {
  ResultArrays all;
  all.arrays.push_back({.name = "outcomes", .values = outcomes_, .rows = outcomes_.size(), .is_list = true});
  all.arrays.push_back({.name = "values", .values = values_, .rows = outcomes_.size(), .columns = columns()});
  all.names.push_back({"columns", ColumnNames(ensemble_)});
  all.summary = JsonLine(job);
  return all;
}

}  // namespace dlcs::client
