// SPDX-License-Identifier: Apache-2.0
// A circuit of linear elements, independent sources, ideal diodes and switches, as data.

#ifndef DLCS_CORE_CIRCUITS_CIRCUIT_H_
#define DLCS_CORE_CIRCUITS_CIRCUIT_H_

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/circuits/waveform.h"
#include "core/types.h"

namespace dlcs {

enum class ElementKind {
  kResistor,           // value: ohms, above 0
  kCapacitor,          // value: farads, above 0
  kInductor,           // value: henries, above 0
  kVoltageSource,      // source: volts
  kCurrentSource,      // source: amperes
  kControlledVoltage,  // voltage = transfer(value + the sum of controls)
  kControlledCurrent,  // current = transfer(value + the sum of controls)
  kDiode,              // from plus (anode) to minus (cathode)
  kSwitch,             // closed or open, depending on the sum of controls
};

// factor times the voltage between two nodes or, if `element` is set, times the current of that element.
struct Control {
  double factor = 1;
  Index plus = 0, minus = 0;  // nodes
  Index element = -1;
};

// Straight lines through points; slopes are given before the first and after the last. Two points at one x: a jump.
struct PiecewiseLinear {
  std::vector<double> x;  // not decreasing
  std::vector<double> y;
  double slope_before = 0, slope_after = 0;
};

// Piecewise linear: `off_resistance` below `forward`, then `on_resistance`, in parallel with further ones at higher
// voltages. With `breakdown` the same in reverse direction.
struct DiodeModel {
  double forward = 0;        // V
  double on_resistance = 0;  // ohms, >= 0
  struct Further {
    double forward = 0;        // V
    double on_resistance = 0;  // ohms, > 0, in parallel with the others
  };
  std::vector<Further> further = {};
  double off_resistance = std::numeric_limits<double>::infinity();  // above `on_resistance`
  std::optional<double> breakdown = {};                             // V, > 0
  double breakdown_resistance = 0;                                  // ohms, >= 0
};

// Closes where its control rises above threshold + hysteresis, opens where it falls below threshold - hysteresis.
struct SwitchModel {
  double threshold = 0;   // V or A
  double hysteresis = 0;  // >= 0
  double on_resistance = 1;
  double off_resistance = std::numeric_limits<double>::infinity();  // above `on_resistance`
  bool starts_closed = false;                                       // used if the control starts between the two levels
  bool is_transistor = false;  // its gate may be driven by sources and comparators only
};

struct Element {
  std::string name;  // as the user wrote it, unique without regard to case
  ElementKind kind = ElementKind::kResistor;
  Index plus = 0, minus = 0;  // nodes; the current flows from plus through the element to minus
  double value = 0;
  std::optional<double> initial = {};  // V or A at 0, of capacitors and inductors
  Waveform source = {};
  std::vector<Control> controls = {};            // of controlled sources and switches
  std::optional<PiecewiseLinear> transfer = {};  // of controlled sources; none is the identity
  DiodeModel diode = {};
  SwitchModel switching = {};
  std::optional<DiodeModel> body_diode = {};  // across a switch, from minus to plus
  bool body_points_to_minus = false;          // from plus to minus instead
  std::string place = {};                     // file and line, as in "buck.cir:7"; empty if unknown
};

inline bool MayBlock(const Element& element) {
  return element.kind == ElementKind::kDiode || element.kind == ElementKind::kSwitch;
}

// Inductors `first` and `second` share flux: mutual inductance value √(L1 L2), 0 < |value| <= 1.
struct Coupling {
  std::string name;
  Index first = 0, second = 0;
  double value = 0;
};

// V(node) = volts at 0.
struct NodeVoltage {
  Index node = 0;
  double volts = 0;
};

struct Circuit {
  std::vector<std::string> nodes;  // [0] is ground
  std::vector<Element> elements;
  std::vector<Coupling> couplings;
  double horizon = 0;  // s, > 0
  // The start: the operating point at 0 with these node voltages. With `uses_initial_conditions`: `initial` of the
  // elements; if that is not set, the difference of given node voltages; else 0.
  std::vector<NodeVoltage> node_voltages;
  bool uses_initial_conditions = false;
  double current_limit = 1;  // > 0, times the largest currents of switches that MakeBranches() takes
};

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_CIRCUIT_H_
