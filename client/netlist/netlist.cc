// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/netlist.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <utility>

#include "client/files/json_text.h"
#include "client/files/problem_file.h"
#include "client/netlist/deck.h"
#include "client/netlist/deck_lines.h"
#include "core/circuits/circuit_problem.h"
#include "server/wire/convert.h"

namespace dlcs::client {
namespace {

Index RowOf(const CircuitOutputs& outputs, const std::string& lower) {
  for (std::size_t k = 0; k < outputs.names.size(); ++k) {
    if (Lower(outputs.names[k]) == lower) return static_cast<Index>(k);
  }
  return -1;
}

// A choice of rows: each is the difference of two, the second being ground (-1) for most.
struct OutputChoice {
  std::vector<std::string> names;
  std::vector<std::pair<Index, Index>> rows;
};

// Those of `names` ("v(out)", "v(a,b)", "i(l1)", in small letters) in this order, all if there are none.
OutputChoice Choose(const CircuitOutputs& outputs, const std::vector<std::string>& names) {
  OutputChoice choice;
  const auto add = [&choice](const std::string& name, Index plus, Index minus) {
    for (const std::string& taken : choice.names) {
      if (Lower(taken) == Lower(name)) return;
    }
    choice.names.push_back(name);
    choice.rows.emplace_back(plus, minus);
  };
  for (const std::string& name : names) {
    const std::size_t comma = name.find(',');
    const Index row = RowOf(outputs, name);
    if (row >= 0) {
      add(outputs.names[static_cast<std::size_t>(row)], row, -1);
    } else if (comma != std::string::npos) {
      add(name, RowOf(outputs, name.substr(0, comma) + ")"), RowOf(outputs, "v(" + name.substr(comma + 1)));
    }
  }
  for (std::size_t k = 0; k < outputs.names.size() && names.empty(); ++k) {
    add(outputs.names[k], static_cast<Index>(k), -1);
  }
  return choice;
}

// rows · f(t), without the functions of time that it does not need: each is searched for switching times.
TimeFunction RowsOf(const TimeFunction& function, const Matrix& rows) {
  TimeFunction chosen = function;
  chosen.lift = function.is_lifted() ? Matrix(rows * function.lift.Dense()) : rows;
  const bool has_formulas = std::all_of(
      chosen.pieces.begin(), chosen.pieces.end(),
      [](const TimeFunction::Piece& piece) { return std::holds_alternative<FormulaFunction>(piece.function); });
  if (!function.is_lifted() || !has_formulas) return chosen;
  std::vector<Index> kept = {0};
  for (Index k = 1; k < chosen.lift.cols(); ++k) {
    if (!chosen.lift.Dense().col(k).isZero(0)) kept.push_back(k);
  }
  chosen.lift = Matrix(chosen.lift.Dense()(Eigen::all, kept));
  for (TimeFunction::Piece& piece : chosen.pieces) {
    std::vector<std::string>& formulas = std::get<FormulaFunction>(piece.function).formulas;
    std::vector<std::string> texts;
    for (const Index k : kept) texts.push_back(formulas[static_cast<std::size_t>(k)]);
    formulas = std::move(texts);
  }
  return chosen;
}

NamedOutputs Selected(const CircuitProblem& made, const std::vector<std::string>& names) {
  const CircuitOutputs& outputs = made.outputs;
  OutputChoice choice = Choose(outputs, names);
  const std::size_t shown = choice.names.size();
  std::map<std::string, double> limits;
  for (const CurrentLimit& limit : made.limits) {
    limits[limit.output] = limit.amperes;
    if (std::find(choice.names.begin(), choice.names.end(), limit.output) != choice.names.end()) continue;
    choice.names.push_back(limit.output);
    choice.rows.emplace_back(RowOf(outputs, Lower(limit.output)), -1);
  }
  Matrix rows = Matrix::Zero(static_cast<Index>(choice.rows.size()), static_cast<Index>(outputs.names.size()));
  for (std::size_t k = 0; k < choice.rows.size(); ++k) {
    if (choice.rows[k].first >= 0) rows(static_cast<Index>(k), choice.rows[k].first) += 1;
    if (choice.rows[k].second >= 0) rows(static_cast<Index>(k), choice.rows[k].second) -= 1;
  }
  const TimeFunction sources = RowsOf(outputs.sources, rows);
  return {.names = choice.names,
          .shown = shown,
          .limits = limits,
          .x_factors = ToProto(Matrix(rows * outputs.x_factors)),
          .y_factors = ToProto(Matrix(rows * outputs.y_factors)),
          .sources = ToProto(sources)};
}

}  // namespace

bool IsDeck(const std::string& text, const std::string& path) {
  constexpr std::array kEndings = {".cir", ".net", ".sp", ".ckt", ".spice"};
  const std::string lower = Lower(path);
  for (const char* ending : kEndings) {
    if (lower.ends_with(ending)) return true;
  }
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos || text[first] == '{' || text.find('\0') != std::string::npos) return false;
  for (std::size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at + 1)) {
    const std::size_t begin = text.find_first_not_of(" \t", at + 1);
    if (begin != std::string::npos && Lower(text.substr(begin, 5)) == ".tran") return true;
  }
  return false;
}

std::string FolderOfDeck(const std::string& path) {
  if (path == "-") return "";
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

absl::StatusOr<Netlist> ReadNetlist(const std::string& text, const std::string& source, const std::string& folder,
                                    const DeckOptions& options) {
  auto deck = ReadDeck(text, source, folder, options);
  if (!deck.ok()) return deck.status();
  auto made = MakeCircuitProblem(deck->circuit);
  if (!made.ok()) return DeckError(source, std::string(made.status().message()));
  Netlist netlist;
  netlist.title = deck->title;
  netlist.problem = ToProto(made->problem);
  SetNames({made->state_names, made->pair_names}, netlist.problem);
  netlist.outputs = Selected(*made, deck->outputs);
  netlist.notes = std::move(deck->notes);
  netlist.notes.insert(netlist.notes.end(), made->notes.begin(), made->notes.end());
  return netlist;
}

absl::StatusOr<Netlist> ReadNetlistFile(const std::string& path, const DeckOptions& options) {
  const auto text = ReadTextFile(path);
  if (!text.ok()) return text.status();
  return ReadNetlist(*text, SourceName(path), FolderOfDeck(path), options);
}

nlohmann::ordered_json NetlistJson(const Netlist& netlist) {
  nlohmann::ordered_json file = nlohmann::ordered_json::object();
  if (!netlist.title.empty()) file["name"] = netlist.title;
  file.update(ProblemJson(netlist.problem));
  file["annotations"]["outputs"] = OutputsJson(netlist.outputs);
  return file;
}

}  // namespace dlcs::client
