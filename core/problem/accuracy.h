// SPDX-License-Identifier: Apache-2.0
// The error of a trajectory, component by component, and what is known of each.

#ifndef DLCS_CORE_PROBLEM_ACCURACY_H_
#define DLCS_CORE_PROBLEM_ACCURACY_H_

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/types.h"

namespace dlcs {

// How the error of a trajectory was found.
enum class AccuracySource {
  kNotEstimated,
  kCompared,    // with solves on other grids, for steps that were given
  kControlled,  // steps were chosen by it
};

// A component of the solution: x_i, y_i, w_i or an output.
enum class ComponentKind { kState, kPair, kSlack, kOutput };
struct Component {
  ComponentKind kind = ComponentKind::kState;
  Index index = 0;

  bool operator==(const Component&) const = default;
};

// Of all components of one kind, over [0, T]: the largest absolute value, and bounds of the error by its cause.
struct ErrorsByCause {
  Vector own;
  Vector truncation;  // what a better computation would avoid: steps, interpolation, times of events, elimination
  Vector rounding;    // what an ulp of every term of the equations, and of every stored value, makes of the component
  Index size() const { return own.size(); }
};

struct LargestValues {
  Vector x, y, w;
};

// Kinds that were not estimated are empty.
struct TrajectoryErrors {
  ErrorsByCause x, y, w, outputs;

  ErrorsByCause& of(ComponentKind kind) {
    switch (kind) {
      case ComponentKind::kState:
        return x;
      case ComponentKind::kPair:
        return y;
      case ComponentKind::kSlack:
        return w;
      case ComponentKind::kOutput:
        break;
    }
    return outputs;
  }
  const ErrorsByCause& of(ComponentKind kind) const { return const_cast<TrajectoryErrors*>(this)->of(kind); }
};
inline constexpr ComponentKind kComponentKinds[] = {ComponentKind::kState, ComponentKind::kPair, ComponentKind::kSlack,
                                                    ComponentKind::kOutput};

// What is known of a component at the end (core/context/sizes.h has the definition). Accepted are all but kMissed.
enum class Knowledge {
  kKnown,       // its error is at most the tolerance times its own size
  kGiven,       // its error is at most its absolute tolerance
  kNegligible,  // its error is rounding alone, and small beside the size of what it is coupled with
  kZero,        // it is no larger than its rounding
  kMissed,
};

// A component that is not kKnown or kGiven.
struct NamedComponent {
  Component component;
  Knowledge knowledge = Knowledge::kMissed;
  double own = 0;
  double truncation = 0;
  double rounding = 0;
  double allowed = 0;  // of kMissed: the largest error that would be accepted
  int digits = 0;      // of kNegligible: how many are known, log10(own / rounding) rounded down
  // The component whose size decides how large it could be, with its own size; absent where sources alone drive it.
  std::optional<Component> beside = {};
  double beside_own = 0;
  // What both are called: NumberedName(), until the caller has better ones.
  std::string name = {}, beside_name = {};
};

// What can be asked for so that every component is accepted: one tolerance for all, or an absolute tolerance of each of
// some components beside the tolerance that was asked for (core/context/sizes.h derives both).
struct Advice {
  struct OfComponent {
    Component component;
    double tolerance = 0;
    std::string name = {};  // as in NamedComponent
  };
  // At least 1 where none accepts them all, as where a component is no larger than its rounding.
  double tolerance = std::numeric_limits<double>::infinity();
  // In the order of the components. Empty where nothing missed, or where no tolerance helps.
  std::vector<OfComponent> absolute;
};

// "x[2]", "y[0]", "w[1]", "z[3]" for an output.
std::string NumberedName(const Component& component);

// The estimated error of the trajectory.
struct Accuracy {
  AccuracySource source = AccuracySource::kNotEstimated;
  // The largest error relative to what it is compared with, max(own, absolute tolerance / tolerance), over all
  // components but those named as zero or negligible. NaN if not known.
  double error = std::numeric_limits<double>::quiet_NaN();
  // The tolerance that the steps were chosen for; 0 if the steps were given. tolerance_is_default: it is the default
  // tolerance (Options::error_tolerance).
  double tolerance = 0;
  bool tolerance_is_default = false;
  bool has_absolute_tolerances = false;  // some component has one
  TrajectoryErrors errors;
  // The zeros and the negligible components, then those that missed the tolerance, the worst first.
  std::vector<NamedComponent> named;
  Advice advice;  // where a component missed
  // Whether other tolerances have other errors: not so where solves agree, but do not converge.
  bool follows_tolerance = true;
  std::string note;  // one sentence: what was compared, or why there is no estimate
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_ACCURACY_H_
