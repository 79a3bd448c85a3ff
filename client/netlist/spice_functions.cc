// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/spice_functions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace dlcs::client {

const SpiceFunction* FindSpiceFunction(const std::string& name) {
  constexpr std::size_t kAny = 1000;
  using Values = const std::vector<double>&;
  static const std::map<std::string, SpiceFunction> kFunctions = {
      {"sin", {1, 1, [](Values v) { return std::sin(v[0]); }}},
      {"cos", {1, 1, [](Values v) { return std::cos(v[0]); }}},
      {"tan", {1, 1, [](Values v) { return std::tan(v[0]); }}},
      {"asin", {1, 1, [](Values v) { return std::asin(v[0]); }}},
      {"acos", {1, 1, [](Values v) { return std::acos(v[0]); }}},
      {"atan", {1, 1, [](Values v) { return std::atan(v[0]); }}},
      {"atan2", {2, 2, [](Values v) { return std::atan2(v[0], v[1]); }}},
      {"sinh", {1, 1, [](Values v) { return std::sinh(v[0]); }}},
      {"cosh", {1, 1, [](Values v) { return std::cosh(v[0]); }}},
      {"tanh", {1, 1, [](Values v) { return std::tanh(v[0]); }}},
      {"exp", {1, 1, [](Values v) { return std::exp(v[0]); }}},
      {"ln", {1, 1, [](Values v) { return std::log(v[0]); }}},
      {"log", {1, 1, [](Values v) { return std::log(v[0]); }}},
      {"log10", {1, 1, [](Values v) { return std::log10(v[0]); }}},
      {"sqrt", {1, 1, [](Values v) { return std::sqrt(v[0]); }}},
      {"abs", {1, 1, [](Values v) { return std::abs(v[0]); }}},
      {"floor", {1, 1, [](Values v) { return std::floor(v[0]); }}},
      {"ceil", {1, 1, [](Values v) { return std::ceil(v[0]); }}},
      {"int", {1, 1, [](Values v) { return std::trunc(v[0]); }}},
      {"sgn", {1, 1, [](Values v) { return v[0] > 0   ? 1.0
                                           : v[0] < 0 ? -1.0
                                                      : 0.0; }}},
      {"sqr", {1, 1, [](Values v) { return v[0] * v[0]; }}},
      {"square", {1, 1, [](Values v) { return v[0] * v[0]; }}},
      {"hypot", {2, 2, [](Values v) { return std::hypot(v[0], v[1]); }}},
      {"round", {1, 1, [](Values v) { return std::round(v[0]); }}},
      {"pow", {2, 2, [](Values v) { return std::pow(v[0], v[1]); }}},
      {"min", {1, kAny, [](Values v) { return *std::min_element(v.begin(), v.end()); }}},
      {"max", {1, kAny, [](Values v) { return *std::max_element(v.begin(), v.end()); }}},
      {"limit", {3, 3, [](Values v) { return std::max(std::min(v[1], v[2]), std::min(v[0], std::max(v[1], v[2]))); }}},
      {"if", {3, 3, [](Values v) { return v[0] != 0 ? v[1] : v[2]; }}}};
  const auto found = kFunctions.find(name);
  return found == kFunctions.end() ? nullptr : &found->second;
}

std::optional<std::string> FormulaOfCall(const std::string& name, const std::vector<LinearValue>& arguments) {
  static const std::map<std::string, std::string> kNames = {
      {"ln", "log"},  {"log", "log"},   {"log10", "log10"}, {"sqrt", "sqrt"}, {"abs", "abs"},   {"floor", "floor"},
      {"sin", "sin"}, {"cos", "cos"},   {"tan", "tan"},     {"asin", "asin"}, {"acos", "acos"}, {"atan", "atan"},
      {"exp", "exp"}, {"sinh", "sinh"}, {"cosh", "cosh"},   {"tanh", "tanh"}, {"ceil", "ceil"}, {"sgn", "sign"}};
  if (std::any_of(arguments.begin(), arguments.end(), [](const auto& one) { return !one.factors.empty(); })) {
    return std::nullopt;
  }
  const std::string first = TextOf(arguments[0]);
  if (arguments.size() == 1) {
    if (name == "int") return fmt::format("sign({0})*floor(abs({0}))", first);
    if (name == "sqr" || name == "square") return fmt::format("{0}*{0}", first);
    if (const auto found = kNames.find(name); found != kNames.end()) return found->second + first;
  }
  if (name == "pow" && arguments.size() == 2) return first + "**" + TextOf(arguments[1]);
  if (name == "limit" && arguments.size() == 3) {
    const std::string one = TextOf(arguments[1]), other = TextOf(arguments[2]);
    return fmt::format("max(min({1}, {2}), min({0}, max({1}, {2})))", first, one, other);
  }
  if (name != "min" && name != "max") return std::nullopt;
  std::string text = name + "(" + first;
  for (std::size_t k = 1; k < arguments.size(); ++k) text += ", " + TextOf(arguments[k]);
  return text + ")";
}

}  // namespace dlcs::client
