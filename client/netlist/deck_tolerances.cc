// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/deck_tolerances.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <cstddef>
#include <string>

#include "client/netlist/deck_words.h"
#include "core/problem/options.h"

namespace dlcs::client {
namespace {

struct Kind {
  std::string name;
  std::optional<double> DeckTolerances::*place;
  const char* option;
  const char* of_what;
};
const Kind kKinds[] = {
    {"reltol", &DeckTolerances::relative, "--tolerance", ""},
    {"abstol", &DeckTolerances::of_currents, "--absolute-tolerance", " A of inductors and of outputs"},
    {"vntol", &DeckTolerances::of_voltages, "--absolute-tolerance", " V of capacitors and of outputs"}};

const Kind* KindNamed(const std::string& lower) {
  for (const Kind& kind : kKinds) {
    if (kind.name == lower) return &kind;
  }
  return nullptr;
}

// What is wrong with it, or empty.
std::string FaultOf(const Kind& kind, double value) {
  if (kind.place == &DeckTolerances::relative) {
    const bool is_good = value >= Options::kMinErrorTolerance && value < 1;
    return is_good ? "" : fmt::format("must be at least {:g} and below 1", Options::kMinErrorTolerance);
  }
  return value >= 0 && std::isfinite(value) ? "" : "must be finite and at least 0";
}

class Reader {
 public:
  Reader(ParameterScope& scope, DeckNotes& notes) : scope_(scope), notes_(notes) {}

  absl::Status Add(const DeckLine& line) {
    std::vector<std::string> others;
    bool has_tolerance = false;
    const std::vector<DeckWord> words = WordsOf(line);
    for (std::size_t k = 1; k < words.size(); ++k) {
      const bool has_value = k + 2 < words.size() && words[k + 1].text == "=" && !words[k + 1].is_expression;
      const Kind* kind = KindNamed(Lower(words[k].text));
      if (kind == nullptr) {
        others.push_back(words[k].text);
      } else if (!has_value) {
        return DeckError(line.Place(words[k].offset),
                         fmt::format("{} has no value; it is written {}=VALUE", words[k].text, kind->name));
      } else if (absl::Status status = Read(line, *kind, words[k], words[k + 2]); !status.ok()) {
        return status;
      }
      has_tolerance = has_tolerance || kind != nullptr;
      if (has_value) k += 2;
    }
    const std::string command = Lower(words[0].text);
    if (!has_tolerance) {
      notes_.Add(fmt::format("{}: {} is ignored", line.Place(), command));
    } else if (!others.empty()) {
      notes_.Add(fmt::format("{}: {} of {} is ignored", line.Place(), fmt::join(others, ", "), command));
    }
    return absl::OkStatus();
  }

  const DeckTolerances& tolerances() const { return tolerances_; }

 private:
  absl::Status Read(const DeckLine& line, const Kind& kind, const DeckWord& name, const DeckWord& word) {
    const auto value = ValueOf(line, word, scope_, notes_);
    if (!value.ok()) return value.status();
    if (const std::string fault = FaultOf(kind, *value); !fault.empty()) {
      return DeckError(line.Place(word.offset), fmt::format("{} is {:g}; {}", name.text, *value, fault));
    }
    tolerances_.*kind.place = *value;
    notes_.Add(fmt::format("{}: {} is {} {:g}{}, unless the command line gives its own", line.Place(name.offset),
                           kind.name, kind.option, *value, kind.of_what));
    return absl::OkStatus();
  }

  ParameterScope& scope_;
  DeckNotes& notes_;
  DeckTolerances tolerances_;
};

}  // namespace

absl::StatusOr<DeckTolerances> ReadTolerances(const std::vector<const DeckLine*>& lines, ParameterScope& scope,
                                              DeckNotes& notes) {
  Reader reader(scope, notes);
  for (const DeckLine* line : lines) {
    if (absl::Status status = reader.Add(*line); !status.ok()) return status;
  }
  return reader.tolerances();
}

}  // namespace dlcs::client
