// SPDX-License-Identifier: Apache-2.0
#include "core/problem/outputs.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/format_number.h"
#include "core/problem/formula.h"
#include "core/problem/problem_checks.h"
#include "core/problem/violation_list.h"

namespace dlcs {
namespace {

constexpr std::size_t kMaxNameBytes = 256;

// Why `name` is not allowed; empty if it is.
std::string FaultOfName(const std::string& name) {
  if (name.empty()) return "empty; every one has a name";
  if (name.size() > kMaxNameBytes) {
    return std::to_string(name.size()) + " bytes; at most " + std::to_string(kMaxNameBytes) + " are allowed";
  }
  const bool has_control = std::any_of(name.begin(), name.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) == 0x7f;
  });
  return has_control ? "has control characters" : "";
}

class NameSet {
 public:
  explicit NameSet(ViolationList& list) : list_(list) {}

  void Check(const std::string& name, const std::string& field) {
    if (std::string fault = FaultOfName(name); !fault.empty()) {
      list_.Add(field, std::move(fault));
    } else if (const auto [other, is_new] = taken_.emplace(name, field); !is_new) {
      list_.Add(field, '"' + name + "\"; is already the name of " + other->second + "; names must be unique");
    }
  }

 private:
  ViolationList& list_;
  std::map<std::string, std::string> taken_;
};

void CheckIndices(const std::vector<Index>& outputs, Index size, const std::string& field, ViolationList& list) {
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    if (outputs[k] >= 0 && outputs[k] < size) continue;
    list.Add(field + ".outputs[" + std::to_string(k) + "]",
             std::to_string(outputs[k]) + "; must be the index of one of the " + std::to_string(size) + " outputs");
  }
}

void CheckTime(double time, double horizon, const std::string& field, ViolationList& list) {
  if (std::isfinite(time) && time >= 0 && time <= horizon) return;
  list.Add(field, NumberText(time) + "; must be in [0, T] with T = " + NumberText(horizon));
}

void CheckInstant(const MeasurementInstant& instant, Index size, double horizon, const std::string& field,
                  ViolationList& list) {
  if (instant.time) {
    CheckTime(*instant.time, horizon, field + ".time", list);
    if (!instant.outputs.empty()) list.Add(field + ".outputs", "beside a time; give one of them");
    return;
  }
  if (instant.outputs.empty()) list.Add(field, "neither time nor outputs; give one of them");
  CheckIndices(instant.outputs, size, field, list);
  if (!std::isfinite(instant.level)) list.Add(field + ".level", NumberText(instant.level) + "; must be finite");
  if (instant.number == 0 || instant.number < MeasurementInstant::kLast) {
    list.Add(field + ".number", std::to_string(instant.number) + "; must be 1, 2, ... or -1 for the last");
  }
  CheckTime(instant.after, horizon, field + ".after", list);
}

void CheckFormula(const std::vector<Measurement>& measurements, std::size_t k, const std::string& field,
                  ViolationList& list) {
  FormulaVariables earlier;
  for (std::size_t other = 0; other < k; ++other) earlier.parameters[measurements[other].name] = 1;
  const auto formula = Formula::Parse(measurements[k].formula, earlier);
  if (!formula.ok()) {
    list.Add(field, '"' + measurements[k].formula + "\": " + std::string(formula.status().message()));
  } else if (formula->DependsOnTime()) {
    list.Add(field, '"' + measurements[k].formula + "\"; must be of earlier measurements alone, not of t");
  }
}

}  // namespace

void CheckOutputs(const Outputs& outputs, Index m, Index n, ViolationList& list) {
  const Index p = outputs.size();
  NameSet names(list);
  for (Index k = 0; k < p; ++k) {
    names.Check(outputs.names[static_cast<std::size_t>(k)], "outputs.names[" + std::to_string(k) + "]");
  }
  if (p == 0) {
    if (outputs.C.size() > 0 || outputs.D.size() > 0 || !outputs.h.pieces.empty()) {
      list.Add("outputs.names", "empty; every row of C, D and h has a name");
    }
    if (!outputs.limits.empty()) list.Add("outputs.limits", "limits without outputs");
    if (outputs.hidden != 0) list.Add("outputs.hidden", std::to_string(outputs.hidden) + "; there are no outputs");
    return;
  }
  CheckMatrix(outputs.C, p, m, "p x m = " + ShapeText(p, m) + " (p names, m from A)", "outputs.C", list);
  CheckMatrix(outputs.D, p, n, "p x n = " + ShapeText(p, n) + " (p names, n from M)", "outputs.D", list);
  Validate(outputs.h, p, "outputs.h", list);
  if (outputs.hidden < 0 || outputs.hidden > p) {
    list.Add("outputs.hidden", std::to_string(outputs.hidden) + "; must be between 0 and " + std::to_string(p));
  }
  std::vector<bool> limited(static_cast<std::size_t>(p), false);
  for (std::size_t k = 0; k < outputs.limits.size(); ++k) {
    const OutputLimit& limit = outputs.limits[k];
    const std::string field = "outputs.limits[" + std::to_string(k) + "]";
    if (limit.output < 0 || limit.output >= p) {
      list.Add(field + ".output",
               std::to_string(limit.output) + "; must be the index of one of the " + std::to_string(p) + " outputs");
    } else if (limited[static_cast<std::size_t>(limit.output)]) {
      list.Add(field + ".output", std::to_string(limit.output) + "; has a limit already");
    } else {
      limited[static_cast<std::size_t>(limit.output)] = true;
    }
    if (!(std::isfinite(limit.value) && limit.value > 0)) {
      list.Add(field + ".value", NumberText(limit.value) + "; must be finite and greater than 0");
    }
  }
}

void CheckMeasurements(const std::vector<Measurement>& measurements, const Outputs& outputs, double horizon,
                       ViolationList& list) {
  NameSet names(list);
  for (std::size_t k = 0; k < measurements.size(); ++k) {
    const Measurement& one = measurements[k];
    const std::string field = "measurements[" + std::to_string(k) + "]";
    names.Check(one.name, field + ".name");
    const bool needs_until = one.kind == MeasurementKind::kDelay;
    const bool is_formula = one.kind == MeasurementKind::kFormula;
    const bool is_instant = needs_until || one.kind == MeasurementKind::kTime;
    const bool needs_at = is_instant || one.kind == MeasurementKind::kValue || one.kind == MeasurementKind::kSlope;
    if ((is_instant || is_formula) != one.outputs.empty()) {
      list.Add(field + ".outputs",
               one.outputs.empty() ? "empty; what is measured?" : "given; a time, a delay and a formula have none");
    }
    if (is_formula) {
      CheckFormula(measurements, k, field + ".formula", list);
    } else if (!one.formula.empty()) {
      list.Add(field + ".formula", "given; only the kind formula has it");
    }
    CheckIndices(one.outputs, outputs.size(), field, list);
    if (needs_at != one.at.has_value()) {
      list.Add(field + ".at", needs_at ? "missing; when?" : "given; only values, slopes, times and delays have it");
    }
    if (needs_until != one.until.has_value()) {
      list.Add(field + ".until", needs_until ? "missing; a delay ends there" : "given; only delays have it");
    }
    if (one.at) CheckInstant(*one.at, outputs.size(), horizon, field + ".at", list);
    if (one.until) CheckInstant(*one.until, outputs.size(), horizon, field + ".until", list);
    if (needs_at || is_formula) {
      if (one.begin != 0 || one.end) list.Add(field + ".begin", "given; only what covers some time has begin and end");
      continue;
    }
    CheckTime(one.begin, horizon, field + ".begin", list);
    if (!one.end) continue;
    CheckTime(*one.end, horizon, field + ".end", list);
    if (!(*one.end > one.begin)) {
      list.Add(field + ".end", NumberText(*one.end) + "; must be greater than the begin " + NumberText(one.begin));
    }
  }
}

}  // namespace dlcs
