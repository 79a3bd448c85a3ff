// SPDX-License-Identifier: Apache-2.0
#include "core/analyze.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include "core/analysis/class_section.h"
#include "core/analysis/index_one_section.h"
#include "core/analysis/laplace_section.h"
#include "core/analysis/solution_section.h"
#include "core/analysis/time_stepping_section.h"
#include "core/driver/propagator_choice.h"
#include "core/matrix_classes/class_profile.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/parallel/stop_scope.h"
#include "core/problem/mass_matrix.h"
#include "core/problem/validate.h"
#include "core/problem/violation_list.h"

namespace dlcs {
namespace {

std::string DescribeRule(Selection selection) {
  const std::string name = SelectionName(selection);
  if (selection == Selection::kUnique) return name + " (M is a P-matrix)";
  if (selection == Selection::kLeastElement) return name + " (M is a Z-matrix)";
  return name;
}

// Sections that form A as a dense matrix take cubic time and are left out beyond this number of states or pairs.
constexpr Index kMaxWrittenDown = 2000;

bool IsTooLarge(const Problem& problem) {
  return std::max(problem.num_states(), problem.num_constraints()) > kMaxWrittenDown;
}

AnalysisSection NotComputed(const char* id, const char* title, const Problem& problem) {
  AnalysisSection section{id, title, {}, {}, {}};
  const std::string size =
      std::to_string(problem.num_states()) + " states and " + std::to_string(problem.num_constraints()) + " pairs";
  section.findings.push_back({"computed",
                              "All was looked at",
                              {Answer::kNo, "not computed: too large, " + size + "; at most " +
                                                std::to_string(kMaxWrittenDown) + " of each are looked at here"},
                              ""});
  return section;
}

// The sections that look at A as the matrix of x' = A x + ....
void AddSectionsOfA(const Problem& problem, const Options& options, const std::stop_token& stop,
                    const MatrixClass& matrix_class, Selection selection, std::vector<AnalysisSection>& sections) {
  if (problem.has_mass()) {
    if (!IsTooLarge(problem)) {
      return AddSectionsOfA(WithoutMass(problem), options, stop, matrix_class, selection, sections);
    }
    sections.push_back(NotComputed("laplace-inversion", "Iteration by Laplace inversion", problem));
    sections.push_back(NotComputed("time-stepping", "Time stepping and Newton's method", problem));
  } else {
    sections.push_back(LaplaceSection(problem, options, matrix_class, selection));
    sections.push_back(TimeSteppingSection(problem, options, matrix_class, selection));
  }
  if (matrix_class.zero_row) {
    sections.push_back(IsTooLarge(problem) ? NotComputed("relative-degree", "Relative degree", problem)
                                           : RelativeDegreeSection(problem, selection));
  }
  if (problem.M.IsZero()) {
    sections.push_back(IsTooLarge(problem) ? NotComputed("index-one", "Index one: M = 0", problem)
                                           : IndexOneSection(problem, stop));
  }
}

// All parts, one after the other: what is there when it is stopped is complete.
absl::Status Fill(const Problem& problem, const Options& options, const std::stop_token& stop, Analysis& analysis) {
  analysis.num_states = problem.num_states();
  analysis.num_constraints = problem.num_constraints();
  analysis.horizon = problem.horizon;
  const MatrixClass matrix_class = Classify(problem.M, problem.rule);
  const auto selection = SelectRule(problem.rule, matrix_class);
  if (!selection.ok()) return selection.status();
  analysis.matrix_class = matrix_class.description;
  analysis.rule = DescribeRule(*selection);
  analysis.sections.push_back(ClassSection(problem.M));
  analysis.sections.push_back(SolutionSection(problem, matrix_class, *selection, stop));
  AddSectionsOfA(problem, options, stop, matrix_class, *selection, analysis.sections);
  auto recommendation = Recommend(problem, options, stop);
  if (!recommendation.ok()) return recommendation.status();
  analysis.recommendation = *std::move(recommendation);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Analysis> Analyze(const Problem& problem, const Options& options, std::stop_token stop) {
  if (absl::Status status = CheckValid(problem, options); !status.ok()) return status;
  if (!problem.switching.is_empty()) return InvalidField("switching", "problems with switches are not analyzed yet");
  return AnalyzeValidated(problem, options, std::move(stop));
}

absl::StatusOr<Analysis> AnalyzeValidated(const Problem& problem, const Options& options, std::stop_token stop) {
  const auto started = std::chrono::steady_clock::now();
  Analysis analysis;
  const StopScope scope(stop);
  try {
    const std::optional<Problem> form = FormToSolve(problem, options);
    if (absl::Status status = Fill(form ? *form : problem, options, stop, analysis); !status.ok()) return status;
  } catch (const Stopped&) {
  }
  for (const AnalysisSection& section : analysis.sections) {
    analysis.warnings.insert(analysis.warnings.end(), section.warnings.begin(), section.warnings.end());
  }
  const std::vector<std::string>& met = analysis.recommendation.warnings;
  analysis.warnings.insert(analysis.warnings.end(), met.begin(), met.end());
  if (stop.stop_requested()) analysis.warnings.push_back("The analysis was stopped before it was complete.");
  analysis.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return analysis;
}

}  // namespace dlcs
