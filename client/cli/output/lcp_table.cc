// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>
#include <vector>

#include "client/cli/output/lcp_output.h"
#include "client/cli/terminal/columns.h"
#include "client/cli/terminal/words.h"
#include "client/cli/terminal/wrapped_text.h"
#include "client/result/names.h"

namespace dlcs::client {
namespace {

constexpr std::size_t kWidth = 100;

// "{0, 2}": counted from 0, as entries are in files, JSON and messages.
template <typename Indices>
std::string Set(const Indices& indices) {
  return fmt::format("{{{}}}", fmt::join(indices, ", "));
}

void PrintSets(const v1::SolveLcpResponse& response, std::FILE* out) {
  if (!response.has_sets()) return;
  const v1::IndexSets& sets = response.sets();
  fmt::print(out, "\nIndex sets\n  J (y > 0)      {}\n  I (w > 0)      {}\n  K (y = w = 0)  {}\n", Set(sets.j()),
             Set(sets.i()), sets.k().empty() ? "{}: not degenerate" : Set(sets.k()) + ": degenerate");
  if (!response.only_choice()) fmt::print(out, "  Other solutions satisfy the rule as well.\n");
}

void PrintAll(const v1::BasicSolutions& all, std::FILE* out) {
  fmt::print(out, "\n{}{}\n",
             all.solutions().empty() ? "No basic solution" : Count(all.solutions_size(), "basic solution"),
             all.complete() ? "" : "; the search was not complete");
  for (const v1::BasicSolution& solution : all.solutions()) {
    fmt::print(out, "  y = {}, w = {}{}\n", Listed(solution.y()), Listed(solution.w()),
               solution.sets().k().empty() ? "" : ", degenerate");
  }
  for (const v1::SolutionFace& face : all.faces()) {
    fmt::print(out, "  {} with w = 0 on {}, nearest to 0: y = {}\n", face.point() ? "the point" : "a continuum",
               Set(face.basis()), Listed(face.nearest()));
  }
  if (all.complete() && all.faces().empty()) {
    fmt::print(out, "There {}.\n", all.solutions().empty() ? "is no other solution either" : "are no other solutions");
  }
}

}  // namespace

void PrintLcpTable(const v1::SolveLcpResponse& response, std::FILE* out) {
  Paragraphs paper(static_cast<int>(kWidth), out);
  // The message of a solution says no more than the verdict.
  const std::string message = response.verdict() == v1::LCP_STATUS_SOLVED ? "" : response.message();
  paper.Print("", fmt::format("{}{}{}", VerdictName(response.verdict()), message.empty() ? "" : ": ", message));
  paper.Print("M       ", response.matrix_class());
  if (!response.rule().empty()) paper.Print("Rule    ", response.rule());
  paper.Print("Method  ", fmt::format("{}, {}", response.method(), Count(response.pivots(), "pivot")));
  if (response.verdict() == v1::LCP_STATUS_SOLVED && !response.y().empty()) {
    const auto rows = static_cast<std::size_t>(response.y_size());
    std::vector<Column> columns;
    columns.push_back(MakeColumn("i", rows, [](std::size_t i) { return static_cast<double>(i); }));
    columns.push_back(MakeColumn("y", rows, [&](std::size_t i) { return response.y(static_cast<int>(i)); }));
    if (response.w_size() == response.y_size()) {
      columns.push_back(MakeColumn("w", rows, [&](std::size_t i) { return response.w(static_cast<int>(i)); }));
    }
    PrintColumns(columns, rows, kWidth, out);
    fmt::print(out, "\nResidual of min(y, w): {:.1e}\n", response.residual());
  }
  PrintSets(response, out);
  if (response.has_all()) PrintAll(response.all(), out);
}

}  // namespace dlcs::client
