// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <vector>

#include "client/cli/output/columns.h"
#include "client/cli/output/lcp_output.h"
#include "client/result/names.h"

namespace dlcs::client {
namespace {

// Rows of the table.
constexpr std::size_t kRows = 11;

// Nodes to show: those nearest to even times, and both sides of a jump that is among them.
std::vector<int> RowsOf(const v1::PiecewiseLinearPath& v) {
  std::vector<int> rows;
  const auto& times = v.times();
  for (std::size_t k = 0; k < kRows; ++k) {
    const double t = times[times.size() - 1] * static_cast<double>(k) / (kRows - 1);
    auto node = std::lower_bound(times.begin(), times.end(), t);
    if (node == times.end()) --node;
    if (node != times.begin() && t - *(node - 1) < *node - t) --node;
    const int row = static_cast<int>(node - times.begin());
    if (row > 0 && times[row - 1] == times[row]) rows.push_back(row - 1);
    rows.push_back(row);
    if (row + 1 < times.size() && times[row + 1] == times[row]) rows.push_back(row + 1);
  }
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  return rows;
}

void PrintPath(const v1::PiecewiseLinearPath& v, int width, std::FILE* out) {
  if (v.times().empty()) return;
  const std::vector<int> rows = RowsOf(v);
  const int size = v.values_size() / v.times_size();
  std::vector<Column> columns;
  columns.push_back(MakeColumn("t", rows.size(), [&](std::size_t k) { return v.times(rows[k]); }));
  for (int i = 0; i < size; ++i) {
    columns.push_back(MakeColumn(fmt::format("v{}", i + 1), rows.size(),
                                 [&](std::size_t k) { return v.values(rows[k] * size + i); }));
  }
  PrintColumns(columns, rows.size(), static_cast<std::size_t>(width), out);
}

}  // namespace

void PrintDcpTable(const v1::SolveDcpResponse& response, bool measured, int width, std::FILE* out) {
  if (!measured) fmt::print(out, "{}: {}\n", response.solved() ? "SOLVED" : "NOT SOLVED", response.message());
  if (!measured) PrintPath(response.v(), width, out);
  if (measured || response.solved()) {
    const v1::DcpCertificate& c = response.certificate();
    fmt::print(out, "{}Certificate\n", measured ? "" : "\n");
    fmt::print(out, "  v starts at 0             off by {:.1e}\n", c.start());
    fmt::print(out, "  v does not decrease       least increase {:.1e}\n", c.least_increase());
    fmt::print(out, "  w = q + M v >= 0          least w {:.1e}\n", c.least_w());
    fmt::print(out, "  integral of w_i dv_i = 0  largest {:.1e}\n", c.complementarity());
  }
  const v1::Finding& unique = response.unique();
  fmt::print(out, "\nOne solution for every q with q(0) >= 0: {} ({})\n", Word(unique.answer()),
             unique.why());
}

}  // namespace dlcs::client
