// SPDX-License-Identifier: Apache-2.0
#include "core/problem/verdict.h"

#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "core/format_number.h"

namespace dlcs {
namespace {

// A certificate contradicts an answer where it is larger than this part of its size.
constexpr double kConcern = 0.01;

// A figure with two digits: no estimate has more.
std::string Figure(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", value);
  return text;
}

// `value` with two digits, rounded up.
std::string RoundedUp(double value) {
  const std::string text = Figure(value);
  if (!(std::strtod(text.c_str(), nullptr) < value)) return text;
  return Figure(value + 0.05 * std::pow(10, std::floor(std::log10(value))));
}

// A sentence as a part of another one, without its period.
std::string WithSmallLetter(std::string sentence) {
  const bool is_name = sentence.size() > 1 && sentence[1] == '[';
  if (!is_name && !sentence.empty()) sentence[0] = static_cast<char>(std::tolower(sentence[0]));
  if (sentence.ends_with('.')) sentence.pop_back();
  return sentence;
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

// What the certificate contradicts, the worst first; notes hold the rest.
void JudgeCertificate(const Solution& solution, Verdict& verdict) {
  const Certificate& c = solution.certificate;
  // The error of y is estimated where it is a Lipschitz function of x: then y jumps only at break points, which are
  // nodes. Grids whose steps all miss the same motion agree with each other, so that this may be the only sign of it.
  const bool y_is_continuous = solution.accuracy.errors.y.size() > 0 && solution.method != Method::kEventDriven;
  // Modes solve the LCP at nodes but for rounding, however long the steps are.
  const bool by_modes = solution.method == Method::kEventDriven && solution.cost.coupled_steps == 0;
  const char* const advice = by_modes ? ": another method may do better." : ": shorter steps would resolve it.";
  for (const Measure& measure :
       {ByRows("the residual of the LCP at nodes", c.node_residual_of_rows, c.node_residual, c.lcp_scale, true),
        ByRows("the residual of the LCP between nodes", c.midpoint_residual_of_rows, c.midpoint_residual, c.lcp_scale,
               y_is_continuous),
        Measure{"the defect of x'", c.ode_defect, c.ode_scale, false},
        Measure{"the difference of x to the integral of A x + B y + f", c.drift_of_rows, 1, true}}) {
    if (!(measure.relative() > kConcern)) continue;
    const bool asked = solution.accuracy.tolerance > 0;
    const bool fails = measure.shows_error && (asked || by_modes || measure.relative() > kFirstDigit);
    (fails ? verdict.concerns : verdict.notes)
        .push_back(std::string(1, static_cast<char>(measure.what[0] - 'a' + 'A')) + (measure.what + 1) + " is " +
                   Figure(measure.relative()) + " of its size" + advice);
  }
}

std::string Within(const Accuracy& accuracy) {
  return "an error of " + FormatNumber(accuracy.tolerance) + (accuracy.tolerance_is_default ? " (the default)" : "") +
         (accuracy.has_absolute_tolerances ? " or the absolute tolerances" : "");
}

// " beside x[0] of 31", where the size of another component decides.
std::string Beside(const NamedComponent& named) {
  return named.beside ? ", beside " + named.beside_name + " of " + Figure(named.beside_own) : "";
}

// "x[2] is zero: 2e-14 (rounding 5e-14), beside x[0] of 31"
std::string SmallText(const NamedComponent& named) {
  std::string text = named.name + " is ";
  if (named.knowledge == Knowledge::kZero) {
    return text + "zero: " + Figure(named.own) + " (rounding " + Figure(named.rounding) + ")" + Beside(named);
  }
  text += Figure(named.own);
  text += named.digits > 0 ? ", known to " + std::to_string(named.digits) + (named.digits == 1 ? " digit" : " digits")
                           : ", of which no digit is known";
  return text + Beside(named);
}

// "x[1] has an error of 3e-05, allowed is 1e-06, because of steps"
std::string MissedText(const NamedComponent& named) {
  const bool by_steps = !(named.truncation <= named.rounding);
  return named.name + " has an error of " + Figure(named.truncation + named.rounding) + ", allowed is " +
         Figure(named.allowed) + ", because of " + (by_steps ? "steps" : "rounding");
}

// As one word of a shell, in quotes where v(out) would be none.
std::string ShellWord(const std::string& text) {
  constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=.,:/@%";
  if (text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

// "--absolute-tolerance 'iL=2e-9,v(out)=3.1e-05'"; empty where no number accepts them.
std::string TypedAbsolute(const Advice& advice) {
  std::string list;
  for (const Advice::OfComponent& of_component : advice.absolute) {
    if (!std::isfinite(of_component.tolerance)) return "";
    list += (list.empty() ? "" : ",") + of_component.name + "=" + RoundedUp(of_component.tolerance);
  }
  return list.empty() ? "" : "--absolute-tolerance " + ShellWord(list);
}

// What can be typed so that every component is accepted: "--tolerance 3e-9 or --absolute-tolerance iL=2e-9".
std::string Typed(const Accuracy& accuracy) {
  constexpr std::size_t kReadable = 8;  // of a longer list the one number is the better advice
  const Advice& advice = accuracy.advice;
  if (!accuracy.follows_tolerance) return "";
  const std::string relative = RoundedUp(advice.tolerance);
  const std::string absolute = TypedAbsolute(advice);
  if (!(std::strtod(relative.c_str(), nullptr) < 1)) return absolute;
  if (absolute.empty() || advice.absolute.size() > kReadable) return "--tolerance " + relative;
  return "--tolerance " + relative + " or " + absolute;
}

// Of a solution that reached T, with an estimate of its error.
void JudgeErrors(const Accuracy& accuracy, Verdict& verdict) {
  std::vector<const NamedComponent*> small, missed;
  for (const NamedComponent& named : accuracy.named) {
    (named.knowledge == Knowledge::kMissed ? missed : small).push_back(&named);
  }
  for (const NamedComponent* named : small) verdict.notes.push_back(SmallText(*named) + ".");
  const std::string estimated = "estimated error " + Figure(accuracy.error);
  // Where y is no function of x, as after a jump, two grids may differ in it by any amount, and methods with steps
  // compare x alone.
  const bool of_x_alone = accuracy.errors.x.size() > 0 && accuracy.errors.y.size() == 0;
  if (of_x_alone) verdict.notes.push_back("The errors of y and w are not estimated: y need not be a function of x.");
  if (!missed.empty()) {
    std::vector<std::string> sentences;
    for (const NamedComponent* named : missed) sentences.push_back(MissedText(*named) + ".");
    // Where the certificate has a doubt too, no tolerance makes it a success.
    const std::string typed = verdict.concerns.empty() ? Typed(accuracy) : "";
    if (!typed.empty()) {
      const bool chooses_steps = accuracy.tolerance == 0 && typed.starts_with("--tolerance");
      sentences.push_back(typed + (missed.size() > 1 ? " accepts all of them." : " accepts it.") +
                          (chooses_steps ? " A smaller tolerance makes the steps shorter." : ""));
    }
    verdict.text = "reached T: " + MissedText(*missed.front());
    if (missed.size() > 1) verdict.text += " (and " + std::to_string(missed.size() - 1) + " more)";
    verdict.concerns.insert(verdict.concerns.begin(), sentences.begin(), sentences.end());
  } else if (accuracy.tolerance == 0) {
    verdict.text = "reached T, " + estimated + (of_x_alone ? " of x" : "");
  } else if (!verdict.concerns.empty()) {
    verdict.text = "reached T: " + WithSmallLetter(verdict.concerns.front());
  } else {
    verdict.text = "SOLVED within " + Within(accuracy) + (of_x_alone ? " of x, " : ", ") + estimated;
    if (small.size() == 1) verdict.text += "; " + SmallText(*small.front());
    if (small.size() > 1) verdict.text += "; " + std::to_string(small.size()) + " components are zero or negligible";
    verdict.kind = VerdictKind::kSolved;
  }
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
  verdict.concerns = solution.reached_limits;
  JudgeCertificate(solution, verdict);
  const bool known = accuracy.source != AccuracySource::kNotEstimated && !std::isnan(accuracy.error);
  verdict.kind = known ? VerdictKind::kErrorEstimated : VerdictKind::kErrorUnknown;
  if (known) {
    JudgeErrors(accuracy, verdict);
  } else {
    verdict.text = "reached T, error not estimated";
    // If the other grids failed, there is nothing to compare the last one with.
    if (accuracy.tolerance > 0) {
      verdict.text = "reached T: the error is not known, allowed is " + FormatNumber(accuracy.tolerance);
      verdict.concerns.insert(verdict.concerns.begin(), "There is no solve to compare this one with.");
    }
  }
  verdict.success = verdict.concerns.empty();
  if (!verdict.success && verdict.text.starts_with("reached T,")) {
    verdict.text = "reached T: " + WithSmallLetter(verdict.concerns.front());
  }
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
