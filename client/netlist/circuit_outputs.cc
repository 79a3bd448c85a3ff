// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/circuit_outputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client/netlist/deck_lines.h"
#include "client/netlist/spice_expression.h"

namespace dlcs::client {
namespace {

// A factor may have a unit too, as that of 2*I(R1) for the voltage across 2 ohm.
OutputUnit UnitOf(const LinearValue& value) {
  const auto are_all = [&](const char* kind) {
    return std::ranges::all_of(
        value.factors, [&](const auto& term) { return term.first.starts_with(kind) && std::abs(term.second) == 1; });
  };
  if (value.factors.empty()) return OutputUnit::kOther;
  return are_all("v(") ? OutputUnit::kVolts : are_all("i(") ? OutputUnit::kAmperes : OutputUnit::kOther;
}

class OutputTable {
 public:
  explicit OutputTable(const CircuitOutputs& all) : all_(all) {
    for (std::size_t k = 0; k < all.names.size(); ++k) rows_.emplace(Lower(all.names[k]), static_cast<Index>(k));
  }

  // The index of the output with this value, which is added under `name` if it is new.
  Index Add(std::string name, const LinearValue& value) {
    const auto [place, is_new] =
        places_.emplace(std::pair(value.constant, value.factors), static_cast<Index>(values_.size()));
    if (!is_new) return place->second;
    const std::string first = name;
    for (int number = 2; !taken_.insert(name).second; ++number) name = fmt::format("{} #{}", first, number);
    names_.push_back(std::move(name));
    values_.push_back(value);
    return place->second;
  }
  Index Add(const std::string& name) { return Add(name, {0, {{Lower(name), 1}}}); }

  std::size_t size() const { return values_.size(); }

  std::vector<OutputUnit> Units() const {
    std::vector<OutputUnit> units;
    for (const LinearValue& value : values_) units.push_back(UnitOf(value));
    return units;
  }

  // Under its own name where it is a voltage or a current alone.
  Index AddAs(const std::string& text, const LinearValue& value) {
    const bool is_alone = value.constant == 0 && value.factors.size() == 1 && value.factors.begin()->second == 1;
    const Index row = is_alone ? RowOf(value.factors.begin()->first) : -1;
    if (row >= 0) return Add(all_.names[static_cast<std::size_t>(row)], value);
    return Add(is_alone ? value.factors.begin()->first : text, value);
  }

  Outputs Make(std::size_t shown) && {
    const auto count = static_cast<Index>(values_.size());
    Matrix rows = Matrix::Zero(count, static_cast<Index>(all_.names.size()));
    Vector constants = Vector::Zero(count);
    for (Index k = 0; k < count; ++k) {
      const LinearValue& value = values_[static_cast<std::size_t>(k)];
      constants[k] = value.constant;
      for (const auto& [name, factor] : value.factors) AddTo(rows, k, name, factor);
    }
    Outputs outputs = CombinedOutputs(all_, rows, constants);
    outputs.hidden = count - static_cast<Index>(shown);
    outputs.names = std::move(names_);
    return outputs;
  }

 private:
  // -1 for ground.
  Index RowOf(const std::string& lower) const {
    const auto found = rows_.find(lower);
    return found == rows_.end() ? -1 : found->second;
  }

  // factor · quantity, of which v(a,b) is a difference.
  void AddTo(Matrix& rows, Index k, const std::string& quantity, double factor) const {
    const std::size_t comma = quantity.find(',');
    if (comma == std::string::npos) {
      if (const Index row = RowOf(quantity); row >= 0) rows(k, row) += factor;
      return;
    }
    AddTo(rows, k, quantity.substr(0, comma) + ")", factor);
    AddTo(rows, k, "v(" + quantity.substr(comma + 1), -factor);
  }

  const CircuitOutputs& all_;
  std::map<std::string, Index> rows_;  // of `all_`, by name in small letters
  std::map<std::pair<double, std::map<std::string, double>>, Index> places_;
  std::set<std::string> taken_;
  std::vector<std::string> names_;
  std::vector<LinearValue> values_;
};

std::vector<Index> IndicesOf(const DeckQuantity& quantity, OutputTable& table) {
  std::vector<Index> indices;
  for (const LinearValue& factor : quantity.factors) {
    const bool is_whole = quantity.factors.size() == 1;
    indices.push_back(
        table.AddAs(is_whole ? quantity.text : fmt::format("{}[{}]", quantity.text, indices.size()), factor));
  }
  return indices;
}

}  // namespace

std::vector<OutputUnit> SetOutputs(const Deck& deck, CircuitProblem& made) {
  OutputTable table(made.outputs);
  for (const DeckQuantity& quantity : deck.outputs) table.AddAs(quantity.text, quantity.factors[0]);
  if (deck.outputs.empty()) {
    for (const std::string& name : made.outputs.names) table.Add(name);
  }
  const std::size_t shown = table.size();
  std::vector<OutputUnit> units = table.Units();
  std::vector<OutputLimit> limits;
  for (const CurrentLimit& limit : made.limits) limits.push_back({table.Add(limit.output), limit.amperes});
  std::vector<Measurement> measurements;
  for (const DeckMeasurement& one : deck.measurements) {
    Measurement& measurement = measurements.emplace_back(one.measurement);
    measurement.outputs = IndicesOf(one.measured, table);
    if (measurement.at) measurement.at->outputs = IndicesOf(one.at, table);
    if (measurement.until) measurement.until->outputs = IndicesOf(one.until, table);
  }
  made.problem.outputs = std::move(table).Make(shown);
  made.problem.outputs.limits = std::move(limits);
  made.problem.measurements = std::move(measurements);
  return units;
}

}  // namespace dlcs::client
