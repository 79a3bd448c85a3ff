// SPDX-License-Identifier: Apache-2.0
#include "core/problem/verdict.h"

#include <cmath>
#include <cstdio>

#include "core/format_number.h"

namespace dlcs {
namespace {

// A figure with two digits: no estimate has more.
std::string Figure(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", value);
  return text;
}

// A measure of the certificate, with the size to compare it with.
struct Measure {
  const char* what;
  double value;
  double size;
  bool shows_error;  // nothing but an error makes it large; between nodes a jump of y does too

  double relative() const { return value > 0 ? value / size : 0; }  // 0/0 is no misfit
};

// A measure by rows, each against its own size, where it was taken; the largest of all against the largest size
// elsewhere.
Measure ByRows(const char* what, double of_rows, double value, double size, bool shows_error) {
  return std::isnan(of_rows) ? Measure{what, value, size, shows_error} : Measure{what, of_rows, 1, shows_error};
}

void AddConcerns(const Solution& solution, Verdict& verdict) {
  const Certificate& c = solution.certificate;
  // The error of B y is estimated where y is a Lipschitz function of x: then y jumps only at break points, which are
  // nodes. Grids whose steps all miss the same motion agree with each other, so that this may be the only sign of it.
  const bool y_is_continuous = solution.accuracy.errors_By.size() > 0;
  // Modes solve the LCP at nodes but for rounding, however long the steps are.
  const bool by_modes = solution.method == Method::kEventDriven && solution.cost.coupled_steps == 0;
  if (by_modes && ByRows("", c.node_residual_of_rows, c.node_residual, c.lcp_scale, true).relative() > kConcern) {
    verdict.success = false;
  }
  const char* const advice = by_modes ? ": another method may do better." : ": shorter steps would resolve it.";
  for (const Measure& measure :
       {ByRows("the residual of the LCP at nodes", c.node_residual_of_rows, c.node_residual, c.lcp_scale, true),
        ByRows("the residual of the LCP between nodes", c.midpoint_residual_of_rows, c.midpoint_residual, c.lcp_scale,
               y_is_continuous),
        Measure{"the defect of x'", c.ode_defect, c.ode_scale, false},
        Measure{"the difference of x to the integral of A x + B y + f", c.drift_of_rows, 1, true}}) {
    if (!(measure.relative() > kConcern)) continue;
    if (measure.relative() > kNoSuccess && measure.shows_error) verdict.success = false;
    verdict.concerns.push_back(std::string(1, static_cast<char>(measure.what[0] - 'a' + 'A')) + (measure.what + 1) +
                               " is " + Figure(measure.relative()) + " of its size" + advice);
  }
}

std::string HowLarge(double error) {
  if (error > 1) return "larger than x itself";
  if (error > 0.99) return "as large as x itself";
  return Figure(100 * error) + " % of the size of x";
}

// What the caller can change about the error. A tolerance of the caller was not met for the reason in the message.
const char* Advice(const Accuracy& accuracy) {
  if (!(accuracy.tolerance > 0)) return ": take shorter steps, or set a tolerance.";
  return accuracy.tolerance_is_default ? ": set a tolerance, which allows more work." : ".";
}

std::string Within(const Accuracy& accuracy) {
  return "an error of " + FormatNumber(accuracy.tolerance) + (accuracy.tolerance_is_default ? " (the default)" : "");
}

// "1.7 %", or of what more than doubles "a factor of 4.8".
std::string GrowthText(double growth) {
  return growth > 1 ? "a factor of " + Figure(1 + growth) : Figure(100 * growth) + " %";
}

// A periodic solution that no transient ends in is not to be used, however accurate it is.
void AddStability(const Solution& solution, Verdict& verdict) {
  if (!solution.periodic) return;
  const PeriodicRecord& periodic = *solution.periodic;
  if (periodic.stability == Stability::kUndetermined) verdict.text += "; whether it is stable is not known";
  if (periodic.stability != Stability::kUnstable) return;
  const bool was_solved = verdict.kind == VerdictKind::kSolved;
  const std::string grows = "disturbances grow by " + GrowthText(periodic.growth) + " a period";
  verdict.text =
      "unstable: " + grows + "; " + (was_solved ? "estimated error " + Figure(solution.accuracy.error) : verdict.text);
  verdict.kind = was_solved ? VerdictKind::kErrorEstimated : verdict.kind;
  verdict.success = false;
  verdict.concerns.insert(verdict.concerns.begin(), "The periodic solution is unstable: " + grows +
                                                        ", so that no solution from another state stays near it.");
}

// Of termination, accuracy, certificate and reached limits.
Verdict JudgeTrajectory(const Solution& solution) {
  const Accuracy& accuracy = solution.accuracy;
  Verdict verdict;
  if (solution.termination != Termination::kReachedEnd) {
    verdict.text = std::string("not solved: ") + TerminationName(solution.termination);
    return verdict;
  }
  const bool known = accuracy.source != AccuracySource::kNotEstimated && !std::isnan(accuracy.error);
  verdict.success = solution.reached_limits.empty();
  verdict.concerns = solution.reached_limits;
  AddConcerns(solution, verdict);
  if (!known) {
    verdict.kind = VerdictKind::kErrorUnknown;
    verdict.text = "reached T, error not estimated";
    // If the other grids failed, there is nothing to compare the last one with.
    if (accuracy.tolerance > 0) {
      verdict.text += ", where " + FormatNumber(accuracy.tolerance) + " was aimed at";
      verdict.success = false;
    }
    if (!solution.reached_limits.empty()) verdict.text = "reached T, not usable: error not estimated";
    return verdict;
  }
  const std::string estimated = "estimated error " + Figure(accuracy.error);
  const bool met = accuracy.source == AccuracySource::kControlled && accuracy.error <= accuracy.tolerance;
  if (met && verdict.concerns.empty()) {
    verdict.kind = VerdictKind::kSolved;
    verdict.text = "SOLVED within " + Within(accuracy) + ", " + estimated;
    return verdict;
  }
  verdict.kind = VerdictKind::kErrorEstimated;
  verdict.success = verdict.success && !(accuracy.error > kNoSuccess);
  if (accuracy.error > kConcern) {
    verdict.concerns.insert(verdict.concerns.begin(),
                            "The estimated error is " + HowLarge(accuracy.error) + Advice(accuracy));
  }
  // Some readers see this line alone.
  const char* const warning = !verdict.success ? "not usable: " : !verdict.concerns.empty() ? "warning: " : "";
  verdict.text = std::string("reached T, ") + warning + estimated;
  if (accuracy.tolerance > 0 && !met) verdict.text += ", where " + FormatNumber(accuracy.tolerance) + " was aimed at";
  return verdict;
}

}  // namespace

Verdict JudgeSolution(const Solution& solution) {
  Verdict verdict = JudgeTrajectory(solution);
  if (solution.termination == Termination::kReachedEnd) AddStability(solution, verdict);
  return verdict;
}

const char* VerdictName(VerdictKind kind) {
  switch (kind) {
    case VerdictKind::kSolved:
      return "SOLVED";
    case VerdictKind::kErrorEstimated:
      return "ERROR_ESTIMATED";
    case VerdictKind::kErrorUnknown:
      return "ERROR_UNKNOWN";
    case VerdictKind::kNotSolved:
      return "NOT_SOLVED";
  }
  return "UNKNOWN";
}

}  // namespace dlcs
