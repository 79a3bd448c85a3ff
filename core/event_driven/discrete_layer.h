// SPDX-License-Identifier: Apache-2.0
// Discrete states, and what they do in zero time.

#ifndef DLCS_CORE_EVENT_DRIVEN_DISCRETE_LAYER_H_
#define DLCS_CORE_EVENT_DRIVEN_DISCRETE_LAYER_H_

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/event_driven/sampled_errors.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"
#include "core/types.h"

namespace dlcs {

// What a clocked switch has read, but not yet become: its delay is another one than those of other switches.
enum class Reading : char { kNone, kOff, kOn };

struct DiscreteState {
  std::vector<char> on;  // of each switch
  std::vector<Reading> readings;
  Vector x;
};

// What happened at one instant.
struct Instant {
  enum class Kind {
    kLasts,         // nothing more happens in `after`
    kRace,          // the order in which switches flip decides, and no rule says which is first
    kNoneLasts,     // every order goes on for ever
    kTooMany,       // more states than kMostStates would have to be looked at
    kNoMode,        // in one of the states no mode was found
    kWrittenTwice,  // two resets write one state
  };
  Kind kind = Kind::kLasts;
  DiscreteState after;
  std::vector<SwitchFlip> flips = {};  // without times and causes
  Matrix J = {};                       // of x after by x before, if x was reset; else empty
  std::vector<Index> switches = {};    // those that the reason is about
  std::string ends = {};               // of a race, for a message
};

// The switches of a problem WithConditionPairs() and their states. A switch is *excited* if its conditions ask it to
// flip; they are what they are just behind t, which the active set of the mode there says.
//
// The measure of truth: give each switch a small delay, in any ratio, and let all of them go to zero. Where all orders
// in which excited switches can flip, one after another, end in the same state, that is the answer. Where they do not,
// the problem does not say which one is.
class DiscreteLayer {
 public:
  static constexpr std::size_t kMostStates = 4096;

  // Keeps a reference.
  explicit DiscreteLayer(const Problem& problem);

  const std::vector<char>& on() const { return on_; }
  DiscreteState With(const Vector& x) const { return {on_, readings_, x}; }
  void Become(const DiscreteState& state) {
    on_ = state.on;
    readings_ = state.readings;
  }
  Index first_condition() const { return first_condition_; }

  // What states add to f, and to g with the levels of conditions.
  Vector OfF(const std::vector<char>& on) const;
  Vector OfG(const std::vector<char>& on) const;

  // The switches that are excited in the mode of `active`.
  std::vector<Index> Excited(const DiscreteState& state, const std::vector<Index>& active) const;
  std::vector<Index> Excited(const std::vector<Index>& active) const { return Excited(With(Vector()), active); }

  // Starts the delays of switches that are asked to flip in the mode of `active`, from `t` on, and ends those of
  // others. `errors`: of `t`.
  void UpdateTimers(double t, const TimeErrors& errors, const std::vector<Index>& active);
  void DropTimers() { timers_.assign(timers_.size(), std::nullopt); }
  // The next time at which a delay has passed, infinite if none runs; and its errors, those of its begin.
  double NextTimer() const;
  TimeErrors ErrorsOfNextTimer() const;

  // Whether something happens at `t` that no control decides, and what: edges, clocks, resets and ends of delays of one
  // time at once. All read what holds before, in `active`. Known times are asked for in their order, each once.
  bool IsKnownTime(double t) const;
  Instant HappenAt(double t, const Vector& x, const std::vector<Index>& active);

  // Flips switches, one after another, until none is excited. `active_in` returns the active set just behind t of the
  // mode in a state; absent where there is none. `at_start`: a race is a choice there, not an unknown truth; the first
  // switch of the problem flips first.
  using ActiveIn = std::function<std::optional<std::vector<Index>>(const DiscreteState&)>;
  Instant Resolve(const DiscreteState& before, bool at_start, const ActiveIn& active_in) const;

  std::string NamesOf(const std::vector<Index>& switches) const;

 private:
  struct Flipped {
    DiscreteState state;
    std::vector<SwitchFlip> flips;
    Matrix J;
    bool is_written_twice = false;
  };
  struct Node;
  std::vector<Index> AskedToFlip(const DiscreteState& state, const std::vector<Index>& active) const;
  bool IsNowAt(const std::vector<double>& times, double t) const;
  bool Holds(const std::vector<Index>& conditions, const std::vector<Index>& active) const;
  // What a clocked switch reads; absent: what it was.
  std::optional<bool> AtClock(std::size_t i, const std::vector<Index>& active) const;
  Flipped Flip(const DiscreteState& state, const std::vector<Index>& active, const std::vector<Index>& switches,
               const std::vector<const StateReset*>& resets) const;
  std::vector<std::vector<char>> ActsOn() const;
  bool ResolveGroup(const std::vector<char>& group, bool at_start, const ActiveIn& active_in, Instant& instant) const;
  std::optional<Index> FirstInOrder(const std::vector<Index>& excited) const;

  const Problem& problem_;
  const Switching& switching_;
  Index first_condition_;
  struct OfSwitch {
    std::vector<Index> set, reset, at_clock;  // pairs
  };
  std::vector<OfSwitch> conditions_;
  std::vector<Index> order_;
  std::vector<std::vector<char>> group_;  // of each switch: those that act on it or on which it acts, by others too
  std::vector<char> on_;
  std::vector<Reading> readings_;
  struct Timer {
    double end;
    TimeErrors errors;
  };
  std::vector<std::optional<Timer>> timers_;  // of each switch
  double happened_ = -1;                      // the last time that was asked for
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_DISCRETE_LAYER_H_
