// SPDX-License-Identifier: Apache-2.0
#include "core/verdict.h"

#include <cmath>
#include <cstdio>

#include "core/number_text.h"

namespace dlcs {
namespace {

// A figure with two digits: no estimate has more.
std::string Figure(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", value);
  return text;
}

// One thing that the certificate measures, against its size.
struct Measure {
  const char* what;
  double value;
  double size;

  double relative() const { return value > 0 ? value / size : 0; }  // 0/0 is no misfit
};

void AddConcerns(const Solution& solution, Verdict& verdict) {
  const Certificate& c = solution.certificate;
  for (const Measure& measure : {Measure{"the residual of the LCP at nodes", c.node_residual, c.lcp_scale},
                                 Measure{"the residual of the LCP between nodes", c.midpoint_residual, c.lcp_scale},
                                 Measure{"the defect of x'", c.ode_defect, c.ode_scale}}) {
    if (!(measure.relative() > kConcern)) continue;
    verdict.concerns.push_back(std::string(1, static_cast<char>(measure.what[0] - 'a' + 'A')) + (measure.what + 1) +
                               " is " + Figure(measure.relative()) +
                               " of its size: shorter steps would resolve what is there.");
  }
}

std::string Within(const Accuracy& accuracy) {
  return "an error of " + FormatNumber(accuracy.asked) + (accuracy.asked_by_default ? " (the default)" : "");
}

}  // namespace

Verdict JudgeSolution(const Solution& solution) {
  const Accuracy& accuracy = solution.accuracy;
  Verdict verdict;
  if (solution.termination != Termination::kReachedEnd) {
    verdict.text = std::string("not solved: ") + TerminationName(solution.termination);
    return verdict;
  }
  const bool known = accuracy.source != AccuracySource::kNotEstimated && !std::isnan(accuracy.error);
  verdict.success = true;
  AddConcerns(solution, verdict);
  if (!known) {
    verdict.kind = VerdictKind::kErrorUnknown;
    verdict.text = "reached T, error not estimated";
    return verdict;
  }
  const std::string estimated = "estimated error " + Figure(accuracy.error);
  const bool met = accuracy.source == AccuracySource::kControlled && accuracy.error <= accuracy.asked;
  if (met && verdict.concerns.empty()) {
    verdict.kind = VerdictKind::kSolved;
    verdict.text = "SOLVED within " + Within(accuracy) + ", " + estimated;
    return verdict;
  }
  verdict.kind = VerdictKind::kErrorEstimated;
  verdict.text = "reached T, " + estimated;
  if (accuracy.asked > 0 && !met) verdict.text += ", where " + FormatNumber(accuracy.asked) + " was aimed at";
  verdict.success = !(accuracy.error > kNoSuccess);
  if (accuracy.error > kConcern) {
    verdict.concerns.insert(verdict.concerns.begin(),
                            "The estimated error is " + Figure(100 * accuracy.error) +
                                " % of the size of x: take shorter steps, or ask for an error.");
  }
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
