// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "client/cli/result_output.h"
#include "client/cli/words.h"
#include "client/names.h"

namespace dlcs::client {
namespace {

// A residual between the nodes above this fraction of its scale is worth a hint.
constexpr double kCoarse = 1e-2;
// The longest list of numbers that a line of the jumps or of an LCP shows.
constexpr std::size_t kMaxListed = 12;

struct Column {
  std::string title;
  std::vector<std::string> cells;
  std::size_t width = 0;
};

std::string Cell(double value) { return fmt::format("{:.6g}", value); }

template <typename ValueAt>
Column MakeColumn(std::string title, std::size_t rows, const ValueAt& value_at) {
  Column column{std::move(title), {}, 0};
  column.width = column.title.size();
  for (std::size_t k = 0; k < rows; ++k) {
    column.cells.push_back(Cell(value_at(k)));
    column.width = std::max(column.width, column.cells.back().size());
  }
  return column;
}

std::vector<Column> MakeColumns(const SolveResult& result) {
  const std::size_t rows = result.times.size();
  std::vector<Column> columns;
  columns.push_back(MakeColumn("t", rows, [&](std::size_t k) { return result.times[k]; }));
  for (std::size_t i = 0; i < result.states; ++i) {
    columns.push_back(
        MakeColumn(fmt::format("x{}", i + 1), rows, [&](std::size_t k) { return result.x_at(k)[i]; }));
  }
  for (std::size_t i = 0; i < result.constraints; ++i) {
    columns.push_back(
        MakeColumn(fmt::format("y{}", i + 1), rows, [&](std::size_t k) { return result.y_at(k)[i]; }));
  }
  return columns;
}

void PrintRow(const std::vector<Column>& columns, std::size_t first, std::size_t last, const auto& cell_of,
              std::FILE* out) {
  std::string line = fmt::format("{:>{}}", cell_of(columns[0]), columns[0].width);
  for (std::size_t i = first; i < last; ++i) {
    line += fmt::format("  {:>{}}", cell_of(columns[i]), columns[i].width);
  }
  fmt::print(out, "{}\n", line);
}

// The time stands at the left of every block.
void PrintColumns(const std::vector<Column>& columns, std::size_t rows, std::size_t width, std::FILE* out) {
  for (std::size_t first = 1; first < columns.size();) {
    std::size_t used = columns[0].width;
    std::size_t last = first;
    while (last < columns.size() && (last == first || used + 2 + columns[last].width <= width)) {
      used += 2 + columns[last++].width;
    }
    fmt::print(out, "\n");
    PrintRow(
        columns, first, last, [](const Column& column) { return column.title; }, out);
    for (std::size_t k = 0; k < rows; ++k) {
      PrintRow(
          columns, first, last, [k](const Column& column) { return column.cells[k]; }, out);
    }
    first = last;
  }
}

template <typename Values>
std::string Listed(const Values& values) {
  std::vector<std::string> cells;
  for (const double value : values) {
    if (cells.size() == kMaxListed) break;
    cells.push_back(Cell(value));
  }
  const bool cut = static_cast<std::size_t>(values.size()) > kMaxListed;
  return fmt::format("({}{})", fmt::join(cells, ", "),
                     cut ? fmt::format(", … {} in all", values.size()) : "");
}

void PrintJumps(const v1::Summary& summary, std::FILE* out) {
  if (summary.jumps().empty()) return;
  fmt::print(out, "\nState jumps\n");
  for (const v1::StateJump& jump : summary.jumps()) {
    fmt::print(out, "  at t = {}: dx = {}, multiplier {}\n", Cell(jump.time()), Listed(jump.dx()),
               Listed(jump.multiplier()));
  }
}

void PrintCertificate(const v1::Certificate& c, std::FILE* out) {
  if (std::isnan(c.node_residual())) return;  // nothing was measured
  fmt::print(out, "\nCertificate\n");
  fmt::print(out, "  LCP residual     {:.1e} at nodes, {:.1e} between them (size of y, w: {:.2g})\n",
             c.node_residual(), c.midpoint_residual(), c.lcp_scale());
  fmt::print(out, "  complementarity  {:.1e} at nodes, {:.1e} between them\n", c.node_complementarity(),
             c.midpoint_complementarity());
  fmt::print(out, "  x' - Ax - By - f {:.1e} between nodes (size of x': {:.2g})\n", c.ode_defect(),
             c.ode_scale());
  if (c.has_estimated_error_x()) {
    fmt::print(out, "  estimated error  {:.1e} of x (size {:.2g}), {:.1e} of B y\n", c.estimated_error_x(),
               c.x_scale(), c.estimated_error_by());
  } else {
    fmt::print(out, "  estimated error  not asked for (--estimate-error)\n");
  }
  if (c.midpoint_residual() > kCoarse * c.lcp_scale()) {
    fmt::print(out, "  The residual between the nodes is large: take shorter steps to resolve y.\n");
  }
}

// The superlinear fall of the residual where Newton's method had most to do.
void PrintNewton(const v1::Summary& summary, std::FILE* out) {
  if (!summary.has_newton()) return;
  const v1::Cost& cost = summary.cost();
  const v1::NewtonRecord& newton = summary.newton();
  fmt::print(out, "\nNewton's method\n");
  fmt::print(out, "  {} in {}, at most {} in one\n", Count(cost.newton_iterations(), "iteration"),
             Count(cost.steps(), "step"), cost.most_newton_iterations());
  if (cost.substituted_steps() > 0) {
    fmt::print(out, "  {} not solved by it, but by substitution\n", Count(cost.substituted_steps(), "step"));
  }
  std::vector<std::string> residuals;
  for (const double residual : newton.residuals()) residuals.push_back(fmt::format("{:.1e}", residual));
  fmt::print(out, "  residuals of the step to t = {}: {}\n", Cell(newton.time()), fmt::join(residuals, ", "));
  if (newton.has_contraction()) {
    fmt::print(out, "  step times κ = {:.2g}; convergence is sure below 1/3\n", newton.contraction());
  }
}

void PrintCost(const v1::Cost& cost, std::FILE* out) {
  if (cost.lcps() == 0) {  // ended before its first step, or without telling
    fmt::print(out, "\n{:.2g} s\n", cost.seconds_total());
    return;
  }
  fmt::print(out, "\n{}, {}, {}, {}", Count(cost.steps(), "step"), Count(cost.windows(), "window"),
             Count(cost.iterations(), "iteration"), Count(cost.lcps(), "LCP"));
  if (cost.marched_steps() > 0) fmt::print(out, ", {} marched", Count(cost.marched_steps(), "step"));
  fmt::print(out, "; {:.2g} s ({:.2g} s set-up, {:.2g} s LCPs, {:.2g} s linear algebra)\n",
             cost.seconds_total(), cost.seconds_setup(), cost.seconds_lcp(), cost.seconds_linear());
}

}  // namespace

void PrintTable(const std::string& name, const SolveResult& result, int width, std::FILE* out) {
  const v1::Summary& summary = result.summary;
  fmt::print(out, "{}: {}\n", name, TerminationName(summary.termination()));
  if (!summary.message().empty()) fmt::print(out, "{}\n", summary.message());
  fmt::print(out, "Method {}: {}\n", MethodName(summary.method()), summary.reason());
  for (const std::string& warning : summary.warnings()) fmt::print(out, "Warning: {}\n", warning);
  if (!result.times.empty()) {
    PrintColumns(MakeColumns(result), result.times.size(), static_cast<std::size_t>(width), out);
  }
  PrintJumps(summary, out);
  if (!result.times.empty()) PrintCertificate(summary.certificate(), out);
  PrintNewton(summary, out);
  PrintCost(summary.cost(), out);
}

void PrintLcpTable(const v1::SolveLcpResponse& response, std::FILE* out) {
  fmt::print(out, "{}{}{}\n", VerdictName(response.verdict()), response.message().empty() ? "" : ": ",
             response.message());
  fmt::print(out, "M is a {}; method {}, {} pivots\n", response.matrix_class(), response.method(),
             response.pivots());
  if (response.y().empty()) return;
  const auto rows = static_cast<std::size_t>(response.y_size());
  std::vector<Column> columns;
  columns.push_back(MakeColumn("i", rows, [](std::size_t i) { return static_cast<double>(i + 1); }));
  columns.push_back(MakeColumn("y", rows, [&](std::size_t i) { return response.y(static_cast<int>(i)); }));
  if (response.w_size() == response.y_size()) {
    columns.push_back(MakeColumn("w", rows, [&](std::size_t i) { return response.w(static_cast<int>(i)); }));
  }
  PrintColumns(columns, rows, 80, out);
  fmt::print(out, "\nResidual of min(y, w): {:.1e}\n", response.residual());
}

}  // namespace dlcs::client
