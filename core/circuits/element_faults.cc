// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/element_faults.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/circuits/circuit_names.h"
#include "core/format_number.h"
#include "core/lcp/basis/tolerance.h"

namespace dlcs {
namespace {

std::string FaultOfControlled(const Element& element) {
  if (!std::isfinite(element.value)) return "the constant is not finite";
  for (const Control& control : element.controls) {
    if (!std::isfinite(control.factor)) return "the gain is not finite";
  }
  if (!element.transfer) return "";
  const auto& [x, y, slope_before, slope_after] = *element.transfer;
  const auto is_finite = [](double value) { return std::isfinite(value); };
  if (x.empty() || x.size() != y.size()) return "a table needs pairs of numbers";
  if (!std::all_of(x.begin(), x.end(), is_finite) || !std::all_of(y.begin(), y.end(), is_finite) ||
      !is_finite(slope_before) || !is_finite(slope_after)) {
    return "a number of the table is not finite";
  }
  return std::is_sorted(x.begin(), x.end()) ? "" : "the points of the table must be in increasing order";
}

std::string FaultOfDiode(const DiodeModel& diode) {
  if (!std::isfinite(diode.forward)) return "a forward voltage of " + NumberText(diode.forward) + " V";
  if (!(diode.on_resistance >= 0) || !std::isfinite(diode.on_resistance)) {
    return "an on-resistance of " + NumberText(diode.on_resistance) + " ohm; must be at least 0";
  }
  for (const auto& [forward, ohms] : diode.further) {
    if (std::isfinite(forward) && ohms > 0 && std::isfinite(ohms)) continue;
    return "a kink at " + NumberText(forward) + " V with " + NumberText(ohms) + " ohm; must be above 0";
  }
  if (!(diode.off_resistance > diode.on_resistance)) {
    return "an off-resistance of " + NumberText(diode.off_resistance) + " ohm; must be above the on-resistance";
  }
  if (diode.breakdown && !(*diode.breakdown > 0)) {
    return "a breakdown voltage of " + NumberText(*diode.breakdown) + " V; must be above 0";
  }
  return "";
}

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
    case ElementKind::kDiode:
      return FaultOfDiode(element.diode);
    case ElementKind::kSwitch: {
      const SwitchModel& model = element.switching;
      if (!(model.on_resistance >= 0) || !std::isfinite(model.on_resistance)) {
        return "an on-resistance of " + NumberText(model.on_resistance) + " ohm; must be at least 0";
      }
      if (!(model.off_resistance > model.on_resistance)) {
        return "an off-resistance of " + NumberText(model.off_resistance) + " ohm; must be above the on-resistance";
      }
      if (!(model.hysteresis >= 0)) {
        return "a hysteresis of " + NumberText(model.hysteresis) + "; must be at least 0";
      }
      if (!std::isfinite(model.threshold)) return "the threshold is not finite";
      return element.body_diode ? FaultOfDiode(*element.body_diode) : "";
    }
    case ElementKind::kControlledVoltage:
    case ElementKind::kControlledCurrent:
      return FaultOfControlled(element);
  }
  return "";
}

// Fluxes of coils have a positive semidefinite inductance matrix.
absl::Status CheckCouplings(const Circuit& circuit) {
  if (circuit.couplings.empty()) return absl::OkStatus();
  std::vector<Index> inductors;
  for (const Coupling& coupling : circuit.couplings) {
    inductors.push_back(coupling.first);
    inductors.push_back(coupling.second);
  }
  std::sort(inductors.begin(), inductors.end());
  inductors.erase(std::unique(inductors.begin(), inductors.end()), inductors.end());
  const auto place_of = [&inductors](Index element) {
    return std::lower_bound(inductors.begin(), inductors.end(), element) - inductors.begin();
  };
  const auto count = static_cast<Index>(inductors.size());
  Matrix normal = Matrix::Identity(count, count);
  std::string names;
  for (const Coupling& coupling : circuit.couplings) {
    const Index one = place_of(coupling.first), other = place_of(coupling.second);
    normal(one, other) = normal(other, one) = coupling.value;
    names += (names.empty() ? "" : ", ") + coupling.name;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(normal, Eigen::EigenvaluesOnly);
  if (solver.eigenvalues().minCoeff() >= -kLcpTolerance * static_cast<double>(count)) return absl::OkStatus();
  return absl::InvalidArgumentError("the couplings " + names +
                                    " together do not belong to coils: the inductance matrix has a negative "
                                    "eigenvalue. Make them smaller");
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
    if (std::abs(coupling.value) > 0 && std::abs(coupling.value) <= 1) continue;
    return absl::InvalidArgumentError(coupling.name + ": a coupling of " + NumberText(coupling.value) +
                                      "; must be above 0 and at most 1 in size");
  }
  return CheckCouplings(circuit);
}

}  // namespace dlcs
