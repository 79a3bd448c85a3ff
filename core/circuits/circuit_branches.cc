// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/circuit_branches.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>

#include "core/format_number.h"
#include "core/lcp/basis/tolerance.h"

namespace dlcs {
namespace {

// From here on a resistor counts as an off-resistance. A current that is the difference of two as large as the limit of
// a switch has an error of some 1e-12 of it, which must not become a voltage.
constexpr double kHighResistance = 1e5;  // ohms

// From the threshold of a switch without hysteresis to where it closes.
constexpr double kJustAbove = 1e-9;  // V or A

// What gives `on` ohms in parallel with `off` ohms, which are more.
double ChannelOf(double on, double off) { return on / (1 - on / off); }

class BranchMaker {
 public:
  BranchMaker(const Circuit& circuit, const std::vector<bool>& in_loop, const std::vector<Index>& ports)
      : circuit_(circuit), in_loop_(in_loop), ports_(ports) {
    made_.nodes = static_cast<Index>(circuit.nodes.size());
    made_.parts.resize(circuit.elements.size());
  }

  CircuitBranches Make() && {
    FindWindings();
    for (Index e = 0; e < static_cast<Index>(circuit_.elements.size()); ++e) Add(e);
    for (const CurrentControl& control : current_controls_) {
      for (const CircuitBranches::Part& part : made_.parts[AsSize(control.element)]) {
        made_.branches[AsSize(control.branch)].controls.push_back(
            {.factor = control.factor * part.sign, .branch = part.branch});
      }
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
        if (made_.windings[AsSize(e)].base != e) return;  // added with its base
        const Index branch = AddBranch({.plus = element.plus,
                                        .minus = element.minus,
                                        .role = BranchRole::kEither,
                                        .order = is_capacitor ? kCapacitorOrder : kLastOrder});
        made_.storages.push_back({e, branch, is_capacitor});
        AddPart(branch);
        return AddTransformer(e);
      }
      case ElementKind::kVoltageSource:
      case ElementKind::kCurrentSource: {
        const Index branch =
            AddSource(element.plus, element.minus, element.kind == ElementKind::kVoltageSource, element.source, 1);
        return AddPart(branch);
      }
      case ElementKind::kControlledVoltage:
      case ElementKind::kControlledCurrent:
        return AddControlledElement(element);
      case ElementKind::kDiode:
        return AddDiode(element, element.plus, element.minus, element.diode, element.name);
      case ElementKind::kSwitch:
        return AddSwitch(element);
    }
  }

  Index AddBranch(const Branch& branch) {
    made_.branches.push_back(branch);
    made_.element_of.push_back(element_);
    return static_cast<Index>(made_.branches.size()) - 1;
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

  // The sum of `controls` as the voltage or the current of a branch.
  Index AddControlled(Index plus, Index minus, bool is_voltage, const std::vector<Control>& controls) {
    const Index branch =
        AddBranch({.plus = plus,
                   .minus = minus,
                   .role = is_voltage ? BranchRole::kControlledVoltage : BranchRole::kControlledCurrent,
                   .order = is_voltage ? kControlledOrder : kLastOrder + 1});
    for (const Control& control : controls) {
      if (control.element >= 0) {
        current_controls_.push_back({branch, control.factor, control.element});
      } else {
        made_.branches.back().controls.push_back(
            {.factor = control.factor, .plus = control.plus, .minus = control.minus});
      }
    }
    return branch;
  }

  void AddControlledElement(const Element& element) {
    std::vector<Control> controls = element.controls;
    double constant = element.value;
    if (element.transfer) {
      controls = AddTransfer(element, *element.transfer);
      constant = element.transfer->y.front();
    }
    if (element.kind == ElementKind::kControlledCurrent) {
      AddPart(AddControlled(element.plus, element.minus, false, controls));
      if (constant != 0) AddPart(AddSource(element.plus, element.minus, false, ConstantWave{constant}, 1));
      return;
    }
    Index start = element.plus;
    if (constant != 0) {
      start = NewNode();
      AddSource(element.plus, start, true, ConstantWave{constant}, 1);
    }
    AddPart(AddControlled(start, element.minus, true, controls));
  }

  // The terms of transfer(e) - transfer.y[0], with e the sum of the controls of `element`.
  std::vector<Control> AddTransfer(const Element& element, const PiecewiseLinear& transfer) {
    std::vector<Control> terms;
    const auto add = [&](double at, double slope, double low, double high, double sign) {
      const auto number = std::to_string(terms.size() + 1);
      terms.push_back({.factor = sign,
                       .plus = AddClamp(element, element.controls, element.value - at, slope, low, high,
                                        element.name + "_" + number)});
    };
    if (transfer.slope_before != 0) {
      add(transfer.x.front(), std::abs(transfer.slope_before), -HUGE_VAL, 0, transfer.slope_before < 0 ? -1 : 1);
    }
    for (std::size_t k = 0; k + 1 < transfer.x.size(); ++k) {
      const double run = transfer.x[k + 1] - transfer.x[k], rise = transfer.y[k + 1] - transfer.y[k];
      if (rise != 0) add(transfer.x[k], std::abs(rise) / run, 0, std::abs(rise), rise < 0 ? -1 : 1);
    }
    if (transfer.slope_after != 0) {
      add(transfer.x.back(), std::abs(transfer.slope_after), 0, HUGE_VAL, transfer.slope_after < 0 ? -1 : 1);
    }
    return terms;
  }

  // A node whose voltage is slope (constant + the sum of `controls`), but between `low` and `high`. With an infinite
  // slope it is at a bound, or in between while the sum is 0.
  Index AddClamp(const Element& element, const std::vector<Control>& controls, double constant, double slope,
                 double low, double high, const std::string& name) {
    const Index node = NewNode();
    ClampBranches clamp{.element = element_,
                        .node = node,
                        .is_gate = element.kind == ElementKind::kSwitch,
                        .is_jump = !std::isfinite(slope)};
    AddControlled(0, node, false, controls);
    if (constant != 0) AddSource(0, node, false, ConstantWave{constant}, 1);
    if (std::isfinite(slope)) AddResistor(node, 0, slope, kResistorOrder);
    if (std::isfinite(low)) {
      clamp.low = static_cast<Index>(made_.diodes.size());
      AddOneWay(0, node, -low, 0, name + "_low");
    }
    if (std::isfinite(high)) {
      clamp.high = static_cast<Index>(made_.diodes.size());
      AddOneWay(node, 0, high, 0, name + "_high");
    }
    made_.clamps.push_back(clamp);
    return node;
  }

  // The first inductor of those that share all their flux carries it.
  void FindWindings() {
    const auto count = static_cast<Index>(circuit_.elements.size());
    for (Index e = 0; e < count; ++e) made_.windings.push_back({.base = e, .ratio = 1});
    std::vector<CircuitBranches::Winding>& windings = made_.windings;
    for (bool changed = true; changed;) {
      changed = false;
      for (const Coupling& coupling : circuit_.couplings) {
        if (std::abs(coupling.value) != 1) continue;
        for (const auto& [from, to] :
             {std::pair(coupling.first, coupling.second), std::pair(coupling.second, coupling.first)}) {
          if (windings[AsSize(from)].base >= windings[AsSize(to)].base) continue;
          const double ratio =
              coupling.value * std::sqrt(circuit_.elements[AsSize(to)].value / circuit_.elements[AsSize(from)].value);
          windings[AsSize(to)] = {windings[AsSize(from)].base, ratio * windings[AsSize(from)].ratio};
          changed = true;
        }
      }
    }
  }

  // The ideal transformer beside the inductor `base`: the voltages of its windings are as their ratios, and ratio times
  // current adds up to 0. One winding, the port, has its current from the others, those have their voltages from it.
  void AddTransformer(Index base) {
    std::vector<Index> windings;
    for (Index e = 0; e < static_cast<Index>(circuit_.elements.size()); ++e) {
      if (made_.windings[AsSize(e)].base == base) windings.push_back(e);
    }
    if (windings.size() < 2) return;
    const Index port = ports_.empty() ? base : ports_[AsSize(base)];
    const auto ratio = [&](Index e) { return made_.windings[AsSize(e)].ratio / made_.windings[AsSize(port)].ratio; };
    const Element& at_port = circuit_.elements[AsSize(port)];
    std::vector<BranchControl> currents;
    Index port_branch = 0;
    for (const Index e : windings) {
      const Element& element = circuit_.elements[AsSize(e)];
      element_ = e;
      const Index branch = e == port
                               ? AddControlled(element.plus, element.minus, false, {})
                               : AddControlled(element.plus, element.minus, true,
                                               {{.factor = ratio(e), .plus = at_port.plus, .minus = at_port.minus}});
      AddPart(branch);
      if (e == port) port_branch = branch;
      if (e != port) currents.push_back({.factor = -ratio(e), .branch = branch});
    }
    made_.branches[AsSize(port_branch)].controls = std::move(currents);
    element_ = base;
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

  void AddDiode(const Element& element, Index anode, Index cathode, const DiodeModel& model, const std::string& name) {
    const double sign = anode == element.plus ? 1 : -1;
    AddPart(AddOneWay(anode, cathode, model.forward, ChannelOf(model.on_resistance, model.off_resistance), name), sign);
    for (std::size_t k = 0; k < model.further.size(); ++k) {
      const auto& [forward, ohms] = model.further[k];
      AddPart(AddOneWay(anode, cathode, forward, ohms, name + "_" + std::to_string(k + 2)), sign);
    }
    if (std::isfinite(model.off_resistance)) {
      AddPart(AddResistor(anode, cathode, model.off_resistance, kHighOrder), sign);
    }
    if (model.breakdown) {
      AddPart(AddOneWay(cathode, anode, *model.breakdown, model.breakdown_resistance, name + "_breakdown"), -sign);
    }
  }

  void AddSwitch(const Element& element) {
    const SwitchModel& model = element.switching;
    const Control& first = element.controls.front();
    const bool is_one = !model.is_transistor && element.controls.size() == 1 && first.element < 0 && first.factor == 1;
    const bool forwards = is_one && first.plus == element.plus && first.minus == element.minus;
    const bool backwards = is_one && first.plus == element.minus && first.minus == element.plus;
    // Where it stays closed at a voltage that does not close it, it ignites, which no diode does.
    const bool ignites = model.hysteresis > 0 && model.threshold > model.hysteresis;
    if ((forwards || backwards) && !ignites) {
      made_.notes.push_back(element.name +
                            " is controlled by its own voltage, and is taken as a diode with a forward "
                            "voltage of " +
                            FormatNumber(model.threshold) + " V" +
                            (model.hysteresis != 0 ? "; its hysteresis is dropped" : ""));
      const DiodeModel diode = {
          .forward = model.threshold, .on_resistance = model.on_resistance, .off_resistance = model.off_resistance};
      return AddDiode(element, forwards ? element.plus : element.minus, forwards ? element.minus : element.plus, diode,
                      element.name);
    }
    const double channel = ChannelOf(model.on_resistance, model.off_resistance);
    const double limit = LargestCurrent(channel);
    made_.limits.push_back({element_, limit});
    Index start = element.plus;
    if (model.on_resistance > 0) {
      start = NewNode();
      AddPart(AddResistor(element.plus, start, channel, kResistorOrder));
    }
    const bool in_loop = !in_loop_.empty() && in_loop_[AsSize(element_)];
    const Index gate = in_loop ? AddGate(element) : -1;
    const auto add_supply = [&](Index plus, Index minus) {
      return in_loop ? AddControlled(plus, minus, false, {{.factor = limit, .plus = gate}})
                     : AddSource(plus, minus, false, ConstantWave{}, limit, /*is_gate=*/true);
    };
    const Index middle = NewNode();
    const Index back = AddIdealDiode(middle, start, element.name + "_forward", kValveOrder);
    const Index supply = add_supply(start, middle);
    AddIdealDiode(middle, element.minus, element.name + "_backward", kValveOrder);
    add_supply(element.minus, middle);
    if (!(model.on_resistance > 0)) {
      AddPart(back, -1);
      AddPart(supply);
    }
    if (std::isfinite(model.off_resistance)) {
      AddPart(AddResistor(element.plus, element.minus, model.off_resistance, kHighOrder));
    }
    if (element.body_diode) {
      const bool to_minus = element.body_points_to_minus;
      AddDiode(element, to_minus ? element.plus : element.minus, to_minus ? element.minus : element.plus,
               *element.body_diode, element.name + "_body");
    }
  }

  // The node whose voltage is the gate, 0 or 1 V, of a switch that the circuit controls.
  Index AddGate(const Element& element) {
    const SwitchModel& model = element.switching;
    std::vector<Control> controls = element.controls;
    if (model.hysteresis != 0) controls.push_back({.factor = 2 * model.hysteresis, .plus = made_.nodes});
    // Without hysteresis it is open at the threshold itself, where a comparator of 0 V may rest.
    const double level = model.threshold + (model.hysteresis != 0 ? model.hysteresis : kJustAbove);
    return AddClamp(element, controls, -level, std::numeric_limits<double>::infinity(), 0, 1, element.name + "_gate");
  }

  double LargestCurrent(double on_resistance) const {
    double volts = 0, amperes = 0;
    for (const Element& element : circuit_.elements) {
      if (element.kind == ElementKind::kVoltageSource) volts += Peak(element.source);
      if (element.kind == ElementKind::kCurrentSource) amperes += Peak(element.source);
      if (element.kind == ElementKind::kControlledVoltage) volts += LargestConstant(element);
      if (element.kind == ElementKind::kControlledCurrent) amperes += LargestConstant(element);
      const double initial = std::abs(element.initial.value_or(0));
      if (element.kind == ElementKind::kCapacitor) volts += initial;
      if (element.kind == ElementKind::kInductor) amperes += initial;
    }
    for (const NodeVoltage& given : circuit_.node_voltages) volts += std::abs(given.volts);
    constexpr double kShort = 1e-3;  // ohms, for switches without resistance
    const double limit = 2 * (volts / std::max(on_resistance, kShort) + amperes);
    return circuit_.current_limit * (limit > 0 ? limit : 1);
  }

  // What a controlled source gives without its controls, or at most where it is bounded.
  static double LargestConstant(const Element& element) {
    if (!element.transfer) return std::abs(element.value);
    double largest = 0;
    for (const double value : element.transfer->y) largest = std::max(largest, std::abs(value));
    return largest;
  }

  struct CurrentControl {
    Index branch;
    double factor;
    Index element;
  };

  const Circuit& circuit_;
  const std::vector<bool>& in_loop_;
  const std::vector<Index>& ports_;
  CircuitBranches made_;
  Index element_ = 0;
  std::vector<CurrentControl> current_controls_;
};

}  // namespace

CircuitBranches MakeBranches(const Circuit& circuit, const std::vector<bool>& in_loop,
                             const std::vector<Index>& ports) {
  return BranchMaker(circuit, in_loop, ports).Make();
}

void MakeReciprocal(const CircuitBranches& graph, const Vector& sign, Matrix& M) {
  const bool is_controlled = std::any_of(graph.branches.begin(), graph.branches.end(), [](const Branch& branch) {
    return branch.role == BranchRole::kControlledVoltage || branch.role == BranchRole::kControlledCurrent;
  });
  for (Index i = 0; i < M.rows(); ++i) {
    if (!is_controlled) M(i, i) = std::max(0.0, M(i, i));
    for (Index j = 0; j < i; ++j) {
      const double mirrored = sign[i] == sign[j] ? M(j, i) : -M(j, i);
      if (is_controlled && std::abs(M(i, j) - mirrored) > kLcpTolerance * (std::abs(M(i, j)) + std::abs(mirrored)))
        continue;
      M(i, j) = (M(i, j) + mirrored) / 2;
      M(j, i) = sign[i] == sign[j] ? M(i, j) : -M(i, j);
    }
  }
}

}  // namespace dlcs
