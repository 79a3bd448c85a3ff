// SPDX-License-Identifier: Apache-2.0
// One system solved by the engine and judged by the reference.

#ifndef DLCS_TESTS_HOSTILE_TRIAL_H_
#define DLCS_TESTS_HOSTILE_TRIAL_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/problem/options.h"
#include "core/problem/solution.h"
#include "tests/hostile/reference.h"
#include "tests/hostile/system.h"

namespace dlcs::hostile {

enum class Judgment {
  kRight,            // a good verdict and no further from the reference than asked; or rightly no solution
  kWrong,            // a good verdict and further from the reference than asked
  kRefusedWithNeed,  // no good verdict, and one ulp of the data moves the answer by more than asked
  kRefused,          // no good verdict, although there is an answer
  kNotJudged,        // the reference makes no claim, or stops where the engine goes on
};
const char* Name(Judgment judgment);

struct Trial {
  Judgment judgment = Judgment::kNotJudged;
  bool is_good_verdict = false;  // solved within the error that was asked for
  bool reached_end = false;
  // The largest over times and components, relative to the size of each; of B y and w where y is a Lipschitz function
  // of x.
  std::optional<double> error;
  std::string component;            // that it belongs to: "x1"
  double time = 0;                  // where it is
  std::optional<double> figure;     // the estimate of the engine, in the same measure
  std::optional<double> error_of_figure;  // the largest of the components that it is of: those that are not named
  std::optional<double> condition;  // where it was looked at
  double seconds = 0;
  std::string verdict;  // termination, method and message of the engine
};

// The request of a solve: an error, or `steps` of equal length or, if both are 0, the default. By any method.
struct Asked {
  double tolerance = 0;
  Index steps = 0;
  Method method = Method::kAuto;

  // The error that a good verdict promises: kDefaultTolerance for the default.
  double error() const { return tolerance > 0 ? tolerance : kDefaultTolerance; }
  static constexpr double kDefaultTolerance = 1e-6;
};

// Times for the comparison: T, even ones, and some that cluster at 0.
std::vector<double> ComparisonTimes(const System& system);

// The solution at ComparisonTimes() and between events: an error that one of them makes may have decayed before the
// next of those times. Where solutions are several it is empty.
Reference ReferenceOf(const System& system);

// The largest difference of a component to the reference.
struct ComponentError {
  Component component;
  double error = 0;
  double time = 0;                      // where it is
  double own = 0;                       // the size of the component in the reference
  std::optional<NamedComponent> named;  // by the engine
};
// Of all components that the engine estimates errors of, at the times of the reference. y, w and outputs are left out
// at times where they may jump, or where other pairs are active than `tolerance` tells apart.
std::vector<ComponentError> ErrorsOf(const System& system, const Solution& solution, const Reference& reference,
                                     double tolerance);

Options OptionsFor(const Asked& asked, const std::vector<double>& times, bool times_only);
// Solves, for at most `seconds`; then it is kCancelled.
absl::StatusOr<Solution> SolveFor(const System& system, const Options& options, double seconds);

// Solves for at most `seconds`, and compares at the times of `reference`; where solutions are several that is empty,
// and the answer is replayed. With steps an answer is wrong where the figure is below a tenth of the error.
Trial Try(const System& system, const Reference& reference, const Asked& asked, double seconds);

}  // namespace dlcs::hostile

#endif  // DLCS_TESTS_HOSTILE_TRIAL_H_
