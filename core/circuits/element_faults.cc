// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/element_faults.h"

#include <cmath>
#include <string>

#include "core/circuits/circuit_names.h"
#include "core/format_number.h"

namespace dlcs {
namespace {

std::string FaultOfElement(const Element& element) {
  const auto must_be_positive = [&](const char* what, const char* unit) -> std::string {
    if (std::isfinite(element.value) && element.value > 0) return "";
    return std::string(what) + " of " + NumberText(element.value) + " " + unit + "; must be above 0";
  };
  switch (element.kind) {
    case ElementKind::kResistor:
      return must_be_positive("a resistance", "ohm");
    case ElementKind::kCapacitor:
      return must_be_positive("a capacitance", "F");
    case ElementKind::kInductor:
      return must_be_positive("an inductance", "H");
    case ElementKind::kVoltageSource:
    case ElementKind::kCurrentSource:
      return FaultOf(element.source);
    case ElementKind::kDiode: {
      const DiodeModel& diode = element.diode;
      if (!std::isfinite(diode.forward)) return "a forward voltage of " + NumberText(diode.forward) + " V";
      if (!(diode.on_resistance >= 0) || !std::isfinite(diode.on_resistance)) {
        return "an on-resistance of " + NumberText(diode.on_resistance) + " ohm; must be at least 0";
      }
      if (!(diode.off_resistance > 0)) {
        return "an off-resistance of " + NumberText(diode.off_resistance) + " ohm; must be above 0";
      }
      if (diode.breakdown && !(*diode.breakdown > 0)) {
        return "a breakdown voltage of " + NumberText(*diode.breakdown) + " V; must be above 0";
      }
      return "";
    }
    case ElementKind::kSwitch: {
      const SwitchModel& model = element.switching;
      if (!(model.on_resistance >= 0) || !std::isfinite(model.on_resistance)) {
        return "an on-resistance of " + NumberText(model.on_resistance) + " ohm; must be at least 0";
      }
      if (!(model.off_resistance > model.on_resistance)) {
        return "an off-resistance of " + NumberText(model.off_resistance) + " ohm; must be above the on-resistance";
      }
      if (!(model.hysteresis >= 0)) {
        return "a hysteresis of " + NumberText(model.hysteresis) +
               "; must be at least 0 (a smooth transition is not supported)";
      }
      return std::isfinite(model.threshold) ? "" : "the threshold is not finite";
    }
    default:
      return std::isfinite(element.value) ? "" : "the gain is not finite";
  }
}

}  // namespace

absl::Status CheckElements(const Circuit& circuit) {
  for (const Element& element : circuit.elements) {
    if (const std::string fault = FaultOfElement(element); !fault.empty()) {
      return absl::InvalidArgumentError(WithPlace(element) + ": " + fault);
    }
    if (element.initial && !std::isfinite(*element.initial)) {
      return absl::InvalidArgumentError(WithPlace(element) + ": IC is not finite");
    }
  }
  for (const Coupling& coupling : circuit.couplings) {
    if (std::abs(coupling.value) > 0 && std::abs(coupling.value) < 1) continue;
    return absl::InvalidArgumentError(
        coupling.name + ": a coupling of " + NumberText(coupling.value) +
        "; must be between 0 and 1 in size, without 0 and 1. A coupling of 1 makes the currents of the inductors "
        "dependent, which is not supported: 0.9999 leaves a leakage");
  }
  return absl::OkStatus();
}

}  // namespace dlcs
