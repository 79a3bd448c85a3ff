// SPDX-License-Identifier: Apache-2.0
#include "core/periodic/periodic.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "core/driver/report.h"
#include "core/event_driven/mode_sizes.h"
#include "core/format_number.h"
#include "core/linalg/norms.h"
#include "core/periodic/oscillation.h"
#include "core/periodic/period_map.h"
#include "core/problem/source_periods.h"
#include "core/problem/violation_list.h"

namespace dlcs {
namespace {

// Periods integrated before the search ends. Newton's method needs a few; the transient that replaces it may need more.
constexpr Index kMaxPeriods = 400;
// If a pivot of I - dΦ/dx0 is below this part of the largest one, a multiplier counts as 1.
constexpr double kSingular = 1e-11;
constexpr int kMaxSingular = 12;  // periods in a row
constexpr int kMaxElsewhere = 3;  // periods after which x returned, but on another branch
// A residual, relative to the sizes, below which a start counts as periodic.
constexpr double kIsPeriodic = 1e-8;
// The tolerance of a period far from the answer, and the Newton step below which solves are as accurate as the answer.
constexpr double kLooseTolerance = 1e-6;
constexpr double kNear = 1e-2;
// The smallest tolerance of a period, and the share of the tolerance that the errors of a period may use.
constexpr double kTightest = 1e-13;
constexpr double kShare = 0.1;
// An oscillation that is smaller than this part of the size of every state is an equilibrium.
constexpr double kAtRest = 1e-6;
constexpr double kShortestStep = 1.0 / 8;  // of Newton's
constexpr Index kLongestRun = 32;          // of periods without a Newton step
constexpr double kUnstable = 1 + 1e-6;

// A solve of one period with the Newton step from its start. Unknowns are the states in units of their sizes, and after
// them the period in its own units if it is unknown.
struct Iterate {
  PeriodSolve solve;
  bool is_accurate = false;
  Vector scale = {};     // of the unknowns
  Vector residual = {};  // x(P) - x(0), in these units; 0 for the phase condition
  Matrix inverse = {};   // of the derivative of -residual; empty where it is singular or not known
  bool is_singular = false;
  Vector step = {};    // Newton's
  Vector errors = {};  // of the unknowns, from the errors of the period

  bool has_step() const { return step.size() > 0; }
};

class Search {
 public:
  Search(const Problem& problem, const Options& options, Plan plan, Observer& observer, std::stop_token stop)
      : asked_(options),
        problem_(problem),
        finds_period_(options.period == Options::kFindPeriod),
        tolerance_(options.error_tolerance > 0 ? options.error_tolerance : Options::kDefaultErrorTolerance),
        tight_(kShare * tolerance_),
        map_(problem, options, std::move(plan), observer, std::move(stop)) {}

  absl::StatusOr<Solution> Run(double phase);

 private:
  enum class Outcome { kSearching, kFound, kNone };

  absl::Status FindStart(Vector& start, Vector& y_before, double& period);
  absl::StatusOr<Iterate> Evaluate(const Vector& start, const Vector& y_before, double period, bool accurate);
  void AddStep(Iterate& iterate) const;
  absl::Status Iterations();
  absl::Status TakeNewtonStep(bool& accepted);
  absl::Status FollowOnePeriod();
  Outcome Judge();
  bool IsAnswer();
  bool IsNear() const;
  bool Repeats() const;  // the period ends on the branch on which it began
  bool IsAtRest() const;
  bool HasShorterPeriod(Index& parts) const;
  void Fail(std::string why);
  Solution Finish(double phase);

  const Options& asked_;
  const Problem& problem_;
  const bool finds_period_;
  const double tolerance_;
  double tight_;  // of an accurate solve
  PeriodMap map_;
  Index solves_before_ = 0;  // of the transient in which the oscillation was found
  Iterate current_;
  Index newton_steps_ = 0;
  int singular_in_a_row_ = 0, elsewhere_ = 0;
  // While one period follows the other: the residual of the previous one, and the error of the start that the decay of
  // residuals implies.
  double residual_before_ = std::numeric_limits<double>::quiet_NaN();
  double error_of_transient_ = std::numeric_limits<double>::quiet_NaN();
  bool found_ = false;
  std::string why_none_;
};

absl::StatusOr<Iterate> Search::Evaluate(const Vector& start, const Vector& y_before, double period, bool accurate) {
  const double loose = std::min(tolerance_, kLooseTolerance);
  auto solve = map_.Solve(start, y_before, period, accurate ? std::min(tight_, loose) : loose, accurate);
  if (!solve.ok()) return solve.status();
  Iterate iterate{.solve = *std::move(solve), .is_accurate = accurate};
  if (iterate.solve.reached) AddStep(iterate);
  return iterate;
}

void Search::AddStep(Iterate& iterate) const {
  const PeriodSolve& solve = iterate.solve;
  const Index m = solve.start.size(), unknowns = m + (finds_period_ ? 1 : 0);
  iterate.scale.resize(unknowns);
  iterate.scale.head(m) = solve.size;
  iterate.residual = Vector::Zero(unknowns);
  iterate.residual.head(m) = (solve.end - solve.start).cwiseQuotient(solve.size);
  if (!solve.has_derivative()) return;
  Matrix system = Matrix::Zero(unknowns, unknowns);
  const Matrix scaled = solve.size.cwiseInverse().asDiagonal() * solve.flow().derivative * solve.size.asDiagonal();
  system.topLeftCorner(m, m) = Matrix::Identity(m, m) - scaled;
  if (finds_period_) {
    iterate.scale[m] = solve.period;
    system.col(m).head(m) = -solve.period * solve.flow().end_slope.cwiseQuotient(solve.size);
    // The start moves across the solution, not along it.
    const Vector along = solve.period * solve.flow().begin_slope.cwiseQuotient(solve.size);
    system.row(m).head(m) = along.transpose();
  }
  const Eigen::FullPivLU<Matrix> factors = system.fullPivLu();
  const double largest = factors.maxPivot();
  const double least = std::abs(factors.matrixLU()(unknowns - 1, unknowns - 1));
  iterate.is_singular = !(least > kSingular * std::max(1.0, largest));
  if (iterate.is_singular) return;
  iterate.inverse = factors.inverse();
  iterate.step = iterate.inverse * iterate.residual;
  iterate.errors = iterate.inverse.leftCols(m).cwiseAbs() * solve.error;
}

// Follows the solution up to T, and takes an oscillation from its second half. Without one, says why.
absl::Status Search::FindStart(Vector& start, Vector& y_before, double& period) {
  auto transient = map_.Solve(problem_.x0, Vector(), problem_.horizon, kLooseTolerance, /*as_asked=*/false);
  if (!transient.ok()) return transient.status();
  solves_before_ = map_.solves();
  current_.solve = *std::move(transient);
  if (!current_.solve.reached) return absl::OkStatus();
  auto found = FindOscillation(current_.solve.solution, problem_.horizon);
  if (const auto* oscillation = std::get_if<Oscillation>(&found)) {
    start = oscillation->state;
    if (problem_.rule == SolutionRule::kHistory) y_before = oscillation->y;
    period = oscillation->period;
  } else {
    Fail(std::get<std::string>(std::move(found)));
  }
  return absl::OkStatus();
}

void Search::Fail(std::string why) { why_none_ = std::move(why); }

bool Search::IsNear() const { return MaxAbs(current_.has_step() ? current_.step : current_.residual) <= kNear; }

bool Search::Repeats() const { return current_.solve.IsOnBranch(current_.solve.y_end); }

bool Search::IsAtRest() const { return (current_.solve.range.array() <= kAtRest * current_.solve.size.array()).all(); }

bool Search::IsAnswer() {
  if (!current_.is_accurate || !Repeats()) return false;
  if (current_.has_step()) {
    // Below the errors of the period there is nothing to gain.
    constexpr double kOfErrors = 4;
    return MaxAbs(current_.step) <= std::max(tolerance_ / 2, std::min(kNear, kOfErrors * MaxAbs(current_.errors)));
  }
  return error_of_transient_ <= tolerance_ / 2;
}

// Whether the solution returns to its start after a part of the period too.
bool Search::HasShorterPeriod(Index& parts) const {
  constexpr Index kMaxParts = 8;
  constexpr double kSame = 1e-5;
  const PeriodSolve& solve = current_.solve;
  for (parts = kMaxParts; parts > 1; --parts) {
    const double time = solve.period / static_cast<double>(parts);
    const TrajectoryPiece& piece = PieceAt(solve.solution, time);
    const Vector distance = (StateAt(piece, time) - solve.start).cwiseAbs();
    if (solve.y_size.size() > 0 && !solve.IsOnBranch(BranchAt(piece, time))) continue;
    if ((distance.array() <= kSame * solve.range.array().max(kAtRest * solve.size.array())).all()) return true;
  }
  return false;
}

Search::Outcome Search::Judge() {
  if (!current_.solve.reached) return Outcome::kNone;
  if (finds_period_ && IsAtRest()) {
    Fail("No oscillation was found: the solution decays to an equilibrium.");
    return Outcome::kNone;
  }
  if (current_.is_singular && MaxAbs(current_.residual) <= kIsPeriodic && Repeats()) {
    Fail(std::string("The periodic solution is not isolated: ") +
         (finds_period_ ? "1 is a multiplier more than once" : "1 is a multiplier") +
         ", so states near x(0) are periodic too, as those of a circuit without losses are, and nothing says which "
         "one is meant. x0 of the problem is on one of them, or near.");
    return Outcome::kNone;
  }
  if (IsAnswer()) return Outcome::kFound;
  if (!Repeats() && MaxAbs(current_.residual) <= kIsPeriodic && ++elsewhere_ > kMaxElsewhere) {
    Fail(
        "No periodic solution was found: x returns after the period, but y is then on another branch of solutions, as "
        "that of a comparator which has switched. Try twice the period.");
    return Outcome::kNone;
  }
  singular_in_a_row_ = current_.is_singular ? singular_in_a_row_ + 1 : 0;
  if (singular_in_a_row_ >= kMaxSingular) {
    Fail("No periodic solution was found: 1 is a multiplier, and x still changes by " +
         FormatNumber(MaxAbs(current_.residual)) +
         " of its size in a period. Something grows from period to period (a resonance without losses, or an "
         "integrator whose input has a mean), or comes to rest slowly.");
    return Outcome::kNone;
  }
  if (map_.solves() - solves_before_ >= kMaxPeriods) {
    Fail("No periodic solution was found in " + std::to_string(map_.solves() - solves_before_) +
         " periods: x still changes by " + FormatNumber(MaxAbs(current_.residual)) +
         " of its size in a period. Start from an x0 that is nearer, or try a multiple of the period.");
    return Outcome::kNone;
  }
  return Outcome::kSearching;
}

absl::Status Search::TakeNewtonStep(bool& accepted) {
  constexpr double kMostOfPeriod = 0.5;
  const Index m = current_.solve.start.size();
  accepted = false;
  if (IsNear()) {
    const double amplification = current_.inverse.leftCols(m).cwiseAbs().rowwise().sum().maxCoeff();
    tight_ = std::clamp(kShare * tolerance_ / amplification, kTightest, tolerance_);
  }
  for (double part = 1; part >= kShortestStep; part /= 2) {
    const Vector change = part * current_.step.cwiseProduct(current_.scale);
    const double of_period = finds_period_ ? change[m] / current_.solve.period : 0;
    const bool is_sensible = change.allFinite() && std::abs(of_period) <= kMostOfPeriod;
    if (is_sensible) {
      auto trial = Evaluate(current_.solve.start + change.head(m), current_.solve.y_end,
                            current_.solve.period * (1 + of_period), IsNear());
      if (!trial.ok()) return trial.status();
      if (trial->solve.solution.termination == Termination::kCancelled) {
        current_ = *std::move(trial);
        accepted = true;
        return absl::OkStatus();
      }
      if (trial->solve.reached) {
        Vector residual = Vector::Zero(current_.residual.size());
        residual.head(m) = (trial->solve.end - trial->solve.start).cwiseQuotient(current_.scale.head(m));
        const double next = MaxAbs(current_.inverse * residual);
        accepted = next <= (1 - part / 4) * MaxAbs(current_.step) || next <= tolerance_ / 2;
      }
      if (accepted) {
        ++newton_steps_;
        current_ = *std::move(trial);
        return absl::OkStatus();
      }
    }
    // If the solution is stable, it is better to follow it.
    const auto multipliers = MultipliersOf(current_.solve.flow().derivative);
    if (finds_period_ && !is_sensible) continue;
    if (multipliers.empty() || std::abs(multipliers.front()) <= kUnstable) return absl::OkStatus();
  }
  return absl::OkStatus();
}

absl::Status Search::FollowOnePeriod() {
  const double before = MaxAbs(current_.residual);
  auto next = Evaluate(current_.solve.end, current_.solve.y_end, current_.solve.period, IsNear());
  if (!next.ok()) return next.status();
  current_ = *std::move(next);
  // What is left of a residual that shrinks by the same factor in every period.
  const double factor = MaxAbs(current_.residual) / before;
  error_of_transient_ = std::numeric_limits<double>::infinity();
  if (MaxAbs(current_.residual) == 0) error_of_transient_ = 0;
  if (factor < 1 && residual_before_ == before) error_of_transient_ = MaxAbs(current_.residual) / (1 - factor);
  residual_before_ = MaxAbs(current_.residual);
  return absl::OkStatus();
}

absl::Status Search::Iterations() {
  Index run = 1;
  while (true) {
    const Outcome outcome = Judge();
    if (outcome == Outcome::kNone) return absl::OkStatus();
    if (outcome == Outcome::kFound) {
      Index parts = 1;
      if (!finds_period_ || !HasShorterPeriod(parts)) {
        found_ = true;
        return absl::OkStatus();
      }
      auto shorter = Evaluate(current_.solve.start, current_.solve.y_before,
                              current_.solve.period / static_cast<double>(parts), true);
      if (!shorter.ok()) return shorter.status();
      current_ = *std::move(shorter);
      continue;
    }
    bool accepted = false;
    if (current_.has_step() && (Repeats() || !IsNear())) {
      if (absl::Status status = TakeNewtonStep(accepted); !status.ok()) return status;
    }
    if (accepted) {
      run = 1;
      continue;
    }
    for (Index k = 0; k < run && current_.solve.reached; ++k) {
      if (absl::Status status = FollowOnePeriod(); !status.ok()) return status;
      if (!current_.has_step() && IsAnswer()) break;
    }
    run = std::min(2 * run, kLongestRun);
  }
}

// Removes jumps at 0 that are no larger than the errors: the start is then the state after them.
void DropJumpOfRounding(const Vector& size, double part, Solution& solution) {
  std::erase_if(solution.jumps, [&](const StateJump& jump) {
    return jump.time == 0 && (jump.dx.array().abs() <= part * size.array()).all();
  });
}

Solution Search::Finish(double phase) {
  Solution solution = std::move(current_.solve.solution);
  const PeriodSolve& solve = current_.solve;
  PeriodicRecord record;
  record.periods = map_.solves() - solves_before_;
  record.newton_iterations = newton_steps_;
  record.phase = phase;
  const bool has_period = solve.reached && current_.residual.size() > 0;
  if (has_period) {
    record.period = solve.period;
    record.multipliers = MultipliersOf(solution.flow->derivative);
    record.residual = MaxAbs(current_.residual);
    SetAverages(solution, record);
  }
  if (found_) {
    Accuracy& accuracy = solution.accuracy;
    const Index m = solve.start.size();
    const Vector of_start = current_.has_step() ? Vector(current_.step.cwiseAbs() + current_.errors)
                                                : Vector::Constant(m, error_of_transient_);
    record.error = MaxAbs(of_start);
    DropJumpOfRounding(solve.size, std::max(tolerance_, record.error), solution);
    // A step that is no more than what rounding makes of the start is rounding too.
    const Vector rounding =
        current_.has_step()
            ? Vector(current_.inverse.leftCols(m).cwiseAbs() * accuracy.errors.x.rounding.cwiseQuotient(solve.size))
            : Vector::Zero(m);
    accuracy.errors.x.truncation += (of_start - 2 * rounding).cwiseMax(0).head(m).cwiseProduct(solve.size);
    accuracy.errors.x.rounding += rounding.head(m).cwiseProduct(solve.size);
    // An error of the start moves y, w and outputs by as much of their sizes, as far as is known.
    for (const ComponentKind kind : {ComponentKind::kPair, ComponentKind::kSlack, ComponentKind::kOutput}) {
      ErrorsByCause& errors = accuracy.errors.of(kind);
      errors.truncation += record.error * errors.own;
    }
    accuracy.source = AccuracySource::kControlled;
    accuracy.tolerance = tolerance_;
    accuracy.tolerance_is_default = asked_.error_tolerance == 0;
    JudgeBesideModes(map_.problem(), map_.plan().selection, asked_, solution);
    solution.termination = Termination::kReachedEnd;
    solution.failure_time = std::numeric_limits<double>::quiet_NaN();
    solution.message = "Periodic with the period " + FormatNumber(solve.period) + ", found in " +
                       std::to_string(record.periods) + (record.periods == 1 ? " period" : " periods") + ".";
    if (!solution.jumps.empty() && !asked_.project_initial_state) {
      solution.termination = Termination::kInconsistentState;
      solution.failure_time = solution.jumps.front().time;
      solution.message = "The periodic solution jumps at t = " + FormatNumber(solution.failure_time) +
                         " in every period, where the state is inconsistent. Allow the projection of inconsistent "
                         "states if such jumps are meant.";
    }
    if (solution.flow->grazes) {
      solution.warnings.push_back(
          "At an event of the period a component of y or w only touches zero: the multipliers hold on one side of the "
          "solution at best.");
    }
    if (record.multipliers.empty()) {
      solution.warnings.push_back(
          "The multipliers are not known, since steps without a mode were taken: the solution was followed until it "
          "repeated.");
    }
  } else if (!why_none_.empty()) {
    solution.termination = Termination::kNotPeriodic;
    solution.failure_time = std::numeric_limits<double>::quiet_NaN();
    solution.message = why_none_;
  } else if (solution.termination != Termination::kCancelled) {
    solution.message +=
        " This was period " + std::to_string(record.periods) + " of the search for a periodic solution.";
  }
  solution.periodic = std::move(record);
  if (!asked_.keep_pieces) solution.pieces.clear();
  if (!asked_.keep_flow) solution.flow.reset();
  return solution;
}

absl::StatusOr<Solution> Search::Run(double phase) {
  Vector start = problem_.x0, y_before;
  double period = problem_.horizon;
  if (finds_period_) {
    if (absl::Status status = FindStart(start, y_before, period); !status.ok()) return status;
    if (!current_.solve.reached || !why_none_.empty()) return Finish(phase);
  }
  auto first = Evaluate(start, y_before, period, /*accurate=*/false);
  if (!first.ok()) return first.status();
  current_ = *std::move(first);
  if (absl::Status status = Iterations(); !status.ok()) return status;
  return Finish(phase);
}

}  // namespace

absl::StatusOr<Solution> SolvePeriodic(const Problem& problem, const Options& options, Observer& observer,
                                       std::stop_token stop, SetupCache* setups) {
  const auto started = std::chrono::steady_clock::now();
  const OnePeriod one =
      options.period > 0 ? ProblemOfOnePeriod(problem, options.period) : OnePeriod{.problem = problem};
  // Up to T it is valid; a period may be longer.
  if (const auto violations = Validate(one.problem); !violations.empty()) return StatusOf(violations);
  auto plan = MakePlan(one.problem, options, setups);
  if (!plan.ok()) return plan.status();
  AnalysisReport report = ReportOn(one.problem, options, *plan);
  if (one.phase > 0) {
    report.warnings.push_back("The sources repeat from t = " + FormatNumber(one.phase) +
                              " on; the period that is shown begins there.");
  }
  observer.OnAnalysis(report);
  if (plan->is_refused()) return Refusal(one.problem, *plan, report);
  const double predicted_bytes = plan->predicted_bytes;
  Search search(one.problem, options, *std::move(plan), observer, std::move(stop));
  auto solution = search.Run(one.phase);
  if (!solution.ok()) return solution;
  solution->cost.predicted_bytes = predicted_bytes;
  solution->cost.seconds_total = SecondsSince(started);
  solution->warnings.insert(solution->warnings.begin(), report.warnings.begin(), report.warnings.end());
  return solution;
}

}  // namespace dlcs
