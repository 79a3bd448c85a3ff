// SPDX-License-Identifier: Apache-2.0
// Numbers in columns, and lists of them in a line.

#ifndef DLCS_CLIENT_CLI_TERMINAL_COLUMNS_H_
#define DLCS_CLIENT_CLI_TERMINAL_COLUMNS_H_

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace dlcs::client {

// Six significant digits.
inline std::string Cell(double value) { return fmt::format("{:.6g}", value); }

struct Column {
  std::string title;
  std::vector<std::string> cells;
  std::size_t width = 0;
};

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

// Prints the columns side by side; those that do not fit into `width` characters follow in further blocks. Every block
// begins with the first column.
void PrintColumns(const std::vector<Column>& columns, std::size_t rows, std::size_t width, std::FILE* out);

// "(1, 2.5, 3)", at most 12 of them.
template <typename Values>
std::string Listed(const Values& values) {
  constexpr std::size_t kMaxListed = 12;
  std::vector<std::string> cells;
  for (const double value : values) {
    if (cells.size() == kMaxListed) break;
    cells.push_back(Cell(value));
  }
  const bool cut = static_cast<std::size_t>(values.size()) > kMaxListed;
  return fmt::format("({}{})", fmt::join(cells, ", "), cut ? fmt::format(", … {} in all", values.size()) : "");
}

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_TERMINAL_COLUMNS_H_
