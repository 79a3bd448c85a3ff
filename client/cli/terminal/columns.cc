// SPDX-License-Identifier: Apache-2.0
#include "client/cli/terminal/columns.h"

namespace dlcs::client {
namespace {

void PrintRow(const std::vector<Column>& columns, std::size_t first, std::size_t last, const auto& cell_of,
              std::FILE* out) {
  std::string line = fmt::format("{:>{}}", cell_of(columns[0]), columns[0].width);
  for (std::size_t i = first; i < last; ++i) {
    line += fmt::format("  {:>{}}", cell_of(columns[i]), columns[i].width);
  }
  fmt::print(out, "{}\n", line);
}

}  // namespace

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

}  // namespace dlcs::client
