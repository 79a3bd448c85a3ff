// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/netlist.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <optional>
#include <utility>

#include "client/files/json_text.h"
#include "client/files/problem_file.h"
#include "client/netlist/circuit_outputs.h"
#include "client/netlist/deck.h"
#include "client/netlist/deck_lines.h"
#include "client/netlist/deck_parts.h"
#include "client/netlist/deck_words.h"
#include "core/circuits/circuit_problem.h"
#include "server/wire/component_names.h"
#include "server/wire/convert.h"

namespace dlcs::client {
namespace {

// The units of a circuit's states are in their names.
OutputUnit UnitOfState(const std::string& name) {
  if (name.starts_with("v_") || name.starts_with("v0_")) return OutputUnit::kVolts;
  if (name.starts_with("i_") || name.starts_with("i0_")) return OutputUnit::kAmperes;
  return OutputUnit::kOther;
}

v1::SolveOptions TolerancesOf(const DeckTolerances& given, const std::vector<std::string>& states,
                              const v1::Problem& problem, const std::vector<OutputUnit>& units) {
  v1::SolveOptions result;
  if (given.relative) result.set_error_tolerance(*given.relative);
  const auto add = [&](const std::string& name, OutputUnit unit) {
    const std::optional<double> of_unit = unit == OutputUnit::kVolts     ? given.of_voltages
                                          : unit == OutputUnit::kAmperes ? given.of_currents
                                                                         : std::nullopt;
    if (!of_unit) return;
    v1::ComponentTolerance& of_component = *result.add_absolute_tolerances();
    of_component.set_name(name);
    of_component.set_tolerance(*of_unit);
  };
  for (const std::string& name : states) add(name, UnitOfState(name));
  for (std::size_t k = 0; k < units.size(); ++k) add(problem.outputs().names(static_cast<int>(k)), units[k]);
  return result;
}

absl::StatusOr<Netlist> MakeNetlist(Deck deck, const std::string& source) {
  auto made = MakeCircuitProblem(deck.circuit);
  if (!made.ok()) return DeckError(source, std::string(made.status().message()));
  Netlist netlist;
  netlist.title = deck.title;
  const std::vector<OutputUnit> units = SetOutputs(deck, *made);
  netlist.problem = ToProto(made->problem);
  SetNames({made->state_names, made->pair_names}, netlist.problem);
  netlist.tolerances = TolerancesOf(deck.tolerances, made->state_names, netlist.problem, units);
  netlist.relays = std::move(made->relays);
  for (Relay& relay : netlist.relays) relay.element = relay.element.substr(0, relay.element.find('#'));
  netlist.notes = std::move(deck.notes);
  netlist.notes.insert(netlist.notes.end(), made->notes.begin(), made->notes.end());
  return netlist;
}

absl::StatusOr<Netlist> ReadWithoutTitle(const std::string& text, const std::string& source, const std::string& folder,
                                         const DeckOptions& options) {
  auto deck = ReadDeck(text, source, folder, options);
  if (!deck.ok()) return deck.status();
  if (!deck->steps.empty()) {
    return DeckError(source, fmt::format(".step {} is a sweep: dlcs ensemble {} solves all its points",
                                         deck->steps.front().shown, source));
  }
  return MakeNetlist(*std::move(deck), source);
}

}  // namespace

bool IsDeck(const std::string& text, const std::string& path) {
  constexpr std::array kEndings = {".cir", ".net", ".sp", ".ckt", ".spice", ".asc"};
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

namespace {

// Files that are no deck, whatever their name.
absl::Status RefuseOtherFiles(const std::string& text, const std::string& source) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos) return DeckError(source, "the file is empty");
  if (text[first] == '{' && text.find(".tran") == std::string::npos) {
    return DeckError(source, "holds JSON and no deck; dlcs solve reads problem files as they are");
  }
  if (text.starts_with("Version 4") && text.find("\nSHEET ") != std::string::npos) {
    return DeckError(source, "is a schematic of LTspice; save its netlist, View > SPICE Netlist, as a .net file");
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Netlist> ReadNetlist(const std::string& text, const std::string& source, const std::string& folder,
                                    const DeckOptions& options) {
  if (absl::Status other = RefuseOtherFiles(text, source); !other.ok()) return other;
  auto netlist = ReadWithoutTitle(text, source, folder, options);
  const std::string note = netlist.ok() ? "" : NoteOnTitle(Trimmed(text.substr(0, text.find('\n'))));
  if (note.empty()) return netlist;
  return absl::InvalidArgumentError(fmt::format("{}; {}", std::string(netlist.status().message()), note));
}

absl::StatusOr<std::vector<SweptNetlist>> ReadSweep(const std::string& text, const std::string& source,
                                                    const std::string& folder, const DeckOptions& options) {
  if (absl::Status other = RefuseOtherFiles(text, source); !other.ok()) return other;
  const auto first = ReadDeck(text, source, folder, options);
  if (!first.ok()) return first.status();
  const auto points = PointsOf(first->steps);
  if (!points.ok()) return DeckError(source, std::string(points.status().message()));
  std::vector<SweptNetlist> sweep;
  for (const SweepPoint& point : *points) {
    DeckOptions with = options;
    for (const auto& [name, value] : point.parameters) with.parameters[name] = value;
    auto deck = ReadDeck(text, source, folder, with);
    auto netlist = deck.ok() ? MakeNetlist(*std::move(deck), source) : absl::StatusOr<Netlist>(deck.status());
    if (!netlist.ok()) {
      const std::string where = point.label.empty() ? "" : fmt::format(" (with {})", point.label);
      return absl::InvalidArgumentError(std::string(netlist.status().message()) + where);
    }
    sweep.push_back({point.label, *std::move(netlist)});
  }
  return sweep;
}

absl::StatusOr<Netlist> ReadNetlistFile(const std::string& path, const DeckOptions& options) {
  const auto text = ReadTextFile(path);
  if (!text.ok()) return text.status();
  return ReadNetlist(*text, SourceName(path), FolderOfDeck(path), options);
}

v1::SolveOptions WithTolerances(v1::SolveOptions options, const v1::SolveOptions& of_deck, const v1::Problem& problem) {
  const bool has_steps = options.grid_case() != v1::SolveOptions::GRID_NOT_SET;
  if (options.error_tolerance() == 0 && !has_steps) options.set_error_tolerance(of_deck.error_tolerance());
  if (options.has_absolute_tolerance()) return options;
  const ComponentNames names = NamesOf(problem);
  const auto component = [&](const v1::ComponentTolerance& given) {
    return ComponentNamed(given.name(), names, std::ssize(names.states), std::ssize(names.pairs));
  };
  std::vector<std::optional<Component>> given;
  for (const v1::ComponentTolerance& own : options.absolute_tolerances()) given.push_back(component(own));
  for (const v1::ComponentTolerance& deck : of_deck.absolute_tolerances()) {
    if (std::ranges::find(given, component(deck)) == given.end()) *options.add_absolute_tolerances() = deck;
  }
  return options;
}

nlohmann::ordered_json NetlistJson(const Netlist& netlist) {
  nlohmann::ordered_json file = nlohmann::ordered_json::object();
  if (!netlist.title.empty()) file["name"] = netlist.title;
  file.update(ProblemJson(netlist.problem));
  return file;
}

}  // namespace dlcs::client
