// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/time_stepping_section.h"

#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/analysis/interior_point.h"
#include "core/discretization/grid.h"
#include "core/format_number.h"
#include "core/linalg/norms.h"
#include "core/matrix_classes/relative_degree.h"
#include "core/stepping/newton_bounds.h"

namespace dlcs {

AnalysisSection RelativeDegreeSection(const Problem& problem, Selection selection) {
  const auto degrees = RelativeDegrees(problem.A, problem.B, problem.N, problem.M);
  const std::vector<Index> rows = ImpulsiveRows(degrees);
  const std::vector<Index> unreached = UnreachedRows(degrees);

  Finding finding{"at-most-one", "y acts on every constraint through at most one integration", {}, ""};
  finding.fact.answer = rows.empty() && unreached.empty() ? Answer::kYes : Answer::kNo;
  finding.fact.why = rows.empty() ? "no constraint has a higher relative degree" : DescribeRows(rows, degrees);
  if (!unreached.empty()) finding.fact.why = "y never affects " + DescribeRows(unreached, degrees);
  finding.fact.witness.indices = rows.empty() ? unreached : rows;

  AnalysisSection section{"relative-degree", "Relative degree", {}, {}, {}};
  section.findings.push_back(std::move(finding));
  if (IsAlwaysLipschitz(selection)) return section;  // M y acts on w directly, for every state
  if (!rows.empty()) {
    section.warnings.push_back("y affects " + DescribeRows(rows, degrees) +
                               " through two or more integrations only: where active, solutions need impulses.");
  }
  if (!unreached.empty()) {
    section.warnings.push_back("y never affects " + DescribeRows(unreached, degrees) +
                               ": A, f, g and x0 alone decide whether N x + g >= 0 holds there.");
  }
  return section;
}

namespace {

std::string Source(const char* statement) { return std::string(statement) + " of [Chen & Xiang 2013]"; }

class TimeSteppingWriter {
 public:
  TimeSteppingWriter(const Problem& problem, const Options& options, const MatrixClass& matrix_class,
                     Selection selection)
      : problem_(problem),
        options_(options),
        matrix_class_(matrix_class),
        selection_(selection),
        grid_(MakeGrid(problem.horizon, BreakPoints(problem), options)) {
    section_.id = "time-stepping";
    section_.title = "Time stepping and Newton's method";
  }

  AnalysisSection Write() && {
    if (IsAlwaysLipschitz(selection_)) kappa_ = RightHandSideLipschitz(problem_, matrix_class_.lipschitz);
    if (kappa_) {
      const SolutionChoice choice(selection_, problem_.selector, matrix_class_);
      first_ = Value(BoundFirstStep(problem_, choice, *kappa_, grid_.runs.front().step));
      interval_ = Value(GuaranteeInterval(problem_, choice, *kappa_));
    }
    WriteInteriorPoint();
    WriteStep();
    WriteBounds();
    WriteFirstStep();
    WriteInterval();
    return std::move(section_);
  }

 private:
  // The problem is valid, so its sources have values.
  template <typename T>
  static std::optional<T> Value(absl::StatusOr<std::optional<T>> result) {
    return result.ok() ? *std::move(result) : std::nullopt;
  }

  void Add(std::string id, std::string symbol, std::string title, std::optional<double> value, ConstantKind kind,
           std::string why, const char* statement) {
    section_.constants.push_back(
        {std::move(id), std::move(symbol), std::move(title), value, kind, std::move(why), Source(statement)});
  }

  std::string WhyNoKappa() const {
    if (!IsAlwaysLipschitz(selection_)) return "y need not be a Lipschitz function of x for this M";
    return "no bound of 𝓛 is known for this M (n = " + std::to_string(problem_.num_constraints()) + ")";
  }

  void WriteInteriorPoint() {
    auto g = TimeFunctionEvaluator::Create(problem_.g, problem_.num_constraints(), AxisOf(problem_));
    Finding finding{"interior-point", "The constraints at the start have an interior point", {}, Source("(4.1)")};
    if (g.ok()) {
      Vector g0(problem_.num_constraints());
      g->Evaluate(0, Side::kRight, g0);
      finding.fact = TestInteriorPoint(problem_.N * problem_.x0 + g0, problem_.M);
    }
    section_.findings.push_back(std::move(finding));
  }

  void WriteStep() {
    const Finding finding{"newton-step", "The step is within the bound of Newton's method", JudgeStep(),
                          Source("Theorem 3.2")};
    section_.findings.push_back(finding);
    const bool asked_for = options_.method == Method::kTimeStepping && options_.step_solver == StepSolver::kNewton;
    if (!asked_for || finding.fact.yes()) return;
    section_.warnings.push_back("Newton's method is not guaranteed to converge: " + finding.fact.why + ".");
  }

  Fact JudgeStep() const {
    if (!kappa_) return {Answer::kUnknown, WhyNoKappa()};
    const double h = grid_.longest_step;
    const std::string step = "h = " + FormatNumber(h), bound = "1/(3κ) = " + FormatNumber(1 / (3 * *kappa_));
    if (3 * h * *kappa_ >= 1) return {Answer::kNo, step + " is not below " + bound};
    if (!first_) return {Answer::kUnknown, "LCP(N x0 + g(h), M) has no solution"};
    if (!first_->newton_is_sure()) {
      return {Answer::kUnknown, step + " is below " + bound + ", but iterates as far from x0 as γ_1 may have no y"};
    }
    return {Answer::kYes, step + " is below " + bound + ", and the ball of γ_1 around x0 is feasible"};
  }

  void WriteBounds() {
    std::optional<double> below_kappa, below_three_kappa;
    std::string norms = WhyNoKappa(), why = "κ is not known";
    if (kappa_) {
      below_kappa = 1 / *kappa_;
      below_three_kappa = 1 / (3 * *kappa_);
      why = "";
      norms = "‖A‖ = " + FormatNumber(InfinityNorm(problem_.A)) + ", 𝓛 = " + FormatNumber(*matrix_class_.lipschitz) +
              ", ‖B‖ = " + FormatNumber(InfinityNorm(problem_.B)) + ", ‖N‖ = " + FormatNumber(InfinityNorm(problem_.N));
    }
    Add("kappa", "κ", "Lipschitz constant of the right-hand side", kappa_, ConstantKind::kUpperBound, norms,
        "section 3");
    Add("contraction-step", "1/κ", "shorter steps have one solution", below_kappa, ConstantKind::kLowerBound, why,
        "Lemma 3.1");
    Add("newton-bound", "1/(3κ)", "with shorter steps Newton's method converges", below_three_kappa,
        ConstantKind::kLowerBound, why, "Theorem 3.2");
  }

  void WriteFirstStep() {
    std::optional<double> gamma, gamma_1;
    std::string why = kappa_ ? "LCP(N x0 + g(h), M) has no solution" : "κ is not known", why_1 = why;
    if (first_) {
      gamma = first_->gamma;
      gamma_1 = first_->gamma_1;
      const std::string step = "h = " + FormatNumber(first_->step);
      why = gamma ? step : step + " is not below 1/κ";
      why_1 = gamma_1 ? step : step + " is not below 1/(3κ)";
    }
    Add("gamma", "γ", "the first step moves x no further", gamma, ConstantKind::kUpperBound, why, "Lemma 3.1");
    Add("gamma-1", "γ_1", "nor Newton's iterates of the first step", gamma_1, ConstantKind::kUpperBound, why_1,
        "Theorem 3.2");
  }

  void WriteInterval() {
    std::optional<double> until;
    ConstantKind kind = ConstantKind::kLowerBound;
    std::string why = kappa_ ? "(4.1) is not known to hold" : "κ is not known";
    if (interval_ && selection_ == Selection::kUnique) {
      until = problem_.horizon;
      why = "M is a P-matrix: γ = ∞, so that T_0 = 1/κ can be added again and again";
    } else if (interval_) {
      until = interval_->interval;
      if (interval_->sampled) kind = ConstantKind::kEstimate;
      why = "T = " + FormatNumber(interval_->horizon) + ", γ = " + FormatNumber(interval_->gamma) +
            " in (4.2), c_0 = " + FormatNumber(interval_->speed);
    }
    Add("t-0", "T_0", "until then there is one solution", until, kind, why, "Theorem 4.1");
  }

  const Problem& problem_;
  const Options& options_;
  const MatrixClass& matrix_class_;
  Selection selection_;
  Grid grid_;
  std::optional<double> kappa_;
  std::optional<FirstStep> first_;
  std::optional<GuaranteedInterval> interval_;
  AnalysisSection section_;
};

}  // namespace

AnalysisSection TimeSteppingSection(const Problem& problem, const Options& options, const MatrixClass& matrix_class,
                                    Selection selection) {
  return TimeSteppingWriter(problem, options, matrix_class, selection).Write();
}

}  // namespace dlcs
