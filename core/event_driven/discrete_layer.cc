// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/discrete_layer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/format_number.h"
#include "core/linalg/bounded_sum.h"
#include "core/problem/time_axis.h"

namespace dlcs {
namespace {

// States after the same flips in another order differ by the rounding of so many operations.
constexpr Index kOperationsOfResets = 64;

bool IsAt(double time, double t) { return std::abs(time - t) <= kSameTime * t; }

bool AnyAt(const std::vector<double>& times, double t) {
  return std::any_of(times.begin(), times.end(), [t](double time) { return IsAt(time, t); });
}

bool IsSame(const DiscreteState& a, const DiscreteState& b) {
  return a.on == b.on && a.readings == b.readings &&
         ((a.x - b.x).array().abs() <=
          RoundingOf(kOperationsOfResets) * a.x.cwiseAbs().cwiseMax(b.x.cwiseAbs()).array())
             .all();
}

Vector SumOfColumns(const Matrix& matrix, Index rows, const std::vector<char>& on) {
  Vector sum = Vector::Zero(rows);
  for (Index i = 0; matrix.size() > 0 && i < matrix.cols(); ++i) {
    if (on[static_cast<std::size_t>(i)]) sum += matrix.col(i);
  }
  return sum;
}

bool HasRow(const Matrix& matrix, Index row) { return matrix.size() > 0 && !matrix.row(row).isZero(0); }

}  // namespace

DiscreteLayer::DiscreteLayer(const Problem& problem)
    : problem_(problem),
      switching_(problem.switching),
      readings_(problem.switching.switches.size(), Reading::kNone),
      timers_(readings_.size()) {
  const std::vector<SwitchCondition> conditions = ConditionsOf(switching_);
  first_condition_ = problem.num_constraints() - static_cast<Index>(conditions.size());
  const auto pairs_of = [&](const std::vector<SwitchCondition>& of) {
    std::vector<Index> pairs;
    for (const SwitchCondition& condition : of) {
      const auto found = std::find_if(conditions.begin(), conditions.end(), [&](const SwitchCondition& other) {
        return other.control == condition.control && other.level == condition.level &&
               other.is_below == condition.is_below;
      });
      pairs.push_back(first_condition_ + static_cast<Index>(found - conditions.begin()));
    }
    return pairs;
  };
  for (const Switch& of : switching_.switches) {
    on_.push_back(of.start);
    conditions_.push_back({pairs_of(of.set), pairs_of(of.reset), pairs_of(of.at_clock)});
  }
  for (const std::string& name : switching_.order) {
    for (std::size_t i = 0; i < switching_.switches.size(); ++i) {
      if (switching_.switches[i].name == name) order_.push_back(static_cast<Index>(i));
    }
  }
  // Connected parts of the relation "acts on".
  group_ = ActsOn();
  const std::size_t count = group_.size();
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; group_[i][k] && j < count; ++j) group_[i][j] = group_[i][j] || group_[k][j];
    }
  }
}

// For each switch those that its flip may make excited, or not excited any more; symmetric.
std::vector<std::vector<char>> DiscreteLayer::ActsOn() const {
  const std::size_t count = conditions_.size();
  std::vector<std::vector<char>> acts(count, std::vector<char>(count));
  const auto controls_of = [&](const Switch& of) {
    std::vector<Index> controls;
    for (const auto* list : {&of.set, &of.reset, &of.at_clock}) {
      for (const SwitchCondition& condition : *list) controls.push_back(condition.control);
    }
    return controls;
  };
  const Matrix of_y = first_condition_ > 0 && switching_.C.size() > 0
                          ? Matrix(switching_.C * problem_.B.Dense().leftCols(first_condition_))
                          : Matrix();
  const Matrix of_F =
      switching_.C.size() > 0 && switching_.F.size() > 0 ? Matrix(switching_.C * switching_.F) : Matrix();
  const auto moves = [&](std::size_t i, Index control) {
    const auto column = static_cast<Index>(i);
    const bool moves_y = switching_.G.size() > 0 && !switching_.G.col(column).isZero(0);
    if (switching_.H.size() > 0 && switching_.H(control, column) != 0) return true;
    if (of_F.size() > 0 && of_F(control, column) != 0) return true;
    if (moves_y && (HasRow(switching_.D, control) || HasRow(of_y, control))) return true;
    for (const StateReset& reset : switching_.resets) {
      if (reset.edge == column && (HasRow(switching_.C, control) || HasRow(switching_.D, control))) return true;
    }
    return false;
  };
  for (std::size_t i = 0; i < count; ++i) {
    acts[i][i] = 1;
    for (std::size_t j = 0; j < count; ++j) {
      const Switch& of = switching_.switches[j];
      const std::vector<Index> controls = controls_of(of);
      const bool does = of.edge == static_cast<Index>(i) ||
                        std::any_of(controls.begin(), controls.end(), [&](Index c) { return moves(i, c); });
      if (does) acts[i][j] = acts[j][i] = 1;
    }
  }
  return acts;
}

Vector DiscreteLayer::OfF(const std::vector<char>& on) const {
  return SumOfColumns(switching_.F, problem_.num_states(), on);
}

Vector DiscreteLayer::OfG(const std::vector<char>& on) const {
  Vector of_g = Vector::Zero(problem_.num_constraints());
  of_g.head(first_condition_) = SumOfColumns(switching_.G, first_condition_, on);
  if (switching_.H.size() == 0) return of_g;
  const Vector of_controls = SumOfColumns(switching_.H, switching_.H.rows(), on);
  const std::vector<SwitchCondition> conditions = ConditionsOf(switching_);
  for (std::size_t k = 0; k < conditions.size(); ++k) {
    const double value = of_controls[conditions[k].control];
    of_g[first_condition_ + static_cast<Index>(k)] = conditions[k].is_below ? value : -value;
  }
  return of_g;
}

bool DiscreteLayer::Holds(const std::vector<Index>& conditions, const std::vector<Index>& active) const {
  return !conditions.empty() && std::all_of(conditions.begin(), conditions.end(), [&](Index pair) {
    return std::binary_search(active.begin(), active.end(), pair);
  });
}

std::vector<Index> DiscreteLayer::Excited(const DiscreteState& state, const std::vector<Index>& active) const {
  std::vector<Index> excited = AskedToFlip(state, active);
  std::erase_if(excited, [&](Index i) { return switching_.switches[static_cast<std::size_t>(i)].delay > 0; });
  return excited;
}

// Excited(), with those that have a delay.
std::vector<Index> DiscreteLayer::AskedToFlip(const DiscreteState& state, const std::vector<Index>& active) const {
  std::vector<Index> excited;
  for (std::size_t i = 0; i < state.on.size(); ++i) {
    const Switch& of = switching_.switches[i];
    const Reading read = state.readings[i];
    const bool reset = read == Reading::kOff || Holds(conditions_[i].reset, active);
    const bool set = of.kind == SwitchKind::kLatch ? Holds(conditions_[i].set, active) : read == Reading::kOn;
    const bool flips = state.on[i] ? reset && !(set && of.set_dominates) : set && !(reset && !of.set_dominates);
    if (flips) excited.push_back(static_cast<Index>(i));
  }
  return excited;
}

std::optional<bool> DiscreteLayer::AtClock(std::size_t i, const std::vector<Index>& active) const {
  if (Holds(conditions_[i].reset, active)) return false;
  if (Holds(conditions_[i].set, active)) return true;
  if (Holds(conditions_[i].at_clock, active)) return false;
  return std::nullopt;
}

void DiscreteLayer::UpdateTimers(double t, const TimeErrors& errors, const std::vector<Index>& active) {
  const std::vector<Index> asked = AskedToFlip(With(Vector()), active);
  for (std::size_t i = 0; i < timers_.size(); ++i) {
    const double delay = switching_.switches[i].delay;
    if (!std::binary_search(asked.begin(), asked.end(), static_cast<Index>(i))) {
      timers_[i].reset();
    } else if (delay > 0 && !timers_[i]) {
      timers_[i] = Timer{t + delay, errors};
    }
  }
}

double DiscreteLayer::NextTimer() const {
  double next = std::numeric_limits<double>::infinity();
  for (const std::optional<Timer>& timer : timers_) next = timer ? std::min(next, timer->end) : next;
  return next;
}

TimeErrors DiscreteLayer::ErrorsOfNextTimer() const {
  const double next = NextTimer();
  for (const std::optional<Timer>& timer : timers_) {
    if (timer && timer->end == next) return timer->errors;
  }
  return {};
}

// A delay may end within the rounding of a given time.
bool DiscreteLayer::IsNowAt(const std::vector<double>& times, double t) const {
  return !IsAt(happened_, t) && AnyAt(times, t);
}

bool DiscreteLayer::IsKnownTime(double t) const {
  const auto is_at = [&](const std::vector<double>& times) { return IsNowAt(times, t); };
  return IsAt(NextTimer(), t) ||
         std::any_of(switching_.switches.begin(), switching_.switches.end(),
                     [&](const Switch& of) { return is_at(of.edges) || is_at(of.clock); }) ||
         std::any_of(switching_.resets.begin(), switching_.resets.end(),
                     [&](const StateReset& reset) { return is_at(reset.times); });
}

// Flips `switches` at once, with what their edges reset and make others read: what holds before.
DiscreteLayer::Flipped DiscreteLayer::Flip(const DiscreteState& state, const std::vector<Index>& active,
                                           const std::vector<Index>& switches,
                                           const std::vector<const StateReset*>& resets) const {
  Flipped flipped{state, {}, {}, false};
  std::vector<const StateReset*> all = resets;
  for (const Index flips : switches) {
    char& on = flipped.state.on[static_cast<std::size_t>(flips)];
    on = !on;
    flipped.flips.push_back({.index = flips, .value = on != 0});
    for (const StateReset& reset : switching_.resets) {
      if (reset.edge == flips && reset.value == (on != 0)) all.push_back(&reset);
    }
    flipped.state.readings[static_cast<std::size_t>(flips)] = Reading::kNone;
    for (std::size_t j = 0; on && j < switching_.switches.size(); ++j) {
      if (switching_.switches[j].edge != flips) continue;
      const std::optional<bool> read = AtClock(j, active);
      const bool flips_then = read && *read != (state.on[j] != 0);
      flipped.state.readings[j] = !flips_then ? Reading::kNone : *read ? Reading::kOn : Reading::kOff;
    }
  }
  const Index m = state.x.size();
  std::vector<char> is_written(static_cast<std::size_t>(m));
  if (!all.empty()) flipped.J = Matrix::Identity(m, m);
  for (const StateReset* reset : all) {
    for (Index i = 0; i < m; ++i) {
      if (reset->j[i] == 0 && reset->J.row(i) == Matrix::Identity(m, m).row(i)) continue;
      flipped.is_written_twice = flipped.is_written_twice || std::exchange(is_written[static_cast<std::size_t>(i)], 1);
      flipped.J.row(i) = reset->J.row(i);
      flipped.state.x[i] = reset->J.row(i).dot(state.x) + reset->j[i];
    }
  }
  return flipped;
}

Instant DiscreteLayer::HappenAt(double t, const Vector& x, const std::vector<Index>& active) {
  std::vector<Index> switches;
  std::vector<std::pair<std::size_t, Reading>> clocked;  // with delays
  for (std::size_t i = 0; i < on_.size(); ++i) {
    const Switch& of = switching_.switches[i];
    const bool ends = timers_[i] && IsAt(timers_[i]->end, t);
    if (ends || IsNowAt(of.edges, t)) switches.push_back(static_cast<Index>(i));
    if (ends) timers_[i].reset();
    if (!IsNowAt(of.clock, t)) continue;
    const std::optional<bool> read = AtClock(i, active);
    const bool flips = read && *read != (on_[i] != 0);
    if (of.delay > 0) {
      clocked.push_back({i, !flips ? Reading::kNone : *read ? Reading::kOn : Reading::kOff});
    } else if (flips) {
      switches.push_back(static_cast<Index>(i));
    }
  }
  std::vector<const StateReset*> resets;
  for (const StateReset& reset : switching_.resets) {
    if (IsNowAt(reset.times, t)) resets.push_back(&reset);
  }
  happened_ = t;
  Flipped flipped = Flip(With(x), active, switches, resets);
  for (const auto& [i, read] : clocked) flipped.state.readings[i] = read;
  Instant instant{Instant::Kind::kLasts, std::move(flipped.state), std::move(flipped.flips), std::move(flipped.J)};
  if (flipped.is_written_twice) instant.kind = Instant::Kind::kWrittenTwice;
  return instant;
}

Instant DiscreteLayer::Resolve(const DiscreteState& before, bool at_start, const ActiveIn& active_in) const {
  Instant instant{Instant::Kind::kLasts, before};
  while (true) {
    const auto active = active_in(instant.after);
    if (!active) {
      instant.kind = Instant::Kind::kNoMode;
      return instant;
    }
    const std::vector<Index> excited = Excited(instant.after, *active);
    if (excited.empty()) return instant;
    const std::vector<char>& group = group_[static_cast<std::size_t>(excited.front())];
    if (!ResolveGroup(group, at_start, active_in, instant)) return instant;
  }
}

std::optional<Index> DiscreteLayer::FirstInOrder(const std::vector<Index>& excited) const {
  for (const Index i : order_) {
    if (std::count(excited.begin(), excited.end(), i)) return i;
  }
  return std::nullopt;
}

// A state that may be passed.
struct DiscreteLayer::Node {
  DiscreteState state;
  std::vector<Index> excited;           // of the group
  std::vector<std::size_t> after = {};  // for each of them the state in which it has flipped
  std::size_t from = 0;                 // from where it was met first
  std::vector<SwitchFlip> flips = {};   // on the way from there
  Matrix J = {};
  std::size_t component = 0;  // those of one component can be reached from each other
};

namespace {

// Numbers the strongly connected components of the graph with these arcs.
std::vector<std::size_t> ComponentsOf(const std::vector<std::vector<std::size_t>>& arcs) {
  const std::size_t count = arcs.size();
  std::vector<std::vector<std::size_t>> back(count);
  for (std::size_t i = 0; i < count; ++i) {
    for (const std::size_t j : arcs[i]) back[j].push_back(i);
  }
  std::vector<char> seen(count);
  std::vector<std::size_t> order;
  for (std::size_t root = 0; root < count; ++root) {
    if (seen[root]) continue;
    std::vector<std::pair<std::size_t, std::size_t>> path{{root, 0}};
    seen[root] = 1;
    while (!path.empty()) {
      auto& [node, next] = path.back();
      if (next == arcs[node].size()) {
        order.push_back(node);
        path.pop_back();
      } else if (const std::size_t to = arcs[node][next++]; !seen[to]) {
        seen[to] = 1;
        path.push_back({to, 0});
      }
    }
  }
  std::vector<std::size_t> component(count, count);
  for (auto root = order.rbegin(); root != order.rend(); ++root) {
    if (component[*root] < count) continue;
    std::vector<std::size_t> open{*root};
    component[*root] = *root;
    while (!open.empty()) {
      const std::size_t node = open.back();
      open.pop_back();
      for (const std::size_t to : back[node]) {
        if (component[to] < count) continue;
        component[to] = *root;
        open.push_back(to);
      }
    }
  }
  return component;
}

}  // namespace

// Flips switches of the group until none of them is excited. Returns false if `instant` says why that did not end.
bool DiscreteLayer::ResolveGroup(const std::vector<char>& group, bool at_start, const ActiveIn& active_in,
                                 Instant& instant) const {
  std::vector<Node> nodes;
  std::vector<std::vector<Index>> active_of;
  const auto fails = [&](Instant::Kind kind, std::vector<Index> switches) {
    instant.kind = kind;
    instant.switches = std::move(switches);
    return false;
  };
  const auto add = [&](DiscreteState state) {
    auto active = active_in(state);
    if (!active) return false;
    Node node{std::move(state), {}};
    for (const Index i : Excited(node.state, *active)) {
      if (group[static_cast<std::size_t>(i)]) node.excited.push_back(i);
    }
    nodes.push_back(std::move(node));
    active_of.push_back(*std::move(active));
    return true;
  };
  if (!add(instant.after)) return fails(Instant::Kind::kNoMode, {});
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const std::vector<Index> excited = nodes[k].excited;
    for (const Index i : excited) {
      Flipped flipped = Flip(nodes[k].state, active_of[k], {i}, {});
      if (flipped.is_written_twice) return fails(Instant::Kind::kWrittenTwice, {i});
      const auto known =
          std::find_if(nodes.begin(), nodes.end(), [&](const Node& node) { return IsSame(node.state, flipped.state); });
      nodes[k].after.push_back(static_cast<std::size_t>(known - nodes.begin()));
      if (known != nodes.end()) continue;
      if (nodes.size() == kMostStates) return fails(Instant::Kind::kTooMany, nodes.front().excited);
      if (!add(std::move(flipped.state))) return fails(Instant::Kind::kNoMode, {i});
      nodes.back().from = k;
      nodes.back().flips = std::move(flipped.flips);
      nodes.back().J = std::move(flipped.J);
    }
  }

  std::vector<std::vector<std::size_t>> arcs;
  std::vector<std::size_t> ends;
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    arcs.push_back(nodes[k].after);
    if (nodes[k].excited.empty()) ends.push_back(k);
  }
  const std::vector<std::size_t> component = ComponentsOf(arcs);
  // Of each cycle the switches that flip in it, and those that are excited all the time: one of these that never flips
  // will leave it, whatever the delays are.
  bool is_left = true;
  std::vector<Index> flip_for_ever;
  for (std::size_t root = 0; root < nodes.size(); ++root) {
    std::vector<Index> flips, always;
    bool first = true;
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      if (component[k] != root) continue;
      const std::vector<Index>& excited = nodes[k].excited;
      for (std::size_t a = 0; a < excited.size(); ++a) {
        if (component[nodes[k].after[a]] == root) flips.push_back(excited[a]);
      }
      if (std::exchange(first, false)) always = excited;
      std::erase_if(always, [&](Index i) { return !std::count(excited.begin(), excited.end(), i); });
    }
    std::erase_if(always, [&](Index i) { return std::count(flips.begin(), flips.end(), i); });
    if (flips.empty()) continue;
    is_left = is_left && !always.empty();
    flip_for_ever.insert(flip_for_ever.end(), flips.begin(), flips.end());
  }
  std::sort(flip_for_ever.begin(), flip_for_ever.end());
  flip_for_ever.erase(std::unique(flip_for_ever.begin(), flip_for_ever.end()), flip_for_ever.end());

  std::vector<std::size_t> path;
  if (ends.size() == 1 && is_left) {
    for (std::size_t k = ends.front(); k != 0; k = nodes[k].from) path.insert(path.begin(), k);
  } else if (ends.empty()) {
    return fails(Instant::Kind::kNoneLasts, flip_for_ever);
  } else {
    // Where the order decides, one that is given does; at the start, that of the problem.
    std::size_t k = 0;
    while (!nodes[k].excited.empty() && path.size() <= nodes.size()) {
      const std::vector<Index>& excited = nodes[k].excited;
      std::optional<Index> first = FirstInOrder(excited);
      if (!first && (at_start || excited.size() == 1)) first = excited.front();
      if (!first) {
        for (std::size_t a = 0; a < excited.size(); ++a) {
          std::size_t end = nodes[k].after[a];
          std::vector<char> seen(nodes.size());
          std::vector<std::size_t> open{end};
          while (!open.empty() && !nodes[end = open.front()].excited.empty()) {
            open.erase(open.begin());
            for (const std::size_t to : nodes[end].after) {
              if (!std::exchange(seen[to], 1)) open.push_back(to);
            }
          }
          instant.ends += " " + switching_.switches[static_cast<std::size_t>(excited[a])].name + " first:";
          if (!nodes[end].excited.empty()) instant.ends += " no end,";
          for (std::size_t i = 0; nodes[end].excited.empty() && i < group.size(); ++i) {
            if (group[i])
              instant.ends += " " + switching_.switches[i].name + " = " + (nodes[end].state.on[i] ? "1," : "0,");
          }
          instant.ends.back() = '.';
        }
        return fails(Instant::Kind::kRace, excited);
      }
      const auto place = std::find(excited.begin(), excited.end(), *first) - excited.begin();
      k = nodes[k].after[static_cast<std::size_t>(place)];
      path.push_back(k);
    }
    if (!nodes[k].excited.empty()) return fails(Instant::Kind::kNoneLasts, flip_for_ever);
  }
  for (const std::size_t k : path) {
    // A state may have been met on another way first; what flips on this one follows from the states.
    const std::vector<char> on = instant.after.on;
    const bool is_way = nodes[k].from < nodes.size() && IsSame(nodes[nodes[k].from].state, instant.after);
    if (is_way) {
      instant.flips.insert(instant.flips.end(), nodes[k].flips.begin(), nodes[k].flips.end());
    } else {
      for (std::size_t i = 0; i < on.size(); ++i) {
        if (on[i] != nodes[k].state.on[i])
          instant.flips.push_back({.index = static_cast<Index>(i), .value = nodes[k].state.on[i] != 0});
      }
    }
    if (nodes[k].J.size() > 0) instant.J = instant.J.size() > 0 ? Matrix(nodes[k].J * instant.J) : nodes[k].J;
    instant.after = nodes[k].state;
  }
  return true;
}

std::string DiscreteLayer::NamesOf(const std::vector<Index>& switches) const {
  std::vector<std::string> names;
  for (const Index i : switches) names.push_back(switching_.switches[static_cast<std::size_t>(i)].name);
  return ListText(names);
}

}  // namespace dlcs
