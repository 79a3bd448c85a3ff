// SPDX-License-Identifier: Apache-2.0
#include "core/driver/report.h"

#include "core/format_number.h"
#include "core/linalg/decompositions.h"
#include "core/linalg/norms.h"
#include "core/stepping/time_stepping.h"

namespace dlcs {
namespace {

// Results of different eliminations that differ by less than this part are the same.
constexpr double kZero = 1e-9;

constexpr Index kMaxConstraintsOfMinors = 20;

// M^h as the options make it.
std::string CoupledMatrixText(const Options& options, bool two_stages) {
  if (two_stages) return "γh N (I - γhA)⁻¹ B + M";
  return std::string(options.average_y ? "h/2 N (I - hA/2)⁻¹ B" : "h N (I - h(1-θ)A)⁻¹ B") + " + M";
}

// Whether a symmetric positive definite P with P X = Y exists: X'Y is symmetric, positive semidefinite, and of the rank
// of X and of Y.
bool HaveStorage(const Matrix& X, const Matrix& Y) {
  const Matrix product = X.transpose() * Y;
  const double size = MaxAbs(product);
  if (MaxAbs(product - product.transpose()) > kZero * size) return false;
  const Eigen::SelfAdjointEigenSolver<Matrix> form(product);
  if (form.eigenvalues().minCoeff() < -kZero * size) return false;
  const Index rank = (form.eigenvalues().array() > kZero * size).count();
  const auto rank_of = [&](const Matrix& of) { return Eigen::FullPivLU<Matrix>(of).setThreshold(kZero).rank(); };
  return rank == rank_of(X) && rank == rank_of(Y);
}

// For positive semidefinite M: whether x may be one of several. Let d and e be the differences of two solutions x and
// y, so that e'(N d + M e) <= 0. If P B z = Nᵀ z for a symmetric positive definite P and every z with (M + Mᵀ) z = 0,
// then (d'P d)' <= c d'P d for some c, and d = 0. False where there is no such z with B z other than zero, for M = 0,
// where N B decides, and where the answer would take long.
bool MayLeaveStatesOpen(const Problem& problem) {
  constexpr Index kMaxPairs = 300, kMaxEntries = 10'000'000;
  if (problem.num_constraints() > kMaxPairs || problem.B.size() > kMaxEntries || problem.M.IsZero()) return false;
  const Matrix &M = problem.M.Dense(), &B = problem.B.Dense();
  const Eigen::SelfAdjointEigenSolver<Matrix> form(M + M.transpose());
  const double size = MaxAbs(form.eigenvalues());
  Matrix null(M.rows(), 0);
  for (Index k = 0; k < M.rows(); ++k) {
    if (std::abs(form.eigenvalues()[k]) > kZero * size) continue;
    null.conservativeResize(Eigen::NoChange, null.cols() + 1);
    null.rightCols(1) = form.eigenvectors().col(k);
  }
  if (null.cols() == 0) return false;
  const Matrix of_B = B * null;
  if (MaxAbs(of_B) <= kZero * MaxAbs(B)) return false;
  return !HaveStorage(of_B, problem.N.Dense().transpose() * null);
}

}  // namespace

AnalysisReport ReportOn(const Problem& problem, const Options& options, const Plan& plan) {
  AnalysisReport report;
  report.matrix_class = plan.matrix_class.description;
  report.method = plan.method.method;
  report.reason = plan.method.reason;
  report.num_states = problem.num_states();
  report.num_constraints = problem.num_constraints();
  report.lipschitz = plan.matrix_class.lipschitz;
  if (!plan.finds_steps(options)) {
    report.num_steps = plan.grid.num_steps();
    report.step = plan.grid.longest_step;
    WarnOfCoupledClass(problem, options, plan, plan.grid.longest_step, report.warnings);
  }
  for (std::string& warning : SourceWarnings(problem)) report.warnings.push_back(std::move(warning));
  if (plan.method.inelastic_impact) {
    report.warnings.push_back(
        "Solved as inelastic impact: where a constraint with N x + g = 0 would be violated, the state jumps so that "
        "(N x + g)' = 0. The options ask for this law; it is not part of the system.");
  }
  const MatrixClass& matrix_class = plan.matrix_class;
  const bool may_be_several = plan.selection == Selection::kAny && matrix_class.p.answer == Answer::kNo &&
                              matrix_class.positive_semidefinite.answer == Answer::kNo;
  if (may_be_several && !plan.is_refused()) {
    report.warnings.push_back(
        "M is " + matrix_class.description +
        ": y, and x with it, may be one of several solutions, of which other methods and other steps may "
        "follow another.");
  }
  const bool is_monotone = plan.selection == Selection::kAny && matrix_class.p.answer == Answer::kNo &&
                           matrix_class.positive_semidefinite.answer == Answer::kYes;
  if (is_monotone && !plan.is_refused() && MayLeaveStatesOpen(problem)) {
    report.warnings.push_back(
        "M is " + matrix_class.description +
        ", and B is not zero where M + Mᵀ is: x may be one of several solutions. A rule (--rule) says which is meant.");
  }
  if (!plan.method.impulsive_rows.empty()) {
    report.warnings.push_back("y affects " + plan.method.impulsive +
                              " only through two or more integrations: if it becomes active, solutions need impulses.");
  }
  if (!plan.method.unreached.empty() && !plan.is_refused()) {
    report.warnings.push_back("y never affects w of " + plan.method.unreached +
                              ": where that w is zero, its y may be any number, and zero is taken.");
  }
  return report;
}

Solution Refusal(const Problem& problem, const Plan& plan, const AnalysisReport& report) {
  Solution refused;
  refused.termination = Termination::kUnsupported;
  refused.message = plan.refusal();
  refused.failure_time = 0;
  refused.method = plan.method.method;
  refused.reason = plan.method.reason;
  refused.warnings = report.warnings;
  refused.cost.predicted_bytes = plan.predicted_bytes;
  refused.x.resize(problem.num_states(), 0);
  refused.y.resize(problem.num_constraints(), 0);
  refused.w.resize(problem.num_constraints(), 0);
  return refused;
}

Solution StoppedBeforeTheStart(Index num_states, Index num_constraints) {
  Solution stopped;
  stopped.termination = Termination::kCancelled;
  stopped.message = "Stopped on request before the first step.";
  stopped.failure_time = 0;
  stopped.x.resize(num_states, 0);
  stopped.y.resize(num_constraints, 0);
  stopped.w.resize(num_constraints, 0);
  return stopped;
}

void WarnOfCoupledClass(const Problem& problem, const Options& options, const Plan& plan, double step,
                        std::vector<std::string>& warnings) {
  if (plan.method.method != Method::kTimeStepping || plan.is_refused()) return;
  if (options.step_solver == StepSolver::kNewton) return;  // its LCPs are those of M
  const bool unique = plan.selection == Selection::kUnique;
  if (!unique && plan.selection != Selection::kLeastElement) return;
  if (problem.num_constraints() > kMaxConstraintsOfMinors) return;
  const Matrix coupled = CoupledStepMatrix(problem, options, plan.method.two_stages, step);
  if (!coupled.allFinite()) return;
  const MatrixClass of_coupled = Classify(coupled);
  const Fact& fact = unique ? of_coupled.p : of_coupled.z;
  if (fact.answer != Answer::kNo) return;
  warnings.push_back(std::string("M is a ") + (unique ? "P" : "Z") + "-matrix, but M^h = " +
                     CoupledMatrixText(options, plan.method.two_stages) + " of the step h = " + FormatNumber(step) +
                     " is not (" + fact.why + "): a step may have no solution or another one; take a smaller step.");
}

}  // namespace dlcs
