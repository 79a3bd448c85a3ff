// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/event_driven_loop.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <utility>

#include "core/context/consistency.h"
#include "core/lcp/basis/tolerance.h"
#include "core/linalg/balance.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// Each step gets this part of the tolerance: errors of single steps add up, and grow with the system.
// MeasureOutputsTest.ExtremesHaveTheirTimes feels 4 times as much.
constexpr double kSafety = 0.05;

// What so many cells of the sources (ResolvedCells) add to the work that is allowed by default: each asks for a step,
// and that for one that was too long before. As many may count as a formula may have switching times.
// ShortPulseTest.AFastOscillationIsSolvedByDefault needs them.
double MaxDefaultWorkOfCells(double cells) {
  return cells <= kMaxSwitchingTimes ? 2 * EventRecord::kOfASmoothStep * cells : 0;
}

// An event that is farther from the end of a step than this part of it was not where the step before found it.
// PlainSystems feels 4 times as much.
constexpr double kNearEnd = 0.25;

// What lasts no longer than this part of the horizon is one point of the record: there y and w may be anything. So many
// modes are as short where they accumulate. EventDrivenTest feels 4 times as much.
constexpr double kShortModePart = 1e-6;

// The times at which formulas of f and g jump, in order, with what rounding makes of them.
std::vector<UncertainTime> TimesOfJumps(const Problem& problem) {
  std::vector<UncertainTime> times = UncertainBreakPoints(problem.f, problem.horizon);
  const std::vector<UncertainTime> of_g = UncertainBreakPoints(problem.g, problem.horizon);
  times.insert(times.end(), of_g.begin(), of_g.end());
  std::sort(times.begin(), times.end(), [](const UncertainTime& a, const UncertainTime& b) { return a.time < b.time; });
  return times;
}

double StepWithoutMode(const Problem& problem) {
  const double norm = InfinityNorm(Balance(problem.A.Dense()).matrix);
  return norm > 0 ? 4 / norm : problem.horizon;
}

}  // namespace

EventDrivenLoop::EventDrivenLoop(SolveContext& context, double asked, double tolerance, double allowed_rounding,
                                 Index most_work, EventRecord& record)
    : context_(context),
      problem_(context.problem),
      sampler_(context.sources, ResolvedCells(context.problem)),
      tolerance_(kSafety * tolerance),
      most_work_(most_work),
      record_(record),
      search_(problem_, context.selection, sampler_),
      coupled_steps_(problem_, context.selection, sampler_),
      output_(problem_, context.grid, context.options.keep_pieces),
      errors_(problem_),
      repelled_(problem_.num_constraints()),
      jumps_near_zero_(problem_, context.selection, context.y_is_lipschitz()),
      uncertain_times_(TimesOfJumps(problem_)),
      progress_(context),
      x_(problem_.x0),
      y_(Vector::Zero(problem_.num_constraints())),
      w_(y_),
      magnitudes_(problem_, context.options, asked),
      sizes_(SizesOfData(problem_, context.y_is_lipschitz(), sampler_)),
      length_(problem_.horizon, StepWithoutMode(problem_)) {
  if (problem_.outputs.shown() > 0) {
    if (auto outputs = OutputEvaluator::Create(problem_); outputs.ok()) outputs_.emplace(*std::move(outputs));
  }
  magnitudes_.allowed_rounding = allowed_rounding;
  if (!problem_.switching.is_empty()) {
    discrete_.emplace(problem_);
    AddStatesToSources(discrete_->on());
    sizes_ = SizesOfData(problem_, context.y_is_lipschitz(), sampler_);
  }
  if (context.options.keep_flow) flow_.emplace(problem_.num_states(), !context.y_is_lipschitz());
}

bool EventDrivenLoop::Run() {
  const std::vector<double> breaks = BreakPoints(problem_);
  std::vector<double> ends = KnownKinks(problem_);
  ends.push_back(problem_.horizon);
  // Both sides of a break point are known to rounding, which is all that makes g jump at a kink there.
  bool may_jump = true;
  for (const double end : ends) {
    if (discrete_ && !HappenAtKnownTime()) return false;
    const bool starts = t_ == 0 || std::exchange(has_moved_, false) ||
                        (may_jump && sampler_.GJumps(t_, kLcpTolerance * context_.starts.row_size));
    if (starts && !Start(t_)) return false;
    if (!Cross(end)) return false;
    may_jump = std::binary_search(breaks.begin(), breaks.end(), end);
    if (may_jump && !record_.intervals.back().coupled) errors_.AddBreak(step_, sources_, ErrorOfBreak(end));
    if (may_jump || end == problem_.horizon) Record(output_.EndInterval(end, x_, y_, w_));
  }
  if (discrete_) {
    discrete_->DropTimers();
    if (!HappenAtKnownTime()) return false;
  }
  progress_.Finish(problem_.horizon);
  return true;
}

// How far a break point may be off: its time is known to rounding, or to that of the formula that jumps there.
double EventDrivenLoop::ErrorOfBreak(double time) const {
  double error = kUlp * time;
  const double same = kSameTime * time;
  for (auto known = std::lower_bound(uncertain_times_.begin(), uncertain_times_.end(), time - same,
                                     [](const UncertainTime&of, double t) { return of.time < t; });
       known != uncertain_times_.end() && known->time <= time + same; ++known) {
    error = std::max(error, known->error);
  }
  return error;
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
  const Vector noise = (x_.array().abs() <= magnitudes_.rounding.bound.array()).select(x_, 0);
  x_ -= noise;
  errors_.AddRounding(noise.cwiseAbs());
  repelled_ = RepelledStarts(problem_.num_constraints());
  bool y_is_solution = false;
  const std::size_t jumps = context_.solution.jumps.size();
  if (!StartInterval(context_, begin, g, x_, y_, y_is_solution)) return false;
  if (begin == 0 && context_.solution.jumps.empty()) search_.BeginAt(x_, g);
  if (flow_ && context_.solution.jumps.size() > jumps) flow_->AddJump(context_.starts.jump_derivative);
  return true;
}

bool EventDrivenLoop::Cross(double end) {
  mode_ = nullptr;
  attempt_ = 0;
  search_.ForgetGuess();
  short_modes_ = 0;
  mode_begin_ = t_;
  begin_error_ = 0;
  length_.EndOther(end - t_);
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
    if (discrete_ && t_ >= discrete_->NextTimer() && !PassTimer()) return false;
    if (IsStuck()) return false;
    progress_.At(t_);
    Progressed progressed = mode_ ? Progressed::kYes : Choose(end);
    if (progressed == Progressed::kYes) progressed = Advance(discrete_ ? std::min(end, discrete_->NextTimer()) : end);
    if (progressed == Progressed::kFailed) return false;
    if (progressed == Progressed::kNoMode && !TakeCoupledSteps(end)) return false;
  }
  return true;
}

bool EventDrivenLoop::IsBeyondWork() const {
  const double part = t_ / problem_.horizon;
  const auto work = static_cast<double>(record_.Work(problem_.num_states()));
  auto most = static_cast<double>(most_work_);
  if (part > 0) most += MaxDefaultWorkOfCells(static_cast<double>(sampler_.CellsUntil(t_)) / part);
  return work >= most && work >= EventRecord::kPatience * most * part;
}

// Continues after a kink of the sources as after a break point. If g jumps there, the state may jump too.
bool EventDrivenLoop::PassKink() {
  mode_ = nullptr;
  attempt_ = 0;
  search_.ForgetGuess();
  gap_.reset();
  event_step_.reset();
  const bool jumps = sampler_.GJumps(*kink_, kLcpTolerance * context_.starts.row_size);
  kink_.reset();
  return !jumps || Start(t_);
}

// Many steps, taken or not, that hardly advance: the solution is not as smooth as steps of high order need it.
bool EventDrivenLoop::IsStuck() {
  constexpr Index kMaxTries = 8192;
  constexpr double kMinProgress = 1e-3;  // EventDrivenTest feels 4 times as much
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

// Chooses the next mode. With switches: after all have flipped that do so at this instant.
EventDrivenLoop::Progressed EventDrivenLoop::Choose(double end) {
  Progressed progressed = Propose(end);
  if (progressed != Progressed::kYes || !discrete_) return progressed;
  if (!discrete_->Excited(mode_->active).empty()) progressed = ResolveInstant(end);
  if (progressed == Progressed::kYes) discrete_->UpdateTimers(t_, errors_.ErrorsOfTime(), mode_->active);
  return progressed;
}

// Proposes the next mode that y is determined in.
EventDrivenLoop::Progressed EventDrivenLoop::Propose(double end) {
  bool lost_least_element = false, was_solved = false;
  while (attempt_ < ModeSearch::kAttempts || TryAgainFromBelow()) {
    const ModeSearch::Proposal proposal =
        search_.Find(t_, x_, magnitudes_.rounding.bound, SizesSoFar(), length_.value(), end - t_, attempt_++);
    const bool solved = proposal.verdict == LcpStatus::kSolved;
    was_solved = was_solved || solved;
    lost_least_element = lost_least_element || (solved && !proposal.kept_selection);
    mode_ = proposal.kept_selection ? proposal.mode : nullptr;
    if (mode_) {
      if (record_.intervals.empty() && record_.rejected_steps == 0) length_.BeginWith(*mode_);
      return Progressed::kYes;
    }
    why_coupled_ = solved ? "the active set does not determine y (relative degree above one)"
                          : "the coupled LCP that proposes an active set was not solved";
  }
  if (!was_solved && (mode_ = search_.Flipped(SizesSoFar()))) return Progressed::kYes;
  if (!lost_least_element) return Progressed::kNoMode;
  context_.FailLostLeastElement(t_);
  return Progressed::kFailed;
}

// Locates the event before once more, or leaves it to the proposals that are left. `why` is reported if none lasts.
void EventDrivenLoop::GiveUpMode(const char* why) {
  mode_ = nullptr;
  if (!event_step_ || !RefineEvent()) why_coupled_ = why;
}

// Once all proposals failed, starts the attempts again, with LetRisingGuardsStartBelow(): an event is known no better
// than the guard that it was found by. False if there is nothing left to try.
bool EventDrivenLoop::TryAgainFromBelow() {
  if (may_start_below_) return false;
  may_start_below_ = true;
  attempt_ = 0;
  return true;
}

// A step from `start` in the mode, with the sources as they are. Where y depends on g', of which the polynomial of g
// has the rounding of g over the length, and that is more than the tolerance of a step, it is taken with g' from g
// itself.
void EventDrivenLoop::TakeStep(const Mode& mode, const Vector& start, const EventGap* gap) {
  const auto take = [&] {
    return TakeSmoothStep(search_.StepperOf(mode, sources_.length), start, sources_, magnitudes_, tolerance_,
                          ShareOfTolerance(sources_.length, problem_.horizon), gap);
  };
  step_ = take();
  if (mode.guard.slope_g.size() == 0 || sources_.g.is_steady || sources_.g.slope.rows() > 0) return;
  const auto depends = (mode.guard.slope_g.array() != 0).rowwise().any().eval();
  const Vector sizes = SizeOfRows(step_.guard.values);
  if (!(depends && step_.guard.error.rounding.array() > tolerance_ * sizes.array()).any()) return;
  sampler_.SampleSlope(sources_);
  step_ = take();
}

// Takes a step from `begin` to `end` in place of one before it. Returns whether it is accurate.
bool EventDrivenLoop::TakeOneMore(const Mode& mode, const Vector& start, double begin, double end,
                                  const EventGap* gap) {
  sampler_.Sample(begin, end, sources_);
  if (!sources_.finite) return false;
  TakeStep(mode, start, gap);
  ++record_.rejected_steps;
  return step_.error_ratio <= 1;
}

// The time from the end of the step to the zero that a guard has near there.
double EventDrivenLoop::DelayAtEnd(Index guard) const {
  const auto series = step_.guard.values.row(guard);
  const LegendreVector at_end = LegendreValues(1);
  return -sources_.length / 2 * series.dot(at_end) / series.dot(LegendreSlopes(at_end));
}

void EventDrivenLoop::AddStatesToSources(const std::vector<char>& on) {
  context_.sources.SetOffsets(discrete_->OfF(on), discrete_->OfG(on));
}

// What edges, clocks and resets do at this time.
bool EventDrivenLoop::HappenAtKnownTime() {
  passed_.clear();
  if (!discrete_->IsKnownTime(t_)) return true;
  if (t_ == 0) {
    const Mode* mode =
        search_.FindBehind(0, x_, magnitudes_.rounding.bound, SizesSoFar(), length_.value(), problem_.horizon).mode;
    if (mode) last_active_ = mode->active;
  }
  Instant instant = discrete_->HappenAt(t_, x_, last_active_);
  if (t_ == problem_.horizon) instant.J.resize(0, 0);  // x(T) is a left limit
  if (instant.kind != Instant::Kind::kLasts) return FailAtInstant(instant);
  return Enter(instant, FlipCause::kEdge);
}

// A delay has passed. Its end has the errors of its begin, and the rounding of time.
bool EventDrivenLoop::PassTimer() {
  TimeErrors errors = discrete_->ErrorsOfNextTimer();
  for (Index e = 0; e < SampledErrors::kOfRounding; ++e) errors[e] += std::copysign(ErrorOfBreak(t_), errors[e]);
  errors_.AddEndOfDelay(step_, sources_, errors);
  if (!HappenAtKnownTime()) return false;
  mode_ = nullptr;
  attempt_ = 0;
  search_.ForgetGuess();
  gap_.reset();
  return !std::exchange(has_moved_, false) || Start(t_);
}

// Flips the switches that are excited just behind t, until none is.
EventDrivenLoop::Progressed EventDrivenLoop::ResolveInstant(double end) {
  const auto active_in = [&](const DiscreteState& state) -> std::optional<std::vector<Index>> {
    AddStatesToSources(state.on);
    const ModeSearch::Proposal found =
        search_.FindBehind(t_, state.x, magnitudes_.rounding.bound, SizesSoFar(), length_.value(), end - t_);
    mode_ = found.kept_selection ? found.mode : nullptr;
    if (!mode_) return std::nullopt;
    return mode_->active;
  };
  const Instant instant = discrete_->Resolve(discrete_->With(x_), t_ == 0, active_in);
  if (instant.kind == Instant::Kind::kLasts && instant.flips.empty()) return Progressed::kYes;
  const bool returns = std::count(passed_.begin(), passed_.end(), instant.after.on) > 0;
  if (instant.kind != Instant::Kind::kLasts) {
    FailAtInstant(instant);
    return Progressed::kFailed;
  }
  if (returns) {
    Instant endless = instant;
    endless.kind = Instant::Kind::kNoneLasts;
    for (const SwitchFlip& flip : instant.flips) endless.switches.push_back(flip.index);
    FailAtInstant(endless);
    return Progressed::kFailed;
  }
  passed_.push_back(discrete_->on());
  if (!Enter(instant, t_ == 0 ? FlipCause::kStart : FlipCause::kCondition)) return Progressed::kFailed;
  if (!std::exchange(has_moved_, false)) return Progressed::kYes;
  const Vector x = x_;
  if (!Start(t_)) return Progressed::kFailed;
  if (x_ == x) return Progressed::kYes;
  mode_ = nullptr;
  attempt_ = 0;
  return Choose(end);
}

// A control that comes as near to a level as its error may have crossed it: then switches that flip there, and all that
// follows, are another solution. Of rounding alone touching is no crossing.
void EventDrivenLoop::AddUnknownFlips(const OverlookedByCause& overlooked) {
  const Index first = discrete_->first_condition();
  for (Index pair = first; pair < problem_.num_constraints(); ++pair) {
    if (overlooked.truncation.y[pair] == 0 && overlooked.truncation.w[pair] == 0) continue;
    std::vector<Index> active = mode_->active;
    const auto place = std::lower_bound(active.begin(), active.end(), pair);
    if (place != active.end() && *place == pair) {
      active.erase(place);
    } else {
      active.insert(place, pair);
    }
    const std::vector<Index> excited = discrete_->Excited(active);
    if (excited.empty()) continue;
    Vector unknown = magnitudes_.x;
    if (const Matrix& F = problem_.switching.F; F.size() > 0) {
      for (const Index i : excited) unknown += (problem_.horizon - t_) * F.col(i).cwiseAbs();
    }
    errors_.Add(unknown, unknown);
    context_.solution.warnings.push_back(
        discrete_->NamesOf(excited) + " may flip at t = " + FormatNumber(t_) +
        ": a control comes as near to its level as its error, and is taken not to reach it.");
  }
}

// Takes over what happened at this time, and records it.
bool EventDrivenLoop::Enter(const Instant& instant, FlipCause cause) {
  Solution& solution = context_.solution;
  for (SwitchFlip flip : instant.flips) {
    flip.time = t_;
    flip.error = ErrorGrowth::SizeOf(errors_.ErrorsOfTime());
    flip.cause = cause;
    solution.flips.push_back(flip);
  }
  discrete_->Become(instant.after);
  AddStatesToSources(discrete_->on());
  event_step_.reset();
  const bool has_pairs = discrete_->first_condition() > 0;
  has_moved_ = has_pairs && (instant.J.size() > 0 || (problem_.switching.G.size() > 0 && !instant.flips.empty()));
  if (instant.J.size() == 0) return true;
  solution.jumps.push_back({t_, instant.after.x - x_, Vector::Zero(problem_.num_constraints())});
  const Matrix sizes = instant.J.cwiseAbs();
  errors_.Reset(instant.J, kUlp * (sizes * x_.cwiseAbs() + instant.after.x.cwiseAbs()));
  magnitudes_.rounding.bound = sizes * magnitudes_.rounding.bound;
  magnitudes_.rounding.samples = instant.J * magnitudes_.rounding.samples;
  x_ = instant.after.x;
  magnitudes_.x = magnitudes_.x.cwiseMax(x_.cwiseAbs());
  magnitudes_.errors = errors_.Samples();
  gap_.reset();
  if (flow_) flow_->GiveUp();
  return true;
}

// Whether c is on the level of the condition, with these states of switches.
bool EventDrivenLoop::IsOnLevel(const SwitchCondition& condition, const Vector& states) const {
  const Switching& given = problem_.switching;
  const Index c = condition.control;
  double value = -condition.level, allowed = RoundingOf(16) * std::abs(condition.level);
  const auto add = [&](const Matrix& rows, const Vector& of, const Vector& error) {
    if (rows.size() == 0) return;
    value += rows.row(c).dot(of);
    allowed += rows.row(c).cwiseAbs().dot(RoundingOf(16) * of.cwiseAbs() + error);
  };
  add(given.h, Vector::Ones(1), Vector::Zero(1));
  add(given.C, x_, magnitudes_.rounding.bound);
  add(given.H, states, Vector::Zero(states.size()));
  return std::abs(value) <= allowed;
}

// A switch without hysteresis that is on its level whether it is on or off holds its control there: the slope of the
// control decides each time, and its own flip turns it. Otherwise values alone make some of them flip for ever.
std::string EventDrivenLoop::WhyNoneLasts(const std::vector<Index>& switches) const {
  const std::vector<char>& on = discrete_->on();
  Vector states(static_cast<Index>(on.size()));
  for (Index i = 0; i < states.size(); ++i) states[i] = on[static_cast<std::size_t>(i)];
  const auto all_on_level = [&](const std::vector<SwitchCondition>& conditions, Index i, double state) {
    Vector with = states;
    with[i] = state;
    return std::all_of(conditions.begin(), conditions.end(),
                       [&](const SwitchCondition& condition) { return IsOnLevel(condition, with); });
  };
  for (const Index i : switches) {
    const Switch& of = problem_.switching.switches[static_cast<std::size_t>(i)];
    if (of.kind != SwitchKind::kLatch || of.set.empty() || !all_on_level(of.set, i, 0)) continue;
    if (of.reset.empty() || !all_on_level(of.reset, i, 1)) continue;
    return discrete_->NamesOf(switches) + (switches.size() == 1 ? " chatters" : " chatter") +
           " from t = " + FormatNumber(t_) + ": " + of.name +
           " needs hysteresis, since its control is held on its level " + FormatNumber(of.set.front().level) + ".";
  }
  return "No state of switches lasts at t = " + FormatNumber(t_) + ": " + discrete_->NamesOf(switches) +
         (switches.size() == 1 ? " flips" : " flip") + " for ever. A delay or a capacitor in the loop is missing.";
}

bool EventDrivenLoop::FailAtInstant(const Instant& instant) {
  const std::string at = " at t = " + FormatNumber(t_), names = discrete_->NamesOf(instant.switches);
  std::string why;
  switch (instant.kind) {
    case Instant::Kind::kLasts:
    case Instant::Kind::kNoneLasts:
      why = WhyNoneLasts(instant.switches);
      break;
    case Instant::Kind::kRace:
      why = "Race" + at + ": " + names + "." + instant.ends +
            " State the order in which they flip, or delay one of them.";
      break;
    case Instant::Kind::kTooMany:
      why = names + " can flip in any order" + at + ", with more than " + std::to_string(DiscreteLayer::kMostStates) +
            " states between: state an order, or delay some of them.";
      break;
    case Instant::Kind::kNoMode:
      why = "Controls have no value" + at +
            " while switches flip: no active set of the pairs was found in one of the "
            "states between.";
      break;
    case Instant::Kind::kWrittenTwice:
      why = "Two resets write one state" + at + ".";
      break;
  }
  return context_.Fail(Termination::kInfeasible, t_, std::move(why));
}

// Steps of first order would pass switches at their ends.
bool EventDrivenLoop::FailWithoutMode() {
  const std::vector<SwitchFlip>& flips = context_.solution.flips;
  constexpr std::size_t kGaps = 3;
  if (flips.size() > kGaps) {
    std::vector<double> times;
    for (const SwitchFlip& flip : flips) {
      if (times.empty() || times.back() != flip.time) times.push_back(flip.time);
    }
    if (const std::size_t k = times.size(); k > kGaps) {
      const double last = times[k - 1] - times[k - 2], before = times[k - 2] - times[k - 3];
      if (last < before && t_ - times[k - 1] < before) {
        return context_.Fail(Termination::kInfeasible, t_,
                             "Flips of " + discrete_->NamesOf({flips.back().index}) +
                                 " accumulate at t = " + FormatNumber(times[k - 1] + last * last / (before - last)) +
                                 " (ratio " + FormatNumber(last / before) + ").");
      }
    }
  }
  return context_.Fail(Termination::kIterationLimit, t_,
                       "No active set lasts at t = " + FormatNumber(t_) + " (" + why_coupled_ +
                           "), and steps of first order would not see when switches flip.");
}

// Locates the last event once more, by steps that end there: at its end a step is far more accurate than inside. A fast
// state or a small M_ii may show the difference to the next mode. What is recorded of the step remains.
bool EventDrivenLoop::RefineEvent() {
  constexpr int kCorrections = 2;
  const EventStep event = *std::exchange(event_step_, std::nullopt);
  const Mode* mode = search_.ModeOf(event.active, SizesSoFar());
  if (!mode) return false;
  double end = t_;
  for (int correction = 0; correction <= kCorrections; ++correction) {
    if (!TakeOneMore(*mode, event.x, event.begin, end, nullptr)) return false;
    const double delay = DelayAtEnd(event.guard);
    if (!(std::abs(delay) <= kNearEnd * sources_.length)) return false;
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

// One step in the mode: accepted up to its end or to the first event, or shortened, or the mode given up.
EventDrivenLoop::Progressed EventDrivenLoop::Advance(double end) {
  const double limit = sampler_.Reach(t_, std::min(kink_.value_or(end), end));
  const double length = length_.Next(*mode_, limit - t_);
  const double share = ShareOfTolerance(length, problem_.horizon);
  const double step_end = length == limit - t_ ? limit : t_ + length;  // not beyond a break point by rounding
  sampler_.Sample(t_, step_end, sources_);
  if (!sources_.finite) return FailNonFinite();
  magnitudes_.RaiseReach(mode_->dynamics, std::max(mode_->rate, 1 / problem_.horizon), sources_.f.size);
  x_start_ = x_;
  if (!Project(*mode_, sources_, tolerance_, magnitudes_, x_start_)) {
    GiveUpMode("the state is off the constraints of the active set");
    return Progressed::kYes;
  }
  const EventGap* gap = gap_ ? &*gap_ : nullptr;
  TakeStep(*mode_, x_start_, gap);
  if (step_.error_ratio <= 1 && sampler_.Probe(sources_)) {
    if (!sources_.finite) return FailNonFinite();
    TakeStep(*mode_, x_start_, gap);
  }
  const double shortest = length_.ShortestStep(t_, mode_);
  if (!(step_.error_ratio <= 1)) return Repeat(length_.AfterError(step_, length, shortest));

  if (may_start_below_ && t_ == mode_begin_) LetRisingGuardsStartBelow(step_);
  auto mode_end = FindModeEnd(step_);
  if (length > 2 * shortest && HasDips(mode_end ? mode_end->s : 1, length))
    return Repeat(length_.AfterError(step_, length, shortest));
  if (!mode_end) {
    length_.Accept(length, step_.error_ratio);
    Accept(step_end, 1);
    return Progressed::kYes;
  }
  // The part after the event may make the error before it look small. So a step of which less than half is left is
  // repeated.
  double lasted = length * (1 + mode_end->s) / 2;
  const double again = 2 * lasted;
  step_.error_ratio =
      NanMax(step_.error_ratio, ErrorRatioBefore(mode_end->s, *mode_, step_, magnitudes_, tolerance_, share));
  if (!(step_.error_ratio <= 1) && again < length && again > shortest) return Repeat(again);
  const bool is_too_short = lasted <= length_.ShortestMode(t_, mode_);
  if (is_too_short && StartsBelowByTruncation(step_, mode_end->guard)) return Repeat(length / 8);
  search_.GuessAfter(*mode_, mode_end->guard);
  // Where a guard falls from zero at once another proposal is better, of the first ones, which look ahead less.
  constexpr int kShorterSteps = 4;
  const bool may_propose = t_ == mode_begin_ && attempt_ <= kShorterSteps;
  if (is_too_short || (may_propose && FallsFromZero(step_, *mode_end))) {
    GiveUpMode("no active set lasts");
    return Progressed::kYes;
  }
  if (lasted > shortest && !IsKnownWellEnough(*mode_end, lasted)) {
    RetakeUpTo(lasted, *mode_end);
    lasted = sources_.length * (1 + mode_end->s) / 2;
  }
  Accept(t_ + lasted, mode_end->s, mode_end->guard);
  return EndMode(*mode_end, end);
}

// Whether a shorter step has less of what RatioOfDips() shows. What did not fall with the length is not the step's.
bool EventDrivenLoop::HasDips(double s_end, double length) {
  const double ratio =
      RatioOfDips(problem_, step_, magnitudes_, tolerance_, s_end, length, length_.ShortestMode(t_, mode_));
  if (!(ratio > 1 && ratio < std::exchange(dips_, ratio))) return false;
  step_.error_ratio = ratio;
  return true;
}

// Whether what the step is off by at an event inside it is no more than the share of the tolerance that its length has
// of the horizon. The error control allows rounding besides, which for long solves is more, and adds up as truncation.
// Behind the event fast states are off by as much of what they settle by as their rate makes of the delay.
bool EventDrivenLoop::IsKnownWellEnough(const ModeEnd& mode_end, double lasted) const {
  const double allowed = tolerance_ * lasted / problem_.horizon;
  const double size = std::max(std::binary_search(mode_->active.begin(), mode_->active.end(), mode_end.guard)
                                   ? magnitudes_.y[mode_end.guard]
                                   : magnitudes_.w[mode_end.guard],
                               MaxAbs(step_.guard.values.row(mode_end.guard)));
  const double fastest = std::max(mode_->rate, search_.rate());
  return step_.guard.tail[mode_end.guard] <= allowed * size &&
         fastest * step_.guard.tail[mode_end.guard] <= tolerance_ * SpeedOfGuard(mode_end) &&
         (step_.x_tail.array() <= allowed * magnitudes_.x.cwiseMax(step_.x_size).cwiseMax(magnitudes_.x_given).array())
             .all();
}

// How fast the guard of the event passes zero.
double EventDrivenLoop::SpeedOfGuard(const ModeEnd& mode_end) const {
  const LegendreVector slopes = LegendreSlopes(LegendreValues(mode_end.s));
  return 2 / sources_.length * std::abs(step_.guard.values.row(mode_end.guard).dot(slopes));
}

// Takes the step once more, so that the event is at its end, where a step is far better than inside of it. Changes
// nothing if that step is not accurate or has the event elsewhere.
void EventDrivenLoop::RetakeUpTo(double length, ModeEnd& mode_end) {
  const double beyond = 2 * step_.guard.tail[mode_end.guard] / SpeedOfGuard(mode_end);
  const double end = t_ + std::min(length + beyond, sources_.length);
  SmoothStep longer = std::move(step_);
  StepSources sources_of_longer = sources_;
  if (TakeOneMore(*mode_, x_start_, t_, end, gap_ ? &*gap_ : nullptr)) {
    const double delay = DelayAtEnd(mode_end.guard), s = std::min(1.0, 1 + 2 / sources_.length * delay);
    const auto first = FindModeEnd(step_);
    if (delay > -kNearEnd * sources_.length && (!first || first->guard == mode_end.guard)) {
      mode_end.s = s;
      return;
    }
  }
  step_ = std::move(longer);
  sources_ = std::move(sources_of_longer);
}

EventDrivenLoop::Progressed EventDrivenLoop::FailNonFinite() {
  const Sources::NonFinite why = sampler_.WhyNonFinite(sources_);
  context_.Fail(Termination::kNonFinite, t_, why.message + ".");
  return Progressed::kFailed;
}

// Repeats the step with this length, or gives up if it is too short. First looks for a kink where many steps in a row
// failed.
EventDrivenLoop::Progressed EventDrivenLoop::Repeat(double length) {
  constexpr int kManyRejected = 3;
  const double shortest = length_.ShortestStep(t_, mode_);
  ++record_.rejected_steps;
  const int in_a_row = length_.Shorten(length);
  if (in_a_row == kManyRejected && !kink_) {
    kink_ = sampler_.FindKink(sources_);
    if (kink_ && *kink_ - t_ <= shortest) kink_.reset();
    if (kink_) length_.RaiseTo(*kink_ - t_);
  }
  if (length_.value() >= shortest) return Progressed::kYes;
  why_coupled_ =
      "no step was short enough for the tolerance: the solution changes too fast, or f or g jumps or has a kink at a "
      "time that is no break point";
  length_.RaiseTo(16 * shortest);
  return Progressed::kNoMode;
}

// An event at t, the end of the last mode.
EventDrivenLoop::Progressed EventDrivenLoop::EndMode(const ModeEnd& mode_end, double end) {
  if (flow_) flow_->AddEvent(*mode_, step_, sources_, mode_end.s, mode_end.guard);
  gap_ = GapOf(step_, sources_);
  event_step_ = {mode_->active, sources_.begin, end, x_start_, mode_end.guard};
  mode_ = nullptr;
  // So many modes in a row, each shorter than this part of the horizon: modes accumulate. One in which the state moves
  // by less than the tolerance counts for many.
  constexpr int kMaxShortModes = 256, kCountOfStill = 32;
  const double lasted = t_ - mode_begin_;
  length_.EndMode(lasted);
  mode_begin_ = t_;
  if (lasted > kShortModePart * problem_.horizon) {
    short_modes_ = 0;
    coupled_steps_.ResetBursts();
    return Progressed::kYes;
  }
  const Vector slope = SlopeAt(step_, sources_, mode_end.s);
  const bool moved = (lasted * slope.array().abs() > tolerance_ * magnitudes_.x.array()).any();
  short_modes_ += moved ? 1 : kCountOfStill;
  if (short_modes_ < kMaxShortModes) return Progressed::kYes;
  why_coupled_ = "the last active sets were each shorter than a millionth of T = " + FormatNumber(problem_.horizon) +
                 ": switching times accumulate, or T is far too long";
  return Progressed::kNoMode;
}

// Takes the part of the step up to `end`, at position `s_end`, where `guard` ends the mode if it is given.
void EventDrivenLoop::Accept(double end, double s_end, std::optional<Index> guard) {
  if (sources_.check_s > s_end) sampler_.MoveCheck((s_end - 1) / 2, sources_);
  if (s_end < 1) LimitSizes(sources_, s_end, step_);
  search_.Lasted(*mode_);
  last_active_ = mode_->active;
  passed_.clear();
  output_.AddSmooth(x_, sources_, step_, mode_->active, end, s_end);
  if (t_ == 0) begin_error_ = ErrorOfStart();
  NoteInterval(end, mode_);
  LegendreValuesAt((s_end + 1) / 2 * (GetLegendreBasis().nodes.array() + 1) - 1, legendre_at_samples_);
  const ErrorBounds of_state = errors_.InGuards(*mode_);
  OverlookedByCause overlooked = OverlookedEvents(problem_, step_, of_state, magnitudes_, s_end, end - t_,
                                                  length_.ShortestMode(t_, mode_), repelled_);
  const Vector x_error = errors_.InState();
  jumps_near_zero_.AddTo(step_, of_state, x_error, s_end, t_ == mode_begin_, guard, sampler_, sources_, overlooked);
  // Where x was close to constraints that should not hold yet, its projection onto them is an error.
  const Vector moved = ((x_start_ - x_).cwiseAbs() - x_error - magnitudes_.rounding.bound).cwiseMax(0);
  if (!moved.isZero(0)) {
    const Vector slope = problem_.A.AbsTimes(moved);
    for (Overlooked* of : {&overlooked.truncation, &overlooked.with_signs}) {
      of->x += moved;
      of->slope += slope;
    }
    overlooked.truncation.w += problem_.N.AbsTimes(moved);
  }
  const double event_error = errors_.AddStep(step_, sources_, overlooked, s_end, guard);
  if (discrete_) AddUnknownFlips(overlooked);
  if (guard) begin_error_ = event_error;
  if (flow_) flow_->AddStep(step_, sources_, s_end);
  const LegendreVector at = LegendreValues(s_end);
  x_ = ValueOf(step_.x, at);
  y_ = ValueOf(step_.y, at).cwiseMax(0);
  t_ = end;
  magnitudes_.x = magnitudes_.x.cwiseMax((step_.x * legendre_at_samples_.transpose()).cwiseAbs().rowwise().maxCoeff());
  magnitudes_.rounding = step_.rounding;
  magnitudes_.errors = errors_.Samples();
  const Vector guards = (step_.guard.values * legendre_at_samples_.transpose()).rowwise().maxCoeff().cwiseMax(0);
  w_ = ValueOf(step_.guard.values, at).cwiseMax(0);
  for (Index i = 0; i < guards.size(); ++i) {
    const bool is_active = std::binary_search(mode_->active.begin(), mode_->active.end(), i);
    if (is_active) w_[i] = 0;
    double& size = is_active ? magnitudes_.y[i] : magnitudes_.w[i];
    size = std::max(size, guards[i]);
  }
  MeasureOutputs(s_end);
  ++record_.steps;
  attempt_ = 0;
  may_start_below_ = false;
  dips_ = std::numeric_limits<double>::infinity();
  gap_.reset();
  event_step_.reset();
}

// How far the time of the start is known: where N x0 + g moves through a zero that is one to rounding, or to the LCP,
// the true one may be a little later, and the pair only then become active or leave. If M is singular, y may jump then:
// its w_i came to zero by the y that there were before.
double EventDrivenLoop::ErrorOfStart() {
  const LegendreVector at_begin = LegendreValues(-1);
  const Vector guards = ValueOf(step_.guard.values, at_begin);
  const Vector slopes = 2 / sources_.length * ValueOf(step_.guard.values, LegendreSlopes(at_begin));
  const std::vector<Index>& active = mode_->active;
  Vector of_y = Vector::Zero(slopes.size()), speeds = slopes;
  of_y(active) = slopes(active);
  speeds(active) = Vector(problem_.M * of_y)(active);
  const Vector y = ValueOf(step_.y, at_begin);
  Vector g(guards.size()), g_terms(guards.size());
  sampler_.G(t_, Side::kRight, g);
  sampler_.TermsOfG(t_, g_terms);
  const Vector q = problem_.N * x_start_ + g;
  const Vector zero = kLcpTolerance * context_.starts.row_size;
  const auto is_at_edge = (q.array().abs() <= zero.array()).eval();
  const Vector terms = problem_.N.AbsTimes(x_start_.cwiseAbs()) + g_terms + problem_.M.AbsTimes(y.cwiseAbs());
  const Vector off = RoundingOfProduct(problem_.num_states() + problem_.num_constraints()) * terms +
                     Vector(is_at_edge.select(q.cwiseAbs(), 0));
  double error = 0;
  const auto raise = [&](Index i, double speed) {
    if (zero[i] < speed * sources_.length) error = std::max(error, off[i] / speed);
  };
  for (Index i = 0; i < guards.size(); ++i) {
    if (std::abs(guards[i]) <= step_.guard.error.rounding[i]) raise(i, std::abs(speeds[i]));
  }
  const Vector y_before = is_at_edge.select(0, y);
  const Vector x_slope = problem_.A * x_start_ + problem_.B * y_before + ValueOf(sources_.f.values, at_begin);
  const Vector q_slope =
      problem_.N * x_slope + 2 / sources_.length * ValueOf(sources_.g.values, LegendreSlopes(at_begin));
  for (const Index i : active) {
    if (is_at_edge[i]) raise(i, std::abs(q_slope[i]));
  }
  return error;
}

// Raises the sizes of the outputs to those on the step, up to `s_end`.
void EventDrivenLoop::MeasureOutputs(double s_end) {
  if (!outputs_) return;
  const Index samples = legendre_at_samples_.rows();
  const double from = sources_.begin, part = (1 + s_end) / 2 * sources_.length;
  const Vector times = from + part * (GetLegendreBasis().nodes.array() + 1) / 2;
  const Matrix values = outputs_->Between(times, step_.x * legendre_at_samples_.transpose(),
                                          (step_.y * legendre_at_samples_.transpose()).cwiseMax(0));
  RaiseRowMaxAbs(values.topRows(magnitudes_.outputs.size()).leftCols(samples), magnitudes_.outputs);
}

void EventDrivenLoop::NoteInterval(double end, const Mode* mode) {
  ModeInterval interval;
  interval.begin = t_;
  interval.end = end;
  interval.begin_error = std::max(begin_error_, length_.ShortestMode(t_, mode));
  interval.coupled = !mode;
  // Pairs switch somewhere in a coupled step.
  if (!mode) interval.begin_error = std::max(interval.begin_error, end - t_);
  if (mode) interval.active = mode->active;
  if (!mode) interval.why = why_coupled_;
  record_.Add(std::move(interval));
  record_.longest_step = std::max(record_.longest_step, end - t_);
}

// A burst of coupled steps. The record holds what it cost.
bool EventDrivenLoop::TakeCoupledSteps(double end) {
  if (discrete_) return FailWithoutMode();
  if (context_.selection == Selection::kHistory) {
    return context_.Fail(Termination::kIterationLimit, t_,
                         "No active set lasts at t = " + FormatNumber(t_) + " (" + why_coupled_ +
                             "), and steps of first order could leave the solution that the rule history follows.");
  }
  coupled_steps_.BeginBurst(t_, length_.value());
  for (Index k = 0; k < coupled_steps_.burst() && t_ < end; ++k) {
    if (context_.stop.stop_requested()) return context_.FailCancelled(t_);
    if (coupled_steps_.AreHopeless(t_)) {
      return context_.Fail(Termination::kIterationLimit, t_,
                           "No active set lasts at t = " + FormatNumber(t_) + " (" + why_coupled_ + "): after " +
                               std::to_string(coupled_steps_.steps()) + " steps of first order more than " +
                               std::to_string(CoupledSteps::kMost) +
                               " would be needed. Use exponential-integrator, or a larger tolerance.");
    }
    const CoupledSteps::Step step = coupled_steps_.Take(t_, end, x_, magnitudes_.x, tolerance_);
    if (step.verdict != LcpStatus::kSolved) {
      const bool grown = !std::isfinite(x_.squaredNorm());
      return FailLcp(context_, grown ? LcpStatus::kNonFinite : step.verdict, step.end,
                     "The coupled step LCP(q, M + K_0)");
    }
    if (!step.kept_selection) return context_.FailLostLeastElement(step.end);
    output_.AddCoupled(t_, step.end, x_, step.x, step.y, step.w, step.g);
    NoteInterval(step.end, nullptr);
    begin_error_ = step.end - t_;
    errors_.Add(step.error, step.inside);
    if (step.end - t_ > kShortModePart * problem_.horizon) errors_.AddInside(step.w_inside);
    if (flow_) flow_->GiveUp();
    x_ = step.x;
    y_ = step.y;
    w_ = step.w;
    t_ = step.end;
    magnitudes_.x = magnitudes_.x.cwiseMax(x_.cwiseAbs());
    magnitudes_.rounding.bound = step.noise;
    magnitudes_.rounding.samples.colwise() = step.noise;
    magnitudes_.errors = errors_.Samples();
    ++record_.coupled_steps;
  }
  coupled_steps_.EndBurst();
  length_.EndOther(coupled_steps_.length());
  length_.RaiseTo(coupled_steps_.length());
  mode_ = nullptr;
  attempt_ = 0;
  may_start_below_ = false;
  short_modes_ = 0;
  mode_begin_ = t_;
  return true;
}

void EventDrivenLoop::Record(const EventOutput::SmoothInterval& interval) {
  const Segment& segment = interval.segment;
  if (segment.steps < 0) return;
  context_.recorder.Add(segment, interval.w);
  context_.impulses.Note(context_.grid, segment, 0, segment.steps);
}

void EventDrivenLoop::Finish() {
  Solution& solution = context_.solution;
  if (t_ < problem_.horizon) Record(output_.Finish());
  Cost& cost = solution.cost;
  cost.steps = record_.steps + record_.coupled_steps;
  cost.coupled_steps = record_.coupled_steps;
  cost.lcps += search_.lcps() + coupled_steps_.lcps();
  record_.errors = errors_.Errors(magnitudes_);
  if (discrete_) {
    // A condition is no part of the solution.
    const Index first = discrete_->first_condition();
    for (ErrorsByCause* of : {&record_.errors.y, &record_.errors.w}) {
      for (Vector* errors : {&of->own, &of->truncation, &of->rounding}) errors->tail(errors->size() - first).setZero();
    }
  }
  context_.certificate.Replace(output_.certificate(record_.errors.x.rounding));
  solution.pieces = output_.TakePieces();
  if (flow_) solution.flow = flow_->Record();
}

}  // namespace dlcs
