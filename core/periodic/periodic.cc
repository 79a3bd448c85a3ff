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
#include "core/driver/step_control.h"
#include "core/event_driven/event_driven.h"
#include "core/event_driven/event_record.h"
#include "core/event_driven/mode_sizes.h"
#include "core/format_number.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"
#include "core/periodic/oscillation.h"
#include "core/periodic/period_map.h"
#include "core/periodic/stability.h"
#include "core/problem/options.h"
#include "core/problem/source_periods.h"
#include "core/problem/violation_list.h"

namespace dlcs {
namespace {

// If a pivot of I - dΦ/dx0 is below this part of the largest one, a multiplier counts as 1.
constexpr double kSingular = 1e-11;
// The transient is followed for so many periods at least before the search ends. Where a mode lasts for no step there
// is no derivative and no other way, and errors of a multiplier of 0.95 decay to 1e-9 in so many.
constexpr Index kPeriods = 400;
constexpr int kMaxElsewhere = 3;  // periods after which x returned, but on another branch
// A residual, relative to the sizes, below which a start counts as periodic.
constexpr double kIsPeriodic = 1e-8;
// The Newton step below which solves are as accurate as the answer. The next step is of the order of its square, so
// that for a quarter of it one more solve is loose at most, and for four times as much one less.
constexpr double kNear = 1e-2;
// The share of the tolerance that the errors of a period may use: most is left for the start. Steps between events are
// of so high an order that a quarter of it takes some tenth more of them.
constexpr double kShare = 0.1;
// Of a transient that does not settle so many periods are tried once more, those that Newton's method moves least: near
// close returns are unstable solutions. Source: D. Auerbach et al. Exploring chaotic motion through periodic orbits.
// Phys. Rev. Lett. 58, 2387-2389, 1987. PeriodicTest.DisturbancesDoWhatTheMultipliersSay needs them.
constexpr std::size_t kCloseReturns = 8;
constexpr double kShorter = 3.0 / 4;  // each of Newton's full steps shortens the next one to this part
// The shortest of Newton's steps, which shortens the next one by a 32nd only. Two more halvings would cost two more
// periods, which are better spent on the transient.
constexpr double kShortestStep = 1.0 / 8;

// A solve of one period with the Newton step from its start. Unknowns are the states in units of their sizes, and after
// them the period in its own units if it is unknown.
struct Iterate {
  PeriodSolve solve;
  bool is_accurate = false;
  double tolerance = 0;  // of the solve
  Vector scale = {};     // of the unknowns
  Vector residual = {};  // x(P) - x(0), in these units; 0 for the phase condition
  Matrix inverse = {};   // of the derivative of -residual; empty where it is singular or not known
  bool is_singular = false;
  Vector step = {};    // Newton's
  Vector errors = {};  // of the unknowns, from the errors of the period

  bool has_step() const { return step.size() > 0; }
};

// Where the solution from x0 is that is followed, period after period.
struct Transient {
  Vector x, y;  // at the end of the last period
  double period = 0;
  double residual = std::numeric_limits<double>::quiet_NaN();  // of that period
  bool is_near = false;
};

// The begin of a period that was followed, and how far Newton's method would move it.
struct CloseReturn {
  Vector x, y;
  double period = 0;
  double moved = 0;
};

class Search {
 public:
  // `horizon`: that of the problem of which `problem` is one period.
  Search(const Problem& problem, double horizon, const Options& options, Plan plan, Observer& observer,
         std::stop_token stop)
      : asked_(options),
        problem_(problem),
        horizon_(horizon),
        most_work_(EventRecord::kPatience * MaxDefaultEventWork(0, BreakPoints(problem).size())),
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
  absl::StatusOr<Outcome> RunNewton();
  absl::Status TakeNewtonStep(bool& accepted);
  absl::Status FollowOnePeriod(Transient& transient);
  void KeepIfClose();
  absl::StatusOr<Outcome> TryCloseReturns();
  absl::Status AddStability();
  Outcome Judge(bool is_transient);
  bool IsAnswer();
  bool IsNear() const;
  bool Repeats() const;  // the period ends on the branch on which it began
  bool IsAtRest() const;
  bool IsUnstable() const;
  bool IsAtEnd() const;
  bool HasShorterPeriod(Index& parts) const;
  void Fail(std::string why);
  void FailAtEnd();
  Solution Finish(double phase);

  const Options& asked_;
  const Problem& problem_;
  const double horizon_;
  const Index most_work_;
  const bool finds_period_;
  const double tolerance_;
  double tight_;  // of an accurate solve
  PeriodMap map_;
  Index solves_before_ = 0, work_before_ = 0;  // of the transient in which the oscillation was found
  Iterate current_;
  Index newton_steps_ = 0;
  Index followed_ = 0, idle_ = 0;  // periods of the transient; accepted steps of Newton's method without progress
  std::vector<CloseReturn> close_returns_;  // the closest first
  int elsewhere_ = 0;
  StabilityJudgement stability_;
  // The error of the start that the decay of residuals implies, while one period follows the other.
  double error_of_transient_ = std::numeric_limits<double>::quiet_NaN();
  bool found_ = false;
  std::string why_none_;
};

absl::StatusOr<Iterate> Search::Evaluate(const Vector& start, const Vector& y_before, double period, bool accurate) {
  const double loose = std::min(tolerance_, Options::kDefaultErrorTolerance);
  const double tolerance = accurate ? std::min(tight_, loose) : loose;
  auto solve = map_.Solve(start, y_before, period, tolerance, accurate);
  if (!solve.ok()) return solve.status();
  Iterate iterate{.solve = *std::move(solve), .is_accurate = accurate, .tolerance = tolerance};
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
  auto transient =
      map_.Solve(problem_.x0, Vector(), problem_.horizon, Options::kDefaultErrorTolerance, /*as_asked=*/false);
  if (!transient.ok()) return transient.status();
  solves_before_ = map_.solves();
  work_before_ = map_.work();
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

// The solution was followed for many periods, as far as a solve does, or longer where that takes no more work than a
// solve may take by default.
bool Search::IsAtEnd() const {
  return followed_ >= kPeriods && static_cast<double>(followed_) * current_.solve.period >= horizon_ &&
         map_.work() - work_before_ >= most_work_;
}

bool Search::IsAnswer() {
  if (!current_.is_accurate || !Repeats()) return false;
  if (current_.has_step()) {
    // Below the errors of the period there is nothing to gain.
    const double allowed = std::max(tolerance_ / 2, std::min(kNear, MaxAbs(current_.errors)));
    // What the start is off by may grow within the period, as where a contact turns speed into force.
    return MaxAbs(current_.step) <= allowed && MaxAbs(current_.residual) <= allowed;
  }
  return error_of_transient_ <= tolerance_ / 2;
}

// Whether the solution returns to its start after a part of the period too.
bool Search::HasShorterPeriod(Index& parts) const {
  constexpr Index kMaxParts = 8;
  constexpr int kMargin = 10;  // no solve has a larger tolerance than the default
  const PeriodSolve& solve = current_.solve;
  for (parts = kMaxParts; parts > 1; --parts) {
    const double time = solve.period / static_cast<double>(parts);
    const TrajectoryPiece& piece = PieceAt(solve.solution, time);
    const Vector distance = (StateAt(piece, time) - solve.start).cwiseAbs();
    if (solve.y_size.size() > 0 && !solve.IsOnBranch(BranchAt(piece, time))) continue;
    const Vector unit = solve.range.cwiseMax(kAtRest * solve.size);
    if ((distance.array() <= kMargin * Options::kDefaultErrorTolerance * unit.array()).all()) return true;
  }
  return false;
}

Search::Outcome Search::Judge(bool is_transient) {
  if (!current_.solve.reached) return Outcome::kNone;
  if (finds_period_ && IsAtRest()) {
    // Newton's method may also end in a period of no length, or in an equilibrium that the solution leaves.
    if (!is_transient) return Outcome::kSearching;
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
  return Outcome::kSearching;
}

// Why nothing was found up to the end of the search.
void Search::FailAtEnd() {
  const std::string change = FormatNumber(MaxAbs(current_.residual)) + " of its size in a period.";
  if (current_.is_singular) {
    return Fail("No periodic solution was found: 1 is a multiplier, and x still changes by " + change +
                " Something grows from period to period (a resonance without losses, or an integrator whose input has "
                "a mean), or comes to rest slowly.");
  }
  Fail("No periodic solution was found in " + std::to_string(map_.solves() - solves_before_) + " periods, in " +
       std::to_string(followed_) + " of which the solution from x0 was followed: x still changes by " + change +
       " Start from an x0 that is nearer, or try a multiple of the period.");
}

// Of a search that is not at its end, the solution through the last start.
bool Search::IsUnstable() const {
  const auto multipliers = MultipliersOf(DerivativeAcross(current_.solve, current_.solve.size, finds_period_).value);
  return !multipliers.empty() && std::abs(multipliers.front()) > 1;
}

absl::Status Search::TakeNewtonStep(bool& accepted) {
  const Index m = current_.solve.start.size();
  accepted = false;
  if (IsNear()) {
    const double amplification = current_.inverse.leftCols(m).cwiseAbs().rowwise().sum().maxCoeff();
    tight_ = std::clamp(kShare * tolerance_ / amplification, Options::kMinErrorTolerance, tolerance_);
  }
  for (double part = 1; part >= kShortestStep; part /= 2) {
    const Vector change = part * current_.step.cwiseProduct(current_.scale);
    const double of_period = finds_period_ ? change[m] / current_.solve.period : 0;
    const bool is_sensible = change.allFinite() && 2 * std::abs(of_period) <= 1;
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
        accepted = next <= (1 - part * (1 - kShorter)) * MaxAbs(current_.step) || next <= tolerance_ / 2;
      }
      if (accepted) {
        ++newton_steps_;
        current_ = *std::move(trial);
        return absl::OkStatus();
      }
    }
    // If the solution is stable, it is better to follow it first.
    if (finds_period_ && !is_sensible) continue;
    if (!IsUnstable() && ++idle_ > followed_) return absl::OkStatus();
  }
  return absl::OkStatus();
}

absl::Status Search::FollowOnePeriod(Transient& transient) {
  auto next = Evaluate(transient.x, transient.y, transient.period, transient.is_near);
  if (!next.ok()) return next.status();
  ++followed_;
  current_ = *std::move(next);
  if (!current_.solve.reached) return absl::OkStatus();
  KeepIfClose();
  const double residual = MaxAbs(current_.residual);
  // What is left of a residual that shrinks by the same factor in every period.
  const double factor = residual / transient.residual;
  error_of_transient_ = std::numeric_limits<double>::infinity();
  if (residual <= RoundingOf(kRoundedUlps)) error_of_transient_ = residual;
  if (factor < 1) error_of_transient_ = residual / (1 - factor);
  transient = {current_.solve.end, current_.solve.y_end, current_.solve.period, residual, IsNear()};
  return absl::OkStatus();
}

void Search::KeepIfClose() {
  if (!current_.has_step()) return;
  const PeriodSolve& solve = current_.solve;
  const double moved = MaxAbs(current_.step);
  const auto place = std::find_if(close_returns_.begin(), close_returns_.end(),
                                  [moved](const CloseReturn& other) { return moved < other.moved; });
  close_returns_.insert(place, {solve.start, solve.y_before, solve.period, moved});
  if (close_returns_.size() > kCloseReturns) close_returns_.pop_back();
}

// Together they may take as many steps without progress as periods were followed.
absl::StatusOr<Search::Outcome> Search::TryCloseReturns() {
  Iterate last = std::move(current_);
  for (const CloseReturn& close : close_returns_) {
    auto iterate = Evaluate(close.x, close.y, close.period, /*accurate=*/false);
    if (!iterate.ok()) return iterate.status();
    current_ = *std::move(iterate);
    error_of_transient_ = std::numeric_limits<double>::infinity();
    idle_ = followed_ - followed_ / static_cast<Index>(kCloseReturns);
    const auto outcome = RunNewton();
    if (!outcome.ok() || *outcome != Outcome::kSearching) return outcome;
  }
  current_ = std::move(last);
  return Outcome::kSearching;
}

// Newton's method from the last period, until it finds something, or wanders.
//
// Each step claims to shorten the way to the answer: the next step, taken with the same matrix, is shorter by the part
// that TakeNewtonStep() asks for. With its own matrix it may be longer, as where the modes that the solution passes
// change with its start. Such steps are no progress, nor are shorter ones that are tried on the way to a stable
// solution. The method may take no more of both than periods of the transient were followed, so that it costs no more
// than the transient does; steps that do shorten the way are few.
absl::StatusOr<Search::Outcome> Search::RunNewton() {
  bool wanders = false;
  for (bool is_first = true; true; is_first = false) {
    const Outcome outcome = Judge(/*is_transient=*/is_first);
    Index parts = 1;
    if (outcome == Outcome::kFound && finds_period_ && HasShorterPeriod(parts)) {
      auto shorter = Evaluate(current_.solve.start, current_.solve.y_before,
                              current_.solve.period / static_cast<double>(parts), true);
      if (!shorter.ok()) return shorter.status();
      current_ = *std::move(shorter);
      continue;
    }
    if (outcome != Outcome::kSearching) return outcome;
    if (wanders || !current_.has_step() || (!Repeats() && IsNear())) return outcome;
    const Vector unit = current_.scale;
    const double before = MaxAbs(current_.step);
    bool accepted = false;
    if (absl::Status status = TakeNewtonStep(accepted); !status.ok()) return status;
    if (!accepted) return outcome;
    const bool is_shorter = current_.has_step() &&
                            MaxAbs(current_.step.cwiseProduct(current_.scale).cwiseQuotient(unit)) <= kShorter * before;
    wanders = (finds_period_ && IsAtRest()) || (!is_shorter && ++idle_ > followed_);
  }
}

// Newton's method, and where it wanders the transient for as many periods as the method took, and so on.
absl::Status Search::Iterations() {
  Transient transient{current_.solve.end, current_.solve.y_end, current_.solve.period};
  if (current_.solve.reached) {
    transient.residual = MaxAbs(current_.residual);
    transient.is_near = IsNear();
  }
  while (true) {
    const Index solves = map_.solves();
    const auto outcome = RunNewton();
    if (!outcome.ok()) return outcome.status();
    found_ = *outcome == Outcome::kFound;
    if (*outcome != Outcome::kSearching) return absl::OkStatus();
    if (IsAtEnd()) break;
    for (Index left = std::max<Index>(1, map_.solves() - solves); left > 0 && !IsAtEnd(); --left) {
      if (absl::Status status = FollowOnePeriod(transient); !status.ok()) return status;
      if (!current_.solve.reached) break;
    }
  }
  const auto outcome = TryCloseReturns();
  if (!outcome.ok()) return outcome.status();
  found_ = *outcome == Outcome::kFound;
  if (*outcome == Outcome::kSearching) FailAtEnd();
  return absl::OkStatus();
}

// Solves the period once more, from a start as far away as the error of x(0) allows. A disturbance of x(0) may be off
// the constraints that the state obeys there; what is left of it after the period is not.
absl::Status Search::AddStability() {
  const PeriodSolve& solve = current_.solve;
  if (!solve.has_derivative()) return absl::OkStatus();
  const Index m = solve.start.size();
  KnownDerivative derivative = DerivativeAcross(solve, solve.size, finds_period_);
  Matrix changes = Matrix::Constant(m, m, std::numeric_limits<double>::infinity());
  // Where the solution only touches a guard, the derivative is that of one side.
  if (current_.has_step() && !solve.flow().grazes) {
    const Vector away = current_.step.head(m).cwiseAbs() + current_.errors.head(m);
    const auto forwards = current_.step.head(m).array() >= 0;
    const Vector change = forwards.select(away, -away).cwiseProduct(solve.size);
    const auto other = map_.SolveOtherwise(solve, solve.end + solve.flow().derivative * change, current_.tolerance);
    if (!other.ok()) return other.status();
    if (other->reached && other->has_derivative()) {
      const KnownDerivative second = DerivativeAcross(*other, solve.size, finds_period_);
      changes = (second.value - derivative.value).cwiseAbs() +
                kRoundedUlps * std::numeric_limits<double>::epsilon() * derivative.value.cwiseAbs();
    }
  }
  derivative.errors += changes;
  stability_ = JudgeStability(derivative);
  return absl::OkStatus();
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
    record.stability = stability_.stability;
    record.growth = stability_.growth;
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
  if (found_) {
    if (absl::Status status = AddStability(); !status.ok()) return status;
  }
  return Finish(phase);
}

}  // namespace

absl::StatusOr<Solution> SolvePeriodic(const Problem& problem, const Options& options, Observer& observer,
                                       std::stop_token stop, SetupCache* setups) {
  const auto started = std::chrono::steady_clock::now();
  OnePeriod one = options.period > 0 ? ProblemOfOnePeriod(problem, options.period) : OnePeriod{.problem = problem};
  one.problem.measurements.clear();  // their times are those of the problem
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
  Search search(one.problem, problem.horizon, options, *std::move(plan), observer, std::move(stop));
  auto solution = search.Run(one.phase);
  if (!solution.ok()) return solution;
  solution->cost.predicted_bytes = predicted_bytes;
  solution->cost.seconds_total = SecondsSince(started);
  solution->warnings.insert(solution->warnings.begin(), report.warnings.begin(), report.warnings.end());
  return solution;
}

}  // namespace dlcs
