// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/deck.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>

#include "client/netlist/deck_circuit.h"
#include "client/netlist/deck_lines.h"
#include "client/netlist/deck_parts.h"
#include "client/netlist/deck_quantities.h"
#include "client/netlist/deck_values.h"
#include "client/netlist/deck_words.h"
#include "client/netlist/measurements.h"
#include "client/netlist/spice_expression.h"

namespace dlcs::client {
namespace {

class DeckReader {
 public:
  DeckReader(const DeckText& text, const DeckParts& parts, const DeckOptions& options)
      : parts_(parts), parameters_(options.parameters), notes_(text.notes), circuit_(parts_, options, notes_) {
    deck_.title = text.title;
    circuit_.circuit().current_limit = options.current_limit;
    for (const std::string& note : parts.notes) notes_.Add(note);
  }

  absl::StatusOr<Deck> Read() {
    ParameterScope global;
    std::set<std::string> given;
    for (const auto& [name, value] : parameters_) {
      global.DefineValue(name, value);
      given.insert(name);
    }
    if (absl::Status status = DefineParameters(parts_.top.parameters, given, global); !status.ok()) return status;
    if (absl::Status status = ReadSteps(global); !status.ok()) return status;
    if (absl::Status status = ReadAnalysis(global); !status.ok()) return status;
    auto tolerances = ReadTolerances(parts_.options, global, notes_);
    if (!tolerances.ok()) return tolerances.status();
    deck_.tolerances = *tolerances;
    if (absl::Status status = circuit_.AddAll(global, deck_.output_step, stop_); !status.ok()) return status;
    NoteInitialConditions();
    auto outputs = PrintedQuantities(parts_.outputs, global, circuit_, notes_);
    if (!outputs.ok()) return outputs.status();
    deck_.outputs = *std::move(outputs);
    auto measurements = ReadMeasurements(parts_.measurements, stop_, global, circuit_, notes_);
    if (!measurements.ok()) return measurements.status();
    deck_.measurements = *std::move(measurements);
    deck_.circuit = std::move(circuit_.circuit());
    deck_.notes = std::move(notes_).Take();
    return std::move(deck_);
  }

 private:
  // A parameter that the deck does not define has the first value of its .step.
  absl::Status ReadSteps(ParameterScope& scope) {
    for (const DeckLine* line : parts_.steps) {
      auto step = ReadStep(*line, scope, notes_);
      if (!step.ok()) return step.status();
      for (const ParameterStep& other : deck_.steps) {
        if (other.name == step->name) {
          return DeckError(line->Place(), fmt::format("{} is stepped twice", step->shown));
        }
      }
      scope.DefineValue(step->name, step->values.front());
      deck_.steps.push_back(*std::move(step));
    }
    return absl::OkStatus();
  }

  absl::Status ReadAnalysis(ParameterScope& scope) {
    if (parts_.tran == nullptr)
      return absl::InvalidArgumentError(
          "the deck has no .tran, which says how long to solve; add .tran TSTEP TSTOP, such as .tran 1u 1m");
    std::vector<double> times;
    std::vector<DeckWord> words = WordsOf(*parts_.tran);
    words.erase(words.begin());
    for (const DeckWord& word : words) {
      const std::string lower = Lower(word.text);
      if (lower == "uic" || lower == "skipbp") {
        circuit_.circuit().uses_initial_conditions = true;
        continue;
      }
      if (lower == "startup") {
        circuit_.TurnSourcesOn();
        notes_.Add(
            fmt::format("{}: startup: the sources outside of subcircuits rise from 0 within 20 us, as in LTspice, "
                        "where the operating point has them at 0",
                        parts_.tran->Place()));
        continue;
      }
      if (lower == "steady" || lower == "nodiscard" || lower == "step") {
        return DeckError(parts_.tran->Place(word.offset), fmt::format("{} of .tran is not supported", word.text));
      }
      const auto value = ValueOf(*parts_.tran, word, scope, notes_);
      if (!value.ok()) return value.status();
      times.push_back(*value);
    }
    if (times.empty() || times.size() > 4) {
      return DeckError(parts_.tran->Place(), ".tran is written .tran TSTEP TSTOP [TSTART [TMAX]] [UIC]");
    }
    deck_.output_step = times.size() > 1 ? std::max(0.0, times[0]) : 0;
    stop_ = times.size() > 1 ? times[1] : times[0];
    if (times.size() > 2 && times[2] > 0) {
      notes_.Add(fmt::format("{}: TSTART = {:g} of .tran is ignored: results begin at 0; --at takes the times to show",
                             parts_.tran->Place(), times[2]));
    }
    if (deck_.output_step > stop_ && stop_ > 0) {
      return DeckError(parts_.tran->Place(), fmt::format("TSTEP = {:g} is longer than TSTOP = {:g}; .tran is written "
                                                         ".tran TSTEP TSTOP [TSTART [TMAX]] [UIC]",
                                                         deck_.output_step, stop_));
    }
    if (!(stop_ > 0)) {
      return DeckError(parts_.tran->Place(), fmt::format("TSTOP is {:g}; must be above 0", stop_));
    }
    return absl::OkStatus();
  }

  void NoteInitialConditions() {
    if (circuit_.circuit().uses_initial_conditions) return;
    for (const Element& element : circuit_.circuit().elements) {
      if (element.initial) {
        notes_.Add(
            fmt::format("{}: IC of {} is ignored, as in SPICE: .tran has no UIC, and starts at the operating point",
                        element.place, element.name));
      }
    }
  }

  const DeckParts& parts_;
  const std::map<std::string, double> parameters_;
  DeckNotes notes_;
  DeckCircuit circuit_;
  Deck deck_;
  double stop_ = 0;  // s
};

}  // namespace

absl::StatusOr<Deck> ReadDeck(const std::string& text, const std::string& source, const std::string& folder,
                              const DeckOptions& options) {
  const auto lines = SplitDeck(text, source, folder);
  if (!lines.ok()) return lines.status();
  const auto parts = SortDeck(*lines);
  if (!parts.ok()) return parts.status();
  auto deck = DeckReader(*lines, *parts, options).Read();
  if (deck.ok() || std::string(deck.status().message()).find(':') != std::string::npos) return deck;
  return DeckError(source, std::string(deck.status().message()));
}

}  // namespace dlcs::client
