// SPDX-License-Identifier: Apache-2.0
#include "core/problem/switching.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/format_number.h"
#include "core/problem/violation_list.h"

namespace dlcs {
namespace {

bool IsSame(const SwitchCondition& a, const SwitchCondition& b) {
  return a.control == b.control && a.level == b.level && a.is_below == b.is_below;
}

void CheckShape(const Matrix& matrix, Index rows, Index columns, const std::string& field, ViolationList& list) {
  if (matrix.size() == 0) return;
  if (matrix.rows() != rows || matrix.cols() != columns) {
    list.Add(field, ShapeText(matrix.rows(), matrix.cols()) + "; must be " + ShapeText(rows, columns));
  }
  list.AddNonFiniteEntries(matrix, field);
}

void CheckTimes(const std::vector<double>& times, double horizon, const std::string& field, ViolationList& list) {
  list.AddDisorder(times, field);
  for (std::size_t k = 0; k < times.size(); ++k) {
    if (times[k] >= 0 && times[k] <= horizon) continue;
    list.Add(field + "[" + std::to_string(k) + "]", NumberText(times[k]) + "; must be in [0, T]");
  }
}

void CheckConditions(const std::vector<SwitchCondition>& conditions, Index controls, const std::string& field,
                     ViolationList& list) {
  for (std::size_t k = 0; k < conditions.size(); ++k) {
    const std::string at = field + "[" + std::to_string(k) + "]";
    if (conditions[k].control < 0 || conditions[k].control >= controls) {
      list.Add(at + ".control",
               std::to_string(conditions[k].control) + "; there are " + std::to_string(controls) + " controls");
    }
    if (!std::isfinite(conditions[k].level)) {
      list.Add(at + ".level", NumberText(conditions[k].level) + "; must be finite");
    }
  }
}

void CheckIndex(const std::optional<Index>& edge, Index switches, const std::string& field, ViolationList& list) {
  if (!edge || (*edge >= 0 && *edge < switches)) return;
  list.Add(field, std::to_string(*edge) + "; there are " + std::to_string(switches) + " switches");
}

}  // namespace

std::vector<SwitchCondition> ConditionsOf(const Switching& switching) {
  std::vector<SwitchCondition> conditions;
  for (const Switch& of : switching.switches) {
    for (const auto* list : {&of.set, &of.reset, &of.at_clock}) {
      for (const SwitchCondition& condition : *list) {
        const auto is_same = [&](const SwitchCondition& other) { return IsSame(condition, other); };
        if (std::none_of(conditions.begin(), conditions.end(), is_same)) conditions.push_back(condition);
      }
    }
  }
  return conditions;
}

void CheckSwitching(const Switching& given, Index m, Index n, double horizon, ViolationList& list) {
  if (given.is_empty()) return;
  const auto q = static_cast<Index>(given.switches.size());
  const Index r = std::max({given.C.rows(), given.D.rows(), given.H.rows(), given.h.size()});
  CheckShape(given.F, m, q, "switching.F", list);
  CheckShape(given.G, n, q, "switching.G", list);
  CheckShape(given.C, r, m, "switching.C", list);
  CheckShape(given.D, r, n, "switching.D", list);
  CheckShape(given.H, r, q, "switching.H", list);
  CheckShape(given.h, r, 1, "switching.h", list);
  std::set<std::string> names;
  for (std::size_t i = 0; i < given.switches.size(); ++i) {
    const Switch& of = given.switches[i];
    const std::string field = "switching.switches[" + std::to_string(i) + "]";
    if (of.name.empty() || !names.insert(of.name).second) {
      list.Add(field + ".name", "\"" + of.name + "\"; must be there, and no other switch may have it");
    }
    CheckConditions(of.set, r, field + ".set", list);
    CheckConditions(of.reset, r, field + ".reset", list);
    CheckConditions(of.at_clock, r, field + ".at_clock", list);
    CheckTimes(of.clock, horizon, field + ".clock", list);
    CheckTimes(of.edges, horizon, field + ".edges", list);
    CheckIndex(of.edge, q, field + ".edge", list);
    if (!(std::isfinite(of.delay) && of.delay >= 0)) {
      list.Add(field + ".delay", NumberText(of.delay) + "; must be finite and not negative");
    } else if (of.delay > 0 && of.kind == SwitchKind::kGiven) {
      list.Add(field + ".delay", NumberText(of.delay) + "; a switch that flips at given times has none");
    }
  }
  for (std::size_t k = 0; k < given.resets.size(); ++k) {
    const StateReset& reset = given.resets[k];
    const std::string field = "switching.resets[" + std::to_string(k) + "]";
    CheckTimes(reset.times, horizon, field + ".times", list);
    CheckIndex(reset.edge, q, field + ".edge", list);
    if (reset.J.rows() != m || reset.J.cols() != m) {
      list.Add(field + ".J", ShapeText(reset.J.rows(), reset.J.cols()) + "; must be " + ShapeText(m, m));
    }
    if (reset.j.size() != m)
      list.Add(field + ".j", std::to_string(reset.j.size()) + " entries; must have " + std::to_string(m));
    list.AddNonFiniteEntries(reset.J, field + ".J");
    list.AddNonFiniteComponents(reset.j, field + ".j");
  }
  for (std::size_t k = 0; k < given.order.size(); ++k) {
    if (names.count(given.order[k]) == 0) {
      list.Add("switching.order[" + std::to_string(k) + "]", "\"" + given.order[k] + "\" is no switch");
    }
  }
}

}  // namespace dlcs
