// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/deck_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "client/netlist/deck_words.h"

namespace dlcs::client {
namespace {

constexpr std::size_t kMaxPoints = 10'000;

absl::Status TooMany(const std::string& place) {
  return DeckError(place, fmt::format("more than {} points of .step", kMaxPoints));
}

// From `first` to `last` by `step`, the last one where rounding misses it by a little.
bool AddLine(double first, double last, double step, std::vector<double>& values) {
  const double count = std::floor((last - first) / step * (1 + 1e-12) + 1e-9);
  if (!(count >= 0) || !(count < kMaxPoints)) return false;
  for (std::size_t k = 0; k <= static_cast<std::size_t>(count); ++k) {
    values.push_back(first + static_cast<double>(k) * step);
  }
  return true;
}

// `points` for each factor of `base`, from `first` up to `last`.
bool AddPowers(double first, double last, double points, double base, std::vector<double>& values) {
  std::vector<double> exponents;
  if (!AddLine(0, std::log(last / first) / std::log(base) * points, 1, exponents)) return false;
  for (const double exponent : exponents) values.push_back(first * std::pow(base, exponent / points));
  return true;
}

}  // namespace

absl::StatusOr<ParameterStep> ReadStep(const DeckLine& line, ParameterScope& scope, DeckNotes& notes) {
  constexpr const char* kForm =
      ".step is written .step param NAME FIRST LAST STEP, .step param NAME list VALUE ..., or .step dec param NAME "
      "FIRST LAST POINTS (or oct)";
  const std::vector<DeckWord> words = WordsOf(line);
  std::size_t k = 1;
  const auto word = [&](std::size_t at) { return at < words.size() ? Lower(words[at].text) : std::string(); };
  std::string scale = "lin";
  if (word(k) == "lin" || word(k) == "dec" || word(k) == "oct") scale = word(k++);
  if (word(k) != "param") return DeckError(line.Place(words[std::min(k, words.size() - 1)].offset), kForm);
  ++k;
  if (k >= words.size()) return DeckError(line.Place(), kForm);
  ParameterStep step;
  step.name = word(k);
  step.shown = words[k++].text;
  // LTspice has the scale here too.
  if (word(k) == "lin" || word(k) == "dec" || word(k) == "oct") scale = word(k++);
  const bool is_list = word(k) == "list";
  if (is_list) ++k;
  std::vector<double> numbers;
  for (; k < words.size(); ++k) {
    const auto value = ValueOf(line, words[k], scope, notes);
    if (!value.ok()) return value.status();
    numbers.push_back(*value);
  }
  if (is_list) {
    if (numbers.empty()) return DeckError(line.Place(), kForm);
    if (numbers.size() > kMaxPoints) return TooMany(line.Place());
    step.values = std::move(numbers);
    return step;
  }
  if (numbers.size() != 3) return DeckError(line.Place(), kForm);
  const auto [first, last, by] = std::array<double, 3>{numbers[0], numbers[1], numbers[2]};
  if (scale == "lin") {
    if (by == 0 || (last - first) / by < 0) {
      return DeckError(line.Place(), fmt::format("steps of {:g} do not lead from {:g} to {:g}", by, first, last));
    }
    return AddLine(first, last, by, step.values) ? absl::StatusOr<ParameterStep>(step) : TooMany(line.Place());
  }
  if (!(first > 0) || !(last >= first) || !(by > 0)) {
    return DeckError(line.Place(), fmt::format("{} takes 0 < FIRST <= LAST and a number of points above 0", scale));
  }
  const bool fits = AddPowers(first, last, by, scale == "dec" ? 10 : 2, step.values);
  return fits ? absl::StatusOr<ParameterStep>(step) : TooMany(line.Place());
}

absl::StatusOr<std::vector<SweepPoint>> PointsOf(const std::vector<ParameterStep>& steps) {
  std::vector<SweepPoint> points(1);
  for (auto step = steps.rbegin(); step != steps.rend(); ++step) {
    std::vector<SweepPoint> more;
    if (points.size() * step->values.size() > kMaxPoints) {
      return absl::InvalidArgumentError(fmt::format("more than {} points of .step", kMaxPoints));
    }
    for (const SweepPoint& point : points) {
      for (const double value : step->values) {
        SweepPoint& next = more.emplace_back(point);
        next.parameters[step->name] = value;
        next.label = fmt::format("{}={:g}{}{}", step->shown, value, point.label.empty() ? "" : ", ", point.label);
      }
    }
    points = std::move(more);
  }
  return points;
}

}  // namespace dlcs::client
