// SPDX-License-Identifier: Apache-2.0
// SPICE decks, as `dlcs netlist` and `dlcs ensemble` read them: the problem file of an accepted deck can be read again,
// with its outputs and measurements.

#include <cmath>
#include <cstddef>
#include <variant>

#include "client/files/problem_file.h"
#include "client/netlist/deck.h"
#include "client/netlist/deck_steps.h"
#include "client/netlist/netlist.h"
#include "core/circuits/circuit.h"
#include "core/circuits/waveform.h"
#include "tests/fuzz/fuzz_target.h"

namespace dlcs::fuzz {
namespace {

// Every deck is parsed and expanded. Its equations are made where that is quick: for few elements and points, and where
// switches follow few periods of their sources.
constexpr std::size_t kMaxElements = 40;
constexpr std::size_t kMaxKinks = 8;
constexpr std::size_t kMaxPoints = 3;
constexpr double kMaxPeriods = 100;

// Periods per second.
double RateOf(const Waveform& wave) {
  if (const auto* pulse = std::get_if<PulseWave>(&wave)) return 1 / pulse->period;
  if (const auto* sine = std::get_if<SineWave>(&wave)) return sine->frequency;
  if (const auto* wobble = std::get_if<FrequencyModulatedWave>(&wave)) return wobble->carrier + wobble->signal;
  if (const auto* swell = std::get_if<AmplitudeModulatedWave>(&wave)) return swell->carrier + swell->signal;
  const auto* lines = std::get_if<PiecewiseLinearWave>(&wave);
  if (lines == nullptr || !lines->repeats_from || lines->times.empty()) return 0;
  return 1 / (lines->times.back() - *lines->repeats_from);
}

bool IsQuick(const Circuit& circuit) {
  if (circuit.elements.size() > kMaxElements) return false;
  double rates = 0;
  bool has_switch = false;
  for (const Element& element : circuit.elements) {
    if (element.transfer && element.transfer->x.size() > kMaxKinks) return false;
    rates += std::abs(RateOf(element.source));
    has_switch = has_switch || element.kind == ElementKind::kSwitch;
  }
  return !has_switch || rates * circuit.horizon <= kMaxPeriods;
}

void CheckNetlist(const client::Netlist& netlist) {
  const auto file = client::ParseProblem(client::NetlistJson(netlist).dump(), "made");
  Require(file.ok(), "a deck makes a problem file");
  Require(file->problem.outputs().names_size() == netlist.problem.outputs().names_size(), "outputs are kept");
  Require(file->problem.measurements_size() == netlist.problem.measurements_size(), "measurements are kept");
}

}  // namespace

void TryDeck(const std::string& input) {
  if (input.size() > 10'000) return;  // a problem grows with the square of the deck
  const auto deck = client::ReadDeck(input, "input", /*folder=*/"", {});
  if (deck.ok() && !IsQuick(deck->circuit)) return;
  const auto netlist = client::ReadNetlist(input, "input", /*folder=*/"", {});
  Require(deck.ok() || !netlist.ok(), "a deck with errors makes no problem");
  if (netlist.ok()) CheckNetlist(*netlist);
  if (!deck.ok() || deck->steps.empty()) return;
  Require(!netlist.ok(), "a sweep is no single problem");
  const auto points = client::PointsOf(deck->steps);
  if (!points.ok() || points->size() > kMaxPoints) return;
  const auto sweep = client::ReadSweep(input, "input", /*folder=*/"", {});
  if (!sweep.ok()) return;
  Require(sweep->size() == points->size(), "a sweep has all points");
  for (const client::SweptNetlist& point : *sweep) CheckNetlist(point.netlist);
}

}  // namespace dlcs::fuzz
