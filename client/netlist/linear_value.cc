// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/linear_value.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <utility>

#include "core/circuits/waveform.h"

namespace dlcs::client {

bool IsOfTime(const LinearValue& value) { return value.factors.empty() && !value.of_time.empty(); }

std::string TextOf(const LinearValue& value) {
  const std::string constant = fmt::format("{}", value.constant);
  if (value.of_time.empty()) return "(" + constant + ")";
  return value.constant == 0 ? "(" + value.of_time + ")" : "(" + constant + " + " + value.of_time + ")";
}

LinearValue Sum(LinearValue value, const LinearValue& other, double factor) {
  value.constant += factor * other.constant;
  for (const auto& [name, part] : other.factors) value.factors[name] += factor * part;
  if (!other.of_time.empty()) {
    const std::string term = factor == 1 ? other.of_time : fmt::format("({})*({})", factor, other.of_time);
    value.of_time += (value.of_time.empty() ? "" : " + ") + term;
  }
  value.is_truth = false;
  return value;
}

LinearValue Minus(const LinearValue& value, const LinearValue& other) { return Sum(value, other, -1); }

LinearValue Times(LinearValue value, double factor) {
  value.constant *= factor;
  for (auto& [name, part] : value.factors) part *= factor;
  if (!value.of_time.empty()) value.of_time = fmt::format("({})*({})", factor, value.of_time);
  value.is_truth = false;
  return value;
}

double ValueAt(const PiecewiseLinear& function, double x) {
  if (x <= function.x.front()) return function.y.front() + function.slope_before * (x - function.x.front());
  for (std::size_t k = 1; k < function.x.size(); ++k) {
    if (x > function.x[k]) continue;
    const double run = function.x[k] - function.x[k - 1];
    return function.y[k - 1] + (function.y[k] - function.y[k - 1]) * (x - function.x[k - 1]) / run;
  }
  return function.y.back() + function.slope_after * (x - function.x.back());
}

PiecewiseLinear PartAboveZero(PiecewiseLinear function, double slope, double constant) {
  if (slope < 0) {
    std::reverse(function.x.begin(), function.x.end());
    std::reverse(function.y.begin(), function.y.end());
    for (double& x : function.x) x = -x;
    function.slope_before = -std::exchange(function.slope_after, -function.slope_before);
    return PartAboveZero(std::move(function), -slope, -constant);
  }
  const std::size_t points = function.x.size();
  std::size_t next = 0;  // the first point beyond the constant
  while (next < points && function.x[next] <= constant) ++next;
  double start = 0;  // the value just beyond it
  if (next == 0) {
    start = function.y[0] + function.slope_before * (constant - function.x[0]);
  } else if (next == points) {
    start = function.y.back() + function.slope_after * (constant - function.x.back());
  } else {
    const double part = (constant - function.x[next - 1]) / (function.x[next] - function.x[next - 1]);
    start = function.y[next - 1] + part * (function.y[next] - function.y[next - 1]);
  }
  PiecewiseLinear made{.x = {0, 0}, .y = {0, start}, .slope_after = slope * function.slope_after};
  for (; next < points; ++next) {
    made.x.push_back((function.x[next] - constant) / slope);
    made.y.push_back(function.y[next]);
  }
  return made;
}

std::string TextOf(const PiecewiseLinear& function, const std::string& x) {
  std::string text = fmt::format("{} + {}", function.y.front(), LinesText(function.x, function.y, x));
  if (function.slope_before != 0) {
    text += fmt::format(" + ({})*min(0, {} - ({}))", function.slope_before, x, function.x.front());
  }
  if (function.slope_after != 0) {
    text += fmt::format(" + ({})*max(0, {} - ({}))", function.slope_after, x, function.x.back());
  }
  return text;
}

}  // namespace dlcs::client
