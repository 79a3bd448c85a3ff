// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/netlist.h"

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <filesystem>
#include <utility>

#include "client/files/json_text.h"
#include "client/files/problem_file.h"
#include "client/netlist/circuit_outputs.h"
#include "client/netlist/deck.h"
#include "client/netlist/deck_lines.h"
#include "client/netlist/deck_parts.h"
#include "client/netlist/deck_words.h"
#include "core/circuits/circuit_problem.h"
#include "server/wire/convert.h"

namespace dlcs::client {
namespace {

absl::StatusOr<Netlist> MakeNetlist(Deck deck, const std::string& source) {
  auto made = MakeCircuitProblem(deck.circuit);
  if (!made.ok()) return DeckError(source, std::string(made.status().message()));
  Netlist netlist;
  netlist.title = deck.title;
  SetOutputs(deck, *made);
  netlist.problem = ToProto(made->problem);
  SetNames({made->state_names, made->pair_names}, netlist.problem);
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

nlohmann::ordered_json NetlistJson(const Netlist& netlist) {
  nlohmann::ordered_json file = nlohmann::ordered_json::object();
  if (!netlist.title.empty()) file["name"] = netlist.title;
  file.update(ProblemJson(netlist.problem));
  return file;
}

}  // namespace dlcs::client
