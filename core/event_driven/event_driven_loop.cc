// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/event_driven_loop.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <utility>

#include "core/context/consistency.h"
#include "core/linalg/abs_times.h"
#include "core/linalg/balance.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

constexpr int kAttempts = ModeSearch::kAttempts;
// So many modes in a row, each shorter than this part of the horizon: modes accumulate. One in which the
// state moves by less than the tolerance counts for many.
constexpr int kMaxShortModes = 256;
constexpr int kCountOfStill = 32;
constexpr double kShortModePart = 1e-6;
// A step of less than this part of the horizon is not worth a collocation, unless a mode has a rate for it; nor does a
// mode last that ends so soon.
constexpr double kShortestPart = 1e-12;
constexpr double kNoModePart = 1e-14;
// Error control never requires less than this part of the tolerance of one step.
constexpr double kMinShare = 0.02;
// If an event cuts a step to less than this part, the step is repeated with a shorter length, because the part after
// the event may have made its error look small.
constexpr double kMinKept = 0.5;
// A step is at most so many times longer than the last two modes were: rounding grows with the length, and
// where modes accumulate little else is left.
constexpr double kLongestAfterEvent = 16;
// Steps are controlled with this part of the tolerance: errors of single steps add up, and grow with the
// system.
constexpr double kSafety = 0.05;
// Rounding of this part of the terms of a constraint does not take a state off it.
constexpr double kOnConstraints = 1e-12;
// Of what is no more than this part of them nothing is known.
constexpr double kRoundingOfConstraints = 64 * std::numeric_limits<double>::epsilon();
constexpr Index kMaxCoupledSteps = 40000;
// Both sides of a break point are known to rounding. Rounding is all that makes g jump at a kink there.
constexpr double kNoJumpAtBreak = 1e-14;

}  // namespace

EventDrivenLoop::EventDrivenLoop(SolveContext& context, double tolerance, Index most_work, EventRecord& record)
    : context_(context),
      problem_(context.problem),
      sampler_(context.sources, ProbeTimes(context.problem)),
      tolerance_(kSafety * tolerance),
      most_work_(most_work),
      record_(record),
      search_(problem_, context.selection, sampler_),
      coupled_steps_(problem_, context.selection, sampler_),
      output_(problem_, context.grid, context.options.keep_pieces),
      errors_(problem_, context.y_is_lipschitz()),
      progress_(context),
      x_(problem_.x0),
      y_(Vector::Zero(problem_.num_constraints())),
      w_(y_) {
  magnitudes_.x = magnitudes_.x_reach = x_.cwiseAbs();
  magnitudes_.x_noise = Vector::Zero(problem_.num_states());
  magnitudes_.rounding = Matrix::Zero(problem_.num_states(), 3);
  magnitudes_.y = magnitudes_.w = Vector::Zero(problem_.num_constraints());
  magnitudes_.By = Vector::Zero(problem_.num_states());
  magnitudes_.g = magnitudes_.y;
  sizes_ = SizesOfData();
  if (context.options.keep_flow) flow_.emplace(problem_.num_states(), !context.y_is_lipschitz());
}

bool EventDrivenLoop::Run() {
  const std::vector<double> breaks = BreakPoints(problem_);
  std::vector<double> ends = KnownKinks(problem_);
  ends.push_back(problem_.horizon);
  const double norm = InfinityNorm(Balance(problem_.A.Dense()).matrix);
  length_ = norm > 0 ? 4 / norm : problem_.horizon;
  bool may_jump = true;
  for (const double end : ends) {
    if ((t_ == 0 || (may_jump && SourceJumps(t_, kNoJumpAtBreak))) && !Start(t_)) return false;
    if (!Cross(end)) return false;
    may_jump = std::binary_search(breaks.begin(), breaks.end(), end);
    if (may_jump || end == problem_.horizon) Record(output_.EndInterval(end, x_, y_, w_));
  }
  progress_.Finish(problem_.horizon);
  return true;
}

// What every state would settle at, or reach by T: without y, and where M determines y, by what M_ii y_i balances in
// N x + g. Of a state that stays zero, what N x + g would notice.
DataSizes EventDrivenLoop::SizesOfData() {
  const Index m = problem_.num_states(), n = problem_.num_constraints();
  constexpr int kLooks = 16;
  DataSizes sizes{problem_.x0.cwiseAbs(), Vector::Zero(m), Vector::Zero(n)};
  Vector f(m), g(n);
  for (int k = 0; k <= kLooks; ++k) {
    const double t = problem_.horizon * k / kLooks;
    sampler_.F(t, k == kLooks ? Side::kLeft : Side::kRight, f);
    sampler_.G(t, k == kLooks ? Side::kLeft : Side::kRight, g);
    if (f.allFinite()) sizes.f = sizes.f.cwiseMax(f.cwiseAbs());
    if (g.allFinite()) sizes.g = sizes.g.cwiseMax(g.cwiseAbs());
  }
  const Vector rates = problem_.A.Dense().diagonal().cwiseAbs().cwiseMax(1 / problem_.horizon);
  sizes.x = sizes.x.cwiseMax(sizes.f.cwiseQuotient(rates));
  const Vector driven = AbsTimes(problem_.A.Dense(), sizes.x).cwiseQuotient(rates) / static_cast<double>(m);
  sizes.x = sizes.x.cwiseMax(driven);
  const Vector rows = sizes.g.cwiseMax(AbsTimes(problem_.N.Dense(), sizes.x));
  if (context_.y_is_lipschitz()) {
    const Vector y = rows.cwiseQuotient(problem_.M.Dense().diagonal());
    sizes.x = sizes.x.cwiseMax(AbsTimes(problem_.B.Dense(), y).cwiseQuotient(rates));
  }
  for (Index i = 0; i < m; ++i) {
    if (sizes.x[i] > 0) continue;
    double noticed = std::numeric_limits<double>::infinity();
    for (Index j = 0; j < n; ++j) {
      const double of_state = std::abs(problem_.N.Dense()(j, i));
      if (of_state > 0 && rows[j] > 0) noticed = std::min(noticed, rows[j] / of_state);
    }
    if (std::isfinite(noticed)) sizes.x[i] = noticed;
  }
  return sizes;
}

DataSizes EventDrivenLoop::SizesSoFar() const {
  DataSizes sizes = sizes_;
  sizes.x = sizes.x.cwiseMax(magnitudes_.x);
  return sizes;
}

bool EventDrivenLoop::Start(double begin) {
  Vector g(problem_.num_constraints());
  sampler_.G(begin, Side::kRight, g);
  // What is no more than the rounding of x is zero: N x alone shows no other size than its own.
  x_ = (x_.array().abs() <= magnitudes_.x_noise.array()).select(0, x_);
  bool y_is_solution = false;
  const std::size_t jumps = context_.solution.jumps.size();
  if (!StartInterval(context_, begin, g, x_, y_, y_is_solution)) return false;
  if (flow_ && context_.solution.jumps.size() > jumps) flow_->AddJump(context_.jump_derivative);
  return true;
}

bool EventDrivenLoop::Cross(double end) {
  mode_ = nullptr;
  attempt_ = 0;
  short_modes_ = 0;
  mode_begin_ = t_;
  last_mode_length_ = end - t_;
  gap_.reset();
  event_step_.reset();
  kink_.reset();
  while (t_ < end) {
    if (context_.stop.stop_requested()) return context_.FailCancelled(t_);
    record_.modes_made = search_.modes_made();
    if (IsBeyondWork()) {
      return context_.Fail(Termination::kIterationLimit, t_,
                           "The work allowed by default ended at t = " + FormatNumber(t_) + ": set a tolerance.");
    }
    if (kink_ && t_ >= *kink_ && !PassKink()) return false;
    if (IsStuck()) return false;
    progress_.At(t_);
    Progressed progressed = mode_ ? Progressed::kYes : Choose(end);
    if (progressed == Progressed::kYes) progressed = Advance(end);
    if (progressed == Progressed::kFailed) return false;
    if (progressed == Progressed::kNoMode && !TakeCoupledSteps(end)) return false;
  }
  return true;
}

// A solve that gets forward so evenly that it will end within kPatience times its work may go on: many short modes are
// no sign that it will not end.
bool EventDrivenLoop::IsBeyondWork() const {
  constexpr double kPatience = 8;
  const auto work = static_cast<double>(record_.Work(problem_.num_states()));
  const auto most = static_cast<double>(most_work_);
  return work >= most && work >= kPatience * most * (t_ / problem_.horizon);
}

// Continues after a kink of the sources as after a break point. If g jumps there, the state may jump too.
bool EventDrivenLoop::PassKink() {
  constexpr double kNoJump = 1e-10;
  mode_ = nullptr;
  attempt_ = 0;
  gap_.reset();
  event_step_.reset();
  const bool jumps = SourceJumps(*kink_, kNoJump);
  kink_.reset();
  return !jumps || Start(t_);
}

// Whether g jumps at `time` by more than `part` of its size and than what the rounding of `time` makes of it, which is
// much where g is steep. Where it does not, the state is as consistent as it was before.
bool EventDrivenLoop::SourceJumps(double time, double part) {
  constexpr double kRoundingOfTime = 4 * std::numeric_limits<double>::epsilon();
  const Index n = problem_.num_constraints();
  Vector before(n), left(n), right(n), behind(n);
  sampler_.G(time * (1 - kRoundingOfTime), Side::kRight, before);
  sampler_.G(time, Side::kLeft, left);
  sampler_.G(time, Side::kRight, right);
  sampler_.G(time * (1 + kRoundingOfTime), Side::kLeft, behind);
  const Vector noise = (left - before).cwiseAbs() + (behind - right).cwiseAbs();
  return ((right - left).array().abs() > part * context_.row_size.array() + noise.array()).any();
}

// So many steps, taken or not, that have not come forward by this part of the horizon: something was not foreseen.
bool EventDrivenLoop::IsStuck() {
  constexpr Index kMaxTries = 8192;
  constexpr double kMinProgress = 1e-3;
  if (t_ - tries_from_ > kMinProgress * problem_.horizon) {
    tries_ = 0;
    tries_from_ = t_;
  }
  if (++tries_ <= kMaxTries) return false;
  context_.Fail(Termination::kIterationLimit, t_,
                "The steps do not get past t = " + FormatNumber(t_) +
                    " with the required accuracy. If f, g or a solution of "
                    "theirs is not smooth there, declare that time as a break point; or allow a larger error.");
  return true;
}

// Proposes the next mode that y is determined in.
EventDrivenLoop::Progressed EventDrivenLoop::Choose(double end) {
  bool lost_least_element = false;
  while (attempt_ < kAttempts || TryAgainFromBelow()) {
    const bool trusts_guess = may_start_below_ && attempt_ % 2 == 0;
    const ModeSearch::Proposal proposal =
        search_.Find(t_, x_, magnitudes_.x_noise, SizesSoFar(), length_, end - t_, attempt_++, trusts_guess);
    const bool solved = proposal.verdict == LcpStatus::kSolved;
    lost_least_element = lost_least_element || (solved && !proposal.kept_selection);
    mode_ = proposal.kept_selection ? proposal.mode : nullptr;
    if (mode_) {
      if (record_.intervals.empty() && record_.rejected_steps == 0) BeginWith(*mode_);
      return Progressed::kYes;
    }
    why_coupled_ = solved ? "the active set does not determine y (relative degree above one)"
                          : "the coupled LCP that proposes an active set was not solved";
  }
  if (!lost_least_element) return Progressed::kNoMode;
  context_.FailLostLeastElement(t_);
  return Progressed::kFailed;
}

// The first step: by the fastest eigenvalue, which has no units but that of time.
void EventDrivenLoop::BeginWith(const Mode& mode) {
  double fastest = 0;
  for (const std::complex<double>& eigenvalue : mode.eigenvalues) fastest = std::max(fastest, std::abs(eigenvalue));
  length_ = fastest * problem_.horizon > 4 ? 4 / fastest : problem_.horizon;
}

// Another proposal where some are left.
EventDrivenLoop::Progressed EventDrivenLoop::GiveUpMode(const char* why) {
  mode_ = nullptr;
  if (event_step_ && RefineEvent()) return Progressed::kYes;
  why_coupled_ = why;
  return attempt_ < kAttempts || TryAgainFromBelow() ? Progressed::kYes : Progressed::kNoMode;
}

// Once all proposals failed: starts the attempts again, with LetStartBelow(). Only with the rule history, where no
// first-order steps may pass an event. False if there is nothing left to try.
bool EventDrivenLoop::TryAgainFromBelow() {
  if (context_.selection != Selection::kHistory || may_start_below_) return false;
  may_start_below_ = true;
  attempt_ = 0;
  return true;
}

// Locates the last event once more, by steps that end there: at its end a step is far more accurate than inside. A fast
// state or a small M_ii may show the difference to the next mode. What is recorded of the step remains.
bool EventDrivenLoop::RefineEvent() {
  constexpr int kCorrections = 2;
  constexpr double kMaxDelay = 1e-3;  // part of the step
  const EventStep event = *std::exchange(event_step_, std::nullopt);
  const Mode* mode = search_.ModeOf(event.active, SizesSoFar());
  if (!mode) return false;
  double end = t_;
  for (int correction = 0; correction <= kCorrections; ++correction) {
    const double length = end - event.begin;
    sampler_.Sample(event.begin, end, sources_);
    if (!sources_.finite) return false;
    step_ = TakeSmoothStep(*mode, event.x, sources_, magnitudes_, tolerance_, Share(length), nullptr);
    ++record_.rejected_steps;
    if (!(step_.error_ratio <= 1)) return false;
    const auto guard = step_.guard.row(event.guard);
    const LegendreVector at_end = LegendreValues(1);
    const double delay = -length / 2 * guard.dot(at_end) / guard.dot(LegendreSlopes(at_end));
    if (!(std::abs(delay) <= kMaxDelay * length)) return false;
    if (correction < kCorrections) end = std::min(end + delay, event.limit);
  }
  const LegendreVector at_end = LegendreValues(1);
  x_ = ValueOf(step_.x, at_end);
  y_ = ValueOf(step_.y, at_end).cwiseMax(0);
  t_ = mode_begin_ = end;
  gap_.reset();
  attempt_ = 0;
  search_.GuessAfter(*mode, event.guard);
  return true;
}

// Of the horizon, or of the time in which the fastest part of the mode acts; t is known to its rounding only.
double EventDrivenLoop::Shortest(double part_of_horizon, double part_of_rate) const {
  constexpr double kPartOfRate = 0.01;
  constexpr double kOfTime = 2e-15;
  const double acts = mode_ && mode_->rate > 0 ? kPartOfRate / mode_->rate : problem_.horizon;
  return std::max(kOfTime * t_, std::min(part_of_horizon * problem_.horizon, part_of_rate * acts));
}

// Time is known so well near 0 that a mode may be a part of it that is shorter than those parts.
double EventDrivenLoop::ShortestMode() const {
  constexpr double kPartOfTime = 1e-4;
  constexpr double kRoundingOfTime = 4e-16;
  const double shortest = Shortest(kNoModePart, 1e-2);
  return std::max(std::clamp(kPartOfTime * t_, kPartOfTime * shortest, shortest), kRoundingOfTime * t_);
}

// Whether a mode that was proposed here ends at a guard that starts at zero and falls at once: only its level lets it
// last. Another proposal is better, of the first ones that are made of shorter steps.
bool EventDrivenLoop::FallsFromZero(const ModeEnd& mode_end) const {
  constexpr int kShorterSteps = 3;
  if (t_ != mode_begin_ || attempt_ > kShorterSteps) return false;
  const LegendreVector series = step_.guard.row(mode_end.guard).transpose();
  const double begin = series.dot(LegendreValues(-1)), level = step_.guard_level[mode_end.guard];
  return begin < level / 16 && series.dot(LegendreValues((mode_end.s - 1) / 2)) < begin - level / 4;
}

// Lets guards start below zero by the error that is allowed of them or by kLevels levels, if they rise at once: errors
// of large terms of a guard may be more than its level.
void EventDrivenLoop::LetStartBelow() {
  constexpr double kLevels = 64;
  const Vector begin = ValueOf(step_.guard, LegendreValues(-1));
  const Vector slope = ValueOf(step_.guard, LegendreSlopes(LegendreValues(-1)));
  for (Index i = 0; i < begin.size(); ++i) {
    const double allowed = std::max(step_.guard_allowed[i], kLevels * step_.guard_level[i]);
    if (begin[i] < 0 && begin[i] >= -allowed && slope[i] > 0)
      step_.guard_level[i] = std::max(step_.guard_level[i], -2 * begin[i]);
  }
}

// Whether a guard starts below zero by so little that this may be the error of the polynomial, which is smaller on a
// shorter step.
bool EventDrivenLoop::StartsBelowByTruncation(Index guard) const {
  constexpr double kOfTail = 8;
  const double tail = step_.guard_tail[guard];
  const double begin = step_.guard.row(guard).dot(LegendreValues(-1));
  return tail > 4 * step_.guard_noise[guard] && begin < 0 && begin > -kOfTail * tail;
}

double EventDrivenLoop::Share(double length) const { return std::max(length / problem_.horizon, kMinShare); }

double EventDrivenLoop::StepLength(double end) const {
  // A step multiplies a part of x that grows by the Padé approximation of its exponential, which is exact to rounding
  // up to about exp(6). The polynomial inside the step does not show that it grows more: its start is small against its
  // end.
  constexpr double kMaxGrowth = 6;
  double growth = 0;
  for (const std::complex<double>& eigenvalue : mode_->eigenvalues) growth = std::max(growth, eigenvalue.real());
  const double left = (kink_ ? std::min(*kink_, end) : end) - t_;
  const double length = growth * length_ > kMaxGrowth ? kMaxGrowth / growth : length_;
  if (length >= left) return left;
  return std::min(length, left / 2);
}

// One step in the mode: accepted up to its end or to the first event, or shortened, or the mode given up.
EventDrivenLoop::Progressed EventDrivenLoop::Advance(double end) {
  const double length = StepLength(end);
  double step_end = t_ + length;
  for (const double known : {end, kink_.value_or(end)}) {
    if (length == known - t_) step_end = known;  // not beyond a break point by rounding
  }
  sampler_.Sample(t_, step_end, sources_);
  if (!sources_.finite) return FailNonFinite(step_end);
  RaiseReach();
  x_begin_ = x_;
  if (!Project()) return GiveUpMode("the state is off the constraints of the active set");
  x_start_ = x_;
  const auto take = [&] {
    return TakeSmoothStep(*mode_, x_, sources_, magnitudes_, tolerance_, Share(length), gap_ ? &*gap_ : nullptr);
  };
  step_ = take();
  if (step_.error_ratio <= 1 && sampler_.Probe(sources_)) {
    if (!sources_.finite) return FailNonFinite(step_end);
    step_ = take();
  }
  const double factor = 0.9 * std::pow(step_.error_ratio, -1.0 / (kLegendreDegree - 1));
  if (!(step_.error_ratio <= 1)) {
    const double shorter = length * (std::isfinite(factor) ? std::clamp(factor, 0.1, 0.7) : 0.1);
    constexpr double kNoLess = 0.7;
    const bool falls = rejected_in_a_row_ == 0 || step_.error_ratio < kNoLess * rejected_ratio_;
    const double layer_length = falls ? step_.layer_length : step_.small_layer_length;
    rejected_ratio_ = step_.error_ratio;
    return Shorten(std::min(shorter, std::max(layer_length, Shortest(kShortestPart, 1))));
  }

  if (may_start_below_ && t_ == mode_begin_) LetStartBelow();
  const auto mode_end = FindModeEnd(step_);
  if (!mode_end) {
    // Where rounding is all that is seen it does not fall with the length.
    constexpr int kManyOfOneLength = 8;
    of_one_length_ = factor > 1 ? 0 : of_one_length_ + 1;
    const double longer =
        of_one_length_ % kManyOfOneLength == kManyOfOneLength - 1 ? 4.0 : std::clamp(factor, 0.5, 16.0);
    length_ = std::max(length_, length * longer);
    Accept(step_end, 1);
    return Progressed::kYes;
  }
  const double lasted = length * (1 + mode_end->s) / 2;
  const double again = lasted / kMinKept;
  step_.error_ratio =
      NanMax(step_.error_ratio, ErrorRatioBefore(mode_end->s, *mode_, step_, magnitudes_, tolerance_, Share(length)));
  if (!(step_.error_ratio <= 1) && again < length && again > Shortest(kShortestPart, 1)) return Shorten(again);
  if (lasted <= ShortestMode() && StartsBelowByTruncation(mode_end->guard)) return Shorten(length / 8);
  search_.GuessAfter(*mode_, mode_end->guard);
  if (lasted <= ShortestMode() || FallsFromZero(*mode_end)) return GiveUpMode("no active set lasts");
  Accept(t_ + lasted, mode_end->s);
  return EndMode(*mode_end, end);
}

EventDrivenLoop::Progressed EventDrivenLoop::FailNonFinite(double step_end) {
  context_.Fail(Termination::kNonFinite, t_,
                "f or g is not finite between t = " + FormatNumber(t_) + " and " + FormatNumber(step_end) + ".");
  return Progressed::kFailed;
}

EventDrivenLoop::Progressed EventDrivenLoop::Shorten(double length) {
  constexpr int kManyRejected = 3;
  constexpr double kNotSmooth = 1e3;
  const double shortest = Shortest(kShortestPart, 1);
  ++record_.rejected_steps;
  length_ = length;
  const bool may_be_kink =
      ++rejected_in_a_row_ == kManyRejected || (rejected_in_a_row_ == 1 && step_.error_ratio > kNotSmooth);
  if (may_be_kink && !kink_) {
    kink_ = sampler_.FindKink(sources_);
    if (kink_ && *kink_ - t_ <= shortest) kink_.reset();
    if (kink_) length_ = std::max(length_, *kink_ - t_);
  }
  if (length_ >= shortest) return Progressed::kYes;
  why_coupled_ =
      "no step was short enough for the tolerance: the solution changes too fast, or f or g jumps or has a kink at a "
      "time that is no break point";
  length_ = 16 * shortest;
  return Progressed::kNoMode;
}

// An event at t, the end of the last mode.
EventDrivenLoop::Progressed EventDrivenLoop::EndMode(const ModeEnd& mode_end, double end) {
  errors_.AddEvent(*mode_, step_, sources_, mode_end.s, mode_end.guard);
  if (flow_) flow_->AddEvent(*mode_, step_, sources_, mode_end.s, mode_end.guard);
  gap_ = GapOf(step_, sources_);
  event_step_ = {mode_->active, sources_.begin, end, x_start_, mode_end.guard};
  mode_ = nullptr;
  const double lasted = t_ - mode_begin_;
  length_ = std::min(length_, kLongestAfterEvent * std::max(lasted, last_mode_length_));
  last_mode_length_ = lasted;
  mode_begin_ = t_;
  if (lasted > kShortModePart * problem_.horizon) {
    short_modes_ = 0;
    burst_ = 1;
    return Progressed::kYes;
  }
  const Vector slope = SlopeAt(step_, sources_, mode_end.s);
  const bool moved = (lasted * slope.array().abs() > tolerance_ * magnitudes_.x.array()).any();
  short_modes_ += moved ? 1 : kCountOfStill;
  if (short_modes_ < kMaxShortModes) return Progressed::kYes;
  why_coupled_ = "switching times accumulate";
  return Progressed::kNoMode;
}

// By one step of the fastest rate: A x and f, in the units of each component.
void EventDrivenLoop::RaiseReach() {
  const double rate = std::max(mode_->rate, 1 / problem_.horizon);
  Vector& reach = magnitudes_.x_reach;
  reach = magnitudes_.x;
  for (Index k = 0; k < kLegendreDegree; ++k) {
    const Vector next = reach.cwiseMax(0.5 / rate * (AbsTimes(mode_->dynamics, reach) + sources_.f_size));
    const bool grows = (next.array() > 2 * reach.array()).any();
    reach = next;
    if (!grows) break;
  }
}

// Onto the constraints that the mode lays on the state: a drift of rounding, or of the tolerance at its
// start. False, and nothing done, where the state is farther off.
bool EventDrivenLoop::Project() {
  if (mode_->num_algebraic == 0) return true;
  const Vector g = ValueOf(sources_.g, LegendreValues(-1));
  const Matrix of_g = mode_->algebraic_g();
  const Vector residual = mode_->algebraic_rows() * x_ + of_g * g;
  const Vector size = mode_->algebraic_rows().cwiseAbs() * x_.cwiseAbs() + of_g.cwiseAbs() * g.cwiseAbs();
  const Vector rounding = kRoundingOfConstraints * size + of_g.cwiseAbs() * sources_.g_noise;
  const Vector change = mode_->correction * residual;
  if ((residual.array().abs() <= rounding.array()).all()) {
    // What rounding takes slow states off a constraint fast states make up for at once.
    magnitudes_.x_noise = magnitudes_.x_noise.cwiseMax(change.cwiseAbs());
    magnitudes_.rounding.col(2) = change;
    return true;
  }
  const Vector terms = mode_->correction.cwiseAbs() * size;
  const Vector allowed = tolerance_ * magnitudes_.x + kOnConstraints * terms + magnitudes_.x_noise;
  if ((change.array().abs() > allowed.array()).any()) return false;
  x_ -= change;
  magnitudes_.x_noise += change.cwiseAbs().cwiseMin(mode_->correction.cwiseAbs() * rounding);
  return true;
}

// The part of a guard that is below zero but above its level, or that may be: where the guard comes nearer to zero than
// `error`, an event may have been missed.
Dip EventDrivenLoop::MissedDip(Index guard, double error, double s_end) const {
  constexpr double kOfNoise = 1.0 / 16;  // which is a bound
  const LegendreVector series = step_.guard.row(guard).transpose();
  const double noise = step_.guard_noise[guard];
  Dip dip = DipBelowZero(series, kOfNoise * noise, s_end);
  if (!(error > noise)) return dip;
  const auto minimum = LowestMinimum(series, s_end);
  if (!minimum || minimum->value >= error) return dip;
  const double depth = error - std::max(minimum->value, 0.0);
  const double half_width = std::min(1.0, std::sqrt(2 * depth / minimum->curvature));
  dip.depth = NanMax(dip.depth, depth);
  dip.mean = NanMax(dip.mean, 4.0 / 3 * depth * half_width / (1 + s_end));  // of a parabola
  return dip;
}

// The error of x' and of x caused by such guards. An active y_i < 0 should be zero. A w_i < 0 should have made its pair
// active: y_i would be about w_i / M_ii; where M_ii = 0, y_i would have kept x on the constraint. If a constraint
// should have been released earlier, the error of x is what its y causes until then; for a fast state, it is the value
// to which the state settles.
ErrorGrowth::Overlooked EventDrivenLoop::Overlooked(double s_end, double duration) const {
  ErrorGrowth::Overlooked overlooked{Vector::Zero(x_.size()), Vector::Zero(x_.size()), Vector::Zero(y_.size())};
  const Matrix &B = problem_.B.Dense(), &N = problem_.N.Dense(), &M = problem_.M.Dense();
  const Vector error = step_.guard_error + errors_.InGuards(*mode_);
  for (Index i = 0; i < step_.guard.rows(); ++i) {
    const Dip dip = MissedDip(i, error[i], s_end);
    if (dip.depth == 0) continue;
    const double moves = std::abs(N.row(i).dot(B.col(i)));  // w_i by y_i, a unit of time
    if (std::binary_search(mode_->active.begin(), mode_->active.end(), i)) {
      overlooked.slope += dip.mean * B.col(i).cwiseAbs();
    } else if (M(i, i) > 0) {
      overlooked.slope += dip.mean / M(i, i) * B.col(i).cwiseAbs();
      overlooked.y[i] = dip.depth / M(i, i);
    } else if (moves > 0) {
      overlooked.x += dip.depth / moves * B.col(i).cwiseAbs();
    }
  }
  if (!mode_->is_explicit()) {
    const Vector settles = problem_.A.Dense().diagonal().cwiseAbs().cwiseInverse();
    overlooked.x += overlooked.slope.cwiseProduct(settles.cwiseMin(duration));
  }
  return overlooked;
}

// Takes the part of the step up to `end`, at position `s_end`.
void EventDrivenLoop::Accept(double end, double s_end) {
  if (sources_.check_s > s_end) sampler_.MoveCheck((s_end - 1) / 2, sources_);
  search_.Lasted(*mode_);
  output_.AddSmooth(x_begin_, sources_, step_, mode_->active, end, s_end);
  NoteInterval(end, mode_);
  LegendreValuesAt((s_end + 1) / 2 * (GetLegendreBasis().nodes.array() + 1) - 1, legendre_at_samples_);
  errors_.AddStep(step_, sources_, Overlooked(s_end, end - t_), s_end);
  if (flow_) flow_->AddStep(step_, sources_, s_end);
  const LegendreVector at = LegendreValues(s_end);
  x_ = ValueOf(step_.x, at);
  y_ = ValueOf(step_.y, at).cwiseMax(0);
  t_ = end;
  magnitudes_.x = magnitudes_.x.cwiseMax((step_.x * legendre_at_samples_.transpose()).cwiseAbs().rowwise().maxCoeff());
  magnitudes_.x_noise = step_.x_rounding;
  magnitudes_.rounding << step_.rounding_at_end, Vector::Zero(x_.size());
  magnitudes_.y = magnitudes_.y.cwiseMax(y_);
  if (context_.y_is_lipschitz()) {
    magnitudes_.By =
        magnitudes_.By.cwiseMax(RowMaxAbs(problem_.B * Matrix(step_.y * legendre_at_samples_.transpose())));
    magnitudes_.g = magnitudes_.g.cwiseMax(sources_.g_size);
  }
  w_ = ValueOf(step_.guard, at).cwiseMax(0);
  for (const Index i : mode_->active) w_[i] = 0;
  magnitudes_.w = magnitudes_.w.cwiseMax(w_);
  ++record_.steps;
  attempt_ = 0;
  may_start_below_ = false;
  rejected_in_a_row_ = 0;
  gap_.reset();
  event_step_.reset();
}

void EventDrivenLoop::NoteInterval(double end, const Mode* mode) {
  ModeInterval interval;
  interval.begin = t_;
  interval.end = end;
  interval.coupled = !mode;
  if (mode) interval.active = mode->active;
  if (!mode) interval.why = why_coupled_;
  record_.Add(std::move(interval));
  record_.longest_step = std::max(record_.longest_step, end - t_);
}

// At the pace so far they would be too many.
bool EventDrivenLoop::AreCoupledStepsHopeless() const {
  constexpr Index kEnoughToKnow = kMaxCoupledSteps / 10;
  if (record_.coupled_steps < kEnoughToKnow) return false;
  const auto taken = static_cast<double>(record_.coupled_steps);
  return (problem_.horizon - first_coupled_) * taken > kMaxCoupledSteps * (t_ - first_coupled_);
}

// A burst of coupled steps. Each burst without a lasting mode between is twice as long as the one before and
// may err four times as much, so that the solve survives a point that the tolerance cannot pass; the record
// holds what it cost.
bool EventDrivenLoop::TakeCoupledSteps(double end) {
  const double shortest = kShortestPart * problem_.horizon;
  if (context_.selection == Selection::kHistory) {
    return context_.Fail(Termination::kIterationLimit, t_,
                         "No active set lasts at t = " + FormatNumber(t_) + " (" + why_coupled_ +
                             "), and steps of first order could leave the solution that the rule history follows.");
  }
  if (burst_ == 1) coupled_length_ = std::max(shortest, std::min(length_, 1e3 * shortest));
  for (Index k = 0; k < burst_ && t_ < end;) {
    if (context_.stop.stop_requested()) return context_.FailCancelled(t_);
    if (record_.coupled_steps == 0) first_coupled_ = t_;
    if (AreCoupledStepsHopeless()) {
      return context_.Fail(Termination::kIterationLimit, t_,
                           "No active set lasts at t = " + FormatNumber(t_) + " (" + why_coupled_ + "): after " +
                               std::to_string(record_.coupled_steps) + " steps of first order more than " +
                               std::to_string(kMaxCoupledSteps) +
                               " would be needed. Use exponential-integrator, or a larger tolerance.");
    }
    const double power = std::ldexp(1.0, std::ilogb(coupled_length_));
    const double length = std::min(power, end - t_);
    const double step_end = length == end - t_ ? end : t_ + length;
    const CoupledSteps::Step step = coupled_steps_.Take(t_, step_end, length, x_);
    if (step.verdict != LcpStatus::kSolved) {
      constexpr double kProductsOverflow = 1e150;
      const bool grown = !(MaxAbs(x_) < kProductsOverflow);
      return FailLcp(context_, grown ? LcpStatus::kNonFinite : step.verdict, step_end,
                     "The coupled step LCP(q, M + K_0)");
    }
    if (!step.kept_selection) return context_.FailLostLeastElement(step_end);
    const double allowed = tolerance_ * static_cast<double>(burst_) * static_cast<double>(burst_);
    const Vector magnitude = magnitudes_.x.cwiseMax(step.x.cwiseAbs());
    const auto ratio_of = [&](const Vector& error, double of_magnitude) {
      return (error.array() / (of_magnitude * magnitude.array() + step.noise.array() + 1e-300)).maxCoeff();
    };
    const double ratio = NanMax(ratio_of(step.error, allowed * Share(length)), ratio_of(step.inside, allowed));
    if (!(ratio <= 1) && length > shortest) {
      coupled_length_ = length / 2;
      continue;
    }
    output_.AddCoupled(t_, step_end, x_, step.x, step.y, step.w, step.g);
    NoteInterval(step_end, nullptr);
    errors_.Add(step.error, step.inside);
    if (flow_) flow_->GiveUp();
    x_ = step.x;
    y_ = step.y;
    w_ = step.w;
    t_ = step_end;
    magnitudes_.x = magnitudes_.x.cwiseMax(x_.cwiseAbs());
    magnitudes_.x_noise = step.noise;
    magnitudes_.rounding.colwise() = step.noise;
    ++record_.coupled_steps;
    ++k;
    if (ratio < 0.2) coupled_length_ = 2 * length;
  }
  burst_ *= 2;
  mode_ = nullptr;
  attempt_ = 0;
  short_modes_ = 0;
  mode_begin_ = t_;
  last_mode_length_ = coupled_length_;
  length_ = std::max(length_, coupled_length_);
  return true;
}

void EventDrivenLoop::Record(const EventOutput::SmoothInterval& interval) {
  const Segment& segment = interval.segment;
  if (segment.steps < 0) return;
  context_.recorder.Add(segment, interval.w);
  context_.NoteImpulses(segment, 0, segment.steps);
}

void EventDrivenLoop::Finish() {
  Solution& solution = context_.solution;
  if (t_ < problem_.horizon) Record(output_.Finish());
  Cost& cost = solution.cost;
  cost.steps = record_.steps + record_.coupled_steps;
  cost.coupled_steps = record_.coupled_steps;
  cost.lcps += search_.lcps() + coupled_steps_.lcps();
  record_.errors = errors_.RelativeTo(magnitudes_);
  context_.certificate.Replace(output_.certificate());
  solution.pieces = output_.TakePieces();
  if (flow_) solution.flow = flow_->Record();
}

}  // namespace dlcs
