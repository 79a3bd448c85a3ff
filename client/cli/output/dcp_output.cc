// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <vector>

#include "client/cli/output/lcp_output.h"
#include "client/cli/terminal/columns.h"
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

double Largest(const v1::PiecewiseLinearPath& path) {
  double largest = 0;
  for (const double value : path.values()) largest = std::max(largest, std::abs(value));
  return largest;
}

// The largest sum of absolute values of a row.
double RowNorm(const v1::Matrix& m) {
  const v1::DenseMatrix& dense = m.dense();
  const v1::SparseMatrix& sparse = m.sparse();
  std::vector<double> sums(static_cast<std::size_t>(std::max({dense.rows(), sparse.rows(), 1})));
  for (int k = 0; k < dense.values_size(); ++k)
    sums[static_cast<std::size_t>(k / dense.columns())] += std::abs(dense.values(k));
  for (int k = 0; k < sparse.values_size(); ++k)
    sums[static_cast<std::size_t>(sparse.row_indices(k))] += std::abs(sparse.values(k));
  return *std::max_element(sums.begin(), sums.end());
}

struct Defect {
  std::string_view name;
  double value, size, allowed;
  double relative() const { return value > 0 ? value / size : 0; }
};

}  // namespace

DcpVerdict VerdictOf(const v1::SolveDcpRequest& request, const v1::SolveDcpResponse& response) {
  if (!request.has_check()) return {response.solved(), response.message()};
  const double v = Largest(request.check());
  const double w = Largest(request.q()) + RowNorm(request.m()) * v;
  const v1::DcpCertificate& c = response.certificate();
  double largest = 0;
  for (const Defect& defect :
       {Defect{"v(0) is off by", c.start(), v, 1e-6}, Defect{"v decreases by", -c.least_increase(), v, 1e-6},
        Defect{"w goes below 0 by", -c.least_w(), w, 1e-6},
        Defect{"an integral of w_i dv_i is", c.complementarity(), v * w, 0.01}}) {
    if (!(defect.relative() <= defect.allowed)) {
      return {false, fmt::format("the path is not a solution: {} {:.2g}, {:.2g} of its size; at most {:g} is allowed",
                                 defect.name, defect.value, defect.relative(), defect.allowed)};
    }
    largest = std::max(largest, defect.relative());
  }
  return {true, fmt::format("the path is a solution, off by at most {:.1e} of its size", largest)};
}

void PrintDcpTable(const v1::SolveDcpResponse& response, const DcpVerdict& verdict, int width, std::FILE* out) {
  fmt::print(out, "{}: {}\n", verdict.solved ? "SOLVED" : "NOT SOLVED", verdict.message);
  PrintPath(response.v(), width, out);
  if (response.solved() || response.v().times().empty()) {
    const v1::DcpCertificate& c = response.certificate();
    fmt::print(out, "\nCertificate\n");
    fmt::print(out, "  v starts at 0             off by {:.1e}\n", c.start());
    fmt::print(out, "  v does not decrease       least increase {:.1e}\n", c.least_increase());
    fmt::print(out, "  w = q + M v >= 0          least w {:.1e}\n", c.least_w());
    fmt::print(out, "  integral of w_i dv_i = 0  largest {:.1e}\n", c.complementarity());
  }
  const v1::Finding& unique = response.unique();
  fmt::print(out, "\nOne solution for every q with q(0) >= 0: {} ({})\n", Word(unique.answer()), unique.reason());
}

}  // namespace dlcs::client
