// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/circuit_branches.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/format_number.h"

namespace dlcs {
namespace {

// From here on a resistor counts as an off-resistance. A current that is the difference of two as large as the limit of
// a switch has an error of some 1e-12 of it, which must not become a voltage.
constexpr double kHighResistance = 1e5;  // ohms

class BranchMaker {
 public:
  explicit BranchMaker(const Circuit& circuit) : circuit_(circuit) {
    made_.nodes = static_cast<Index>(circuit.nodes.size());
    made_.parts.resize(circuit.elements.size());
    first_branch_.assign(circuit.elements.size(), -1);
  }

  CircuitBranches Make() && {
    for (Index e = 0; e < static_cast<Index>(circuit_.elements.size()); ++e) Add(e);
    for (const auto& [branch, element] : controlled_by_) {
      made_.branches[AsSize(branch)].control_branch = first_branch_[AsSize(element)];
    }
    return std::move(made_);
  }

 private:
  void Add(Index e) {
    const Element& element = circuit_.elements[AsSize(e)];
    element_ = e;
    switch (element.kind) {
      case ElementKind::kResistor:
        return AddPart(AddResistor(element.plus, element.minus, element.value,
                                   element.value < kHighResistance ? kResistorOrder : kHighOrder));
      case ElementKind::kCapacitor:
      case ElementKind::kInductor: {
        const bool is_capacitor = element.kind == ElementKind::kCapacitor;
        const Index branch = AddBranch({.plus = element.plus,
                                        .minus = element.minus,
                                        .role = BranchRole::kEither,
                                        .order = is_capacitor ? kCapacitorOrder : kLastOrder});
        made_.storages.push_back({e, branch, is_capacitor});
        return AddPart(branch);
      }
      case ElementKind::kVoltageSource:
      case ElementKind::kCurrentSource: {
        const Index branch =
            AddSource(element.plus, element.minus, element.kind == ElementKind::kVoltageSource, element.source, 1);
        return AddPart(branch);
      }
      case ElementKind::kVcvs:
      case ElementKind::kVccs:
      case ElementKind::kCcvs:
      case ElementKind::kCccs:
        return AddPart(AddControlled(element));
      case ElementKind::kDiode:
        return AddDiode(element, element.plus, element.minus, element.diode);
      case ElementKind::kSwitch:
        return AddSwitch(element);
    }
  }

  Index AddBranch(const Branch& branch) {
    made_.branches.push_back(branch);
    made_.element_of.push_back(element_);
    const auto index = static_cast<Index>(made_.branches.size()) - 1;
    if (first_branch_[AsSize(element_)] < 0) first_branch_[AsSize(element_)] = index;
    return index;
  }

  void AddPart(Index branch, double sign = 1) { made_.parts[AsSize(element_)].push_back({branch, sign}); }

  Index AddResistor(Index plus, Index minus, double ohms, int order) {
    return AddBranch({.plus = plus, .minus = minus, .role = BranchRole::kResistor, .order = order, .resistance = ohms});
  }

  Index AddSource(Index plus, Index minus, bool is_voltage, const Waveform& wave, double scale, bool is_gate = false) {
    const Index branch = AddBranch({.plus = plus,
                                    .minus = minus,
                                    .role = is_voltage ? BranchRole::kVoltage : BranchRole::kCurrent,
                                    .order = is_voltage ? kSourceOrder : kLastOrder + 1});
    made_.sources.push_back({element_, branch, scale, wave, is_gate});
    return branch;
  }

  Index AddControlled(const Element& element) {
    const bool is_voltage = element.kind == ElementKind::kVcvs || element.kind == ElementKind::kCcvs;
    const Index branch =
        AddBranch({.plus = element.plus,
                   .minus = element.minus,
                   .role = is_voltage ? BranchRole::kControlledVoltage : BranchRole::kControlledCurrent,
                   .order = is_voltage ? kControlledOrder : kLastOrder + 1,
                   .gain = element.value,
                   .control_plus = element.control_plus,
                   .control_minus = element.control_minus});
    if (element.control_element >= 0) controlled_by_.emplace_back(branch, element.control_element);
    return branch;
  }

  Index NewNode() { return made_.nodes++; }

  // From `anode` to `cathode` in series: a voltage, a resistance, an ideal diode. Returns the ideal diode.
  Index AddOneWay(Index anode, Index cathode, double forward, double ohms, const std::string& name) {
    if (forward != 0) {
      const Index inner = NewNode();
      AddSource(anode, inner, true, ConstantWave{forward}, 1);
      anode = inner;
    }
    if (ohms > 0) {
      const Index inner = NewNode();
      AddResistor(anode, inner, ohms, kResistorOrder);
      anode = inner;
    }
    return AddIdealDiode(anode, cathode, name);
  }

  Index AddIdealDiode(Index anode, Index cathode, const std::string& name, int order = kDiodeOrder) {
    const Index branch = AddBranch({.plus = anode, .minus = cathode, .role = BranchRole::kEither, .order = order});
    made_.diodes.push_back({element_, branch, name});
    return branch;
  }

  void AddDiode(const Element& element, Index anode, Index cathode, const DiodeModel& model) {
    const double sign = anode == element.plus ? 1 : -1;
    AddPart(AddOneWay(anode, cathode, model.forward, model.on_resistance, element.name), sign);
    if (std::isfinite(model.off_resistance)) {
      AddPart(AddResistor(anode, cathode, model.off_resistance, kHighOrder), sign);
    }
    if (model.breakdown) {
      AddPart(AddOneWay(cathode, anode, *model.breakdown, model.breakdown_resistance, element.name + "_breakdown"),
              -sign);
    }
  }

  void AddSwitch(const Element& element) {
    const SwitchModel& model = element.switching;
    const bool forwards = element.control_plus == element.plus && element.control_minus == element.minus;
    const bool backwards = element.control_plus == element.minus && element.control_minus == element.plus;
    if (element.control_element < 0 && (forwards || backwards)) {
      made_.notes.push_back(element.name +
                            " is controlled by its own voltage, and is taken as a diode with a forward "
                            "voltage of " +
                            FormatNumber(model.threshold) + " V" +
                            (model.hysteresis != 0 ? "; its hysteresis is dropped" : ""));
      const DiodeModel diode = {
          .forward = model.threshold, .on_resistance = model.on_resistance, .off_resistance = model.off_resistance};
      return AddDiode(element, forwards ? element.plus : element.minus, forwards ? element.minus : element.plus, diode);
    }
    const double limit = LargestCurrent(model.on_resistance);
    made_.limits.push_back({element_, limit});
    Index start = element.plus;
    if (model.on_resistance > 0) {
      start = NewNode();
      AddPart(AddResistor(element.plus, start, model.on_resistance, kResistorOrder));
    }
    const Index middle = NewNode();
    const Index back = AddIdealDiode(middle, start, element.name + "_forward", kValveOrder);
    const Index supply = AddSource(start, middle, false, ConstantWave{}, limit, /*is_gate=*/true);
    AddIdealDiode(middle, element.minus, element.name + "_backward", kValveOrder);
    AddSource(element.minus, middle, false, ConstantWave{}, limit, /*is_gate=*/true);
    if (!(model.on_resistance > 0)) {
      AddPart(back, -1);
      AddPart(supply);
    }
    if (std::isfinite(model.off_resistance)) {
      AddPart(AddResistor(element.plus, element.minus, model.off_resistance, kHighOrder));
    }
  }

  double LargestCurrent(double on_resistance) const {
    double volts = 0, amperes = 0;
    for (const Element& element : circuit_.elements) {
      if (element.kind == ElementKind::kVoltageSource) volts += Peak(element.source);
      if (element.kind == ElementKind::kCurrentSource) amperes += Peak(element.source);
      const double initial = std::abs(element.initial.value_or(0));
      if (element.kind == ElementKind::kCapacitor) volts += initial;
      if (element.kind == ElementKind::kInductor) amperes += initial;
    }
    for (const NodeVoltage& given : circuit_.node_voltages) volts += std::abs(given.volts);
    constexpr double kShort = 1e-3;  // ohms, for switches without resistance
    const double limit = 2 * (volts / std::max(on_resistance, kShort) + amperes);
    return limit > 0 ? limit : 1;
  }

  const Circuit& circuit_;
  CircuitBranches made_;
  Index element_ = 0;
  std::vector<Index> first_branch_;
  std::vector<std::pair<Index, Index>> controlled_by_;
};

}  // namespace

CircuitBranches MakeBranches(const Circuit& circuit) { return BranchMaker(circuit).Make(); }

}  // namespace dlcs
