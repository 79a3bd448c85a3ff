// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/gate.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <set>
#include <string>
#include <utility>

#include "core/format_number.h"
#include "core/problem/formula.h"
#include "core/problem/formula_switching.h"

namespace dlcs {
namespace {

// The waveform times `factor`, plus `offset`.
PulseWave Moved(PulseWave wave, double factor, double offset) {
  wave.low = factor * wave.low + offset;
  wave.high = factor * wave.high + offset;
  return wave;
}

// The gate of a control that is one pulse.
Waveform GateOfPulse(const PulseWave& control, double close, double open, bool starts_closed) {
  const double low = control.low, high = control.high;
  const bool up = high > low;
  const double least = std::min(low, high), largest = std::max(low, high);
  // Both levels must be crossed, or the gate stays as it is once it has changed.
  const bool start = low >= close || (low > open && starts_closed);
  if (largest < close && !start) return ConstantWave{0};
  if (least > open && start) return ConstantWave{1};

  // The time after the start of a period at which the first ramp is at `level`, and at which the second one is.
  const auto on_rise = [&](double level) { return control.rise * (level - low) / (high - low); };
  const auto on_fall = [&](double level) {
    return control.rise + control.width + control.fall * (high - level) / (high - low);
  };
  const bool closes = largest >= close, opens = least <= open;
  if (closes && opens) {
    const double first = up ? on_rise(close) : on_rise(open);
    // A pulse that is longer than its period falls at its end.
    const double last = std::min(up ? on_fall(open) : on_fall(close), control.period);
    if (first >= control.period) return ConstantWave{start ? 1.0 : 0.0};
    return PulseWave{.low = up ? 0.0 : 1.0,
                     .high = up ? 1.0 : 0.0,
                     .delay = control.delay + first,
                     .rise = 0,
                     .fall = 0,
                     .width = last - first,
                     .period = control.period,
                     .cycles = control.cycles};
  }
  // One change for ever.
  const double level = closes ? close : open;
  const double rising = on_rise(level);
  return GateWave{start, {control.delay + rising}};
}

std::string SumNear(const std::vector<ControlTerm>& control, double inside) {
  std::string sum;
  for (const ControlTerm& term : control) {
    sum += (sum.empty() ? "(" : " + (") + NumberText(term.factor) + ")*(" + FormulaNear(term.wave, inside) + ")";
  }
  return sum;
}

// A change of the sign of control - level.
struct Crossing {
  double time = 0;
  bool rises = false;
};

// All crossings of `level`; `above` is the sign at 0.
absl::StatusOr<std::vector<Crossing>> CrossingsOf(const std::vector<ControlTerm>& control, double level, double horizon,
                                                  bool& starts_above) {
  std::set<double> cuts = {0, horizon};
  for (const ControlTerm& term : control) {
    const std::vector<double> times = Cuts(term.wave, horizon);
    cuts.insert(times.begin(), times.end());
  }
  std::vector<Crossing> crossings;
  bool first = true, above = false;
  for (auto begin = cuts.begin(), end = std::next(begin); end != cuts.end(); begin = end++) {
    const double middle = *begin + (*end - *begin) / 2;
    const std::string text = "(" + SumNear(control, middle) + ") >= " + NumberText(level);
    const auto analyzed = AnalyzeFormula(text, {}, *begin, *end);
    if (!analyzed.ok()) return analyzed.status();
    const FormulaSwitching& found = (*analyzed)->switching;
    if (!found.refusal.empty() || !found.warnings.empty()) {
      return absl::FailedPreconditionError(found.refusal.empty() ? found.warnings.front() : found.refusal);
    }
    auto formula = Formula::Parse(text);
    if (!formula.ok()) return formula.status();
    double from = *begin;
    for (std::size_t k = 0; k <= found.times.size(); ++k) {
      const double to = k < found.times.size() ? found.times[k] : *end;
      const double inside =
          k < found.inside.size() && std::isfinite(found.inside[k]) ? found.inside[k] : from / 2 + to / 2;
      const bool now = formula->Evaluate(inside) != 0;
      if (first) starts_above = above = now;
      if (now != above) crossings.push_back({from, now});
      above = now;
      first = false;
      from = to;
    }
  }
  return crossings;
}

}  // namespace

absl::StatusOr<Waveform> GateOf(const std::vector<ControlTerm>& control, const SwitchModel& model, double horizon) {
  const double close = model.threshold + model.hysteresis, open = model.threshold - model.hysteresis;
  double constant = 0;
  const PulseWave* pulse = nullptr;
  double factor = 0;
  bool is_simple = true;
  for (const ControlTerm& term : control) {
    if (const auto* given = std::get_if<ConstantWave>(&term.wave)) {
      constant += term.factor * given->value;
    } else if (const auto* one = std::get_if<PulseWave>(&term.wave); one != nullptr && pulse == nullptr) {
      pulse = one;
      factor = term.factor;
    } else {
      is_simple = false;
    }
  }
  if (is_simple && pulse == nullptr) {
    return ConstantWave{constant >= close || (constant > open && model.starts_closed) ? 1.0 : 0.0};
  }
  if (is_simple) {
    const PulseWave moved = Moved(*pulse, factor, constant);
    if (moved.low != moved.high) return GateOfPulse(moved, close, open, model.starts_closed);
    return ConstantWave{moved.low >= close || (moved.low > open && model.starts_closed) ? 1.0 : 0.0};
  }

  bool starts_above_close = false, starts_above_open = false;
  auto closing = CrossingsOf(control, close, horizon, starts_above_close);
  if (!closing.ok()) return closing.status();
  const auto opening = open == close ? closing : CrossingsOf(control, open, horizon, starts_above_open);
  if (!opening.ok()) return opening.status();
  if (open == close) starts_above_open = starts_above_close;
  std::vector<Crossing> changes;
  std::copy_if(closing->begin(), closing->end(), std::back_inserter(changes),
               [](const Crossing& c) { return c.rises; });
  std::copy_if(opening->begin(), opening->end(), std::back_inserter(changes),
               [](const Crossing& c) { return !c.rises; });
  std::stable_sort(changes.begin(), changes.end(),
                   [](const Crossing& a, const Crossing& b) { return a.time < b.time; });
  GateWave gate{.starts_closed = starts_above_close || (starts_above_open && model.starts_closed), .times = {}};
  bool closed = gate.starts_closed;
  for (const Crossing& change : changes) {
    if (change.rises == closed) continue;
    closed = change.rises;
    gate.times.push_back(change.time);
  }
  return gate;
}

}  // namespace dlcs
