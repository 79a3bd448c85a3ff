// SPDX-License-Identifier: Apache-2.0
// Discrete states: switches, comparators, latches, clocked elements, and resets of the state.
//
// With discrete states s_i, 0 or 1, the system is
//
//     x' = A x + B y + f + F s,   0 <= y ⟂ w = N x + M y + g + G s >= 0,   c = C x + D y + h + H s,
//
// and the controls c decide when an s_i flips. What happens in zero time at an instant is in
// core/event_driven/discrete_layer.h.

#ifndef DLCS_CORE_PROBLEM_SWITCHING_H_
#define DLCS_CORE_PROBLEM_SWITCHING_H_

#include <optional>
#include <string>
#include <vector>

#include "core/types.h"

namespace dlcs {

class ViolationList;

// c[control] > level; where `is_below`, c[control] < level.
struct SwitchCondition {
  Index control = 0;
  double level = 0;
  bool is_below = false;
};

enum class SwitchKind {
  kLatch,    // 1 where all of `set` hold, 0 where all of `reset` hold, else as before
  kClocked,  // the same for `set` and `at_clock`, at its clock only; 0 where all of `reset` hold, at any time
  kGiven,    // flips at `edges`
};

// A switch with thresholds is a latch with one condition each.
struct Switch {
  std::string name;  // unique
  SwitchKind kind = SwitchKind::kLatch;
  bool start = false;  // s_i before time 0
  std::vector<SwitchCondition> set, reset;
  std::vector<SwitchCondition> at_clock = {};  // kClocked: those for 0
  bool set_dominates = false;                  // of a latch, where both hold
  std::vector<double> clock = {};              // increasing; of kClocked, or
  std::optional<Index> edge = {};              // where this switch rises
  std::vector<double> edges = {};              // of kGiven, increasing
  // Not of kGiven: it flips when it has been asked to for so long without a break. 0: at once.
  double delay = 0;
};

// x becomes J x + j at `times`, which increase, or where switch `edge` flips to `value`.
struct StateReset {
  std::vector<double> times;
  std::optional<Index> edge;
  bool value = true;
  Matrix J;
  Vector j;
};

// q switches and r controls. Matrices of no entries stand for zero.
struct Switching {
  std::vector<Switch> switches = {};
  std::vector<StateReset> resets = {};
  Matrix F = {};                        // m × q
  Matrix G = {};                        // n × q
  Matrix C = {}, D = {}, H = {};        // r × m, r × n, r × q
  Vector h = {};                        // r
  std::vector<std::string> order = {};  // of names: in a race of these switches the first that can flip does

  bool is_empty() const { return switches.empty() && resets.empty(); }
};

// All conditions of all switches, each once, in the order of their first use.
std::vector<SwitchCondition> ConditionsOf(const Switching& switching);
// Appends the violations of the switching of a problem with m states and n pairs on [0, horizon], named
// switching.switches[1].set[0].level, switching.resets[0].J, switching.F.
void CheckSwitching(const Switching& switching, Index m, Index n, double horizon, ViolationList& list);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_SWITCHING_H_
