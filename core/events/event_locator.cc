// SPDX-License-Identifier: Apache-2.0

#include "core/events/event_locator.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/linalg/norms.h"
#include "core/methods/consistency.h"

namespace dlcs {
namespace {

constexpr int kAttempts = ModeSearch::kAttempts;
// So many modes in a row, each shorter than this part of the horizon: modes accumulate. One in which the
// state moves by less than the tolerance counts for many.
constexpr int kMostShortModes = 256;
constexpr int kCountOfStill = 32;
constexpr double kShortModePart = 1e-6;
// A step of less than this part of the horizon is not worth a collocation; nor does a mode last that ends so
// soon.
constexpr double kShortestPart = 1e-12;
constexpr double kNoModePart = 1e-14;
// Error control never asks for less than this part of the tolerance of one step.
constexpr double kLeastShare = 0.02;
// A step of which an event leaves less than this part is taken again, shorter, where what is behind the event made its
// error look small.
constexpr double kLeastKept = 0.5;
// A step is at most so many times longer than the last two modes were: rounding grows with the length, and
// where modes accumulate little else is left.
constexpr double kLongestAfterEvent = 16;
// Steps are controlled with this part of the tolerance: errors of single steps add up, and grow with the
// system.
constexpr double kSafety = 0.05;
constexpr Index kMostMarchedSteps = 200000;

}  // namespace

EventLocator::EventLocator(SolveContext& context, double tolerance, EventRecord& record)
    : context_(context),
      problem_(context.problem),
      sampler_(context.sources, ProbeTimes(context.problem)),
      tolerance_(kSafety * tolerance),
      record_(record),
      search_(problem_, context.selection, sampler_),
      march_(problem_, context.selection, sampler_),
      output_(problem_, context.grid, context.options.keep_pieces),
      progress_(context),
      x_(problem_.x0),
      y_(Vector::Zero(problem_.num_constraints())),
      w_(y_) {
  magnitudes_.x = x_.cwiseAbs();
  magnitudes_.y = magnitudes_.w = Vector::Zero(problem_.num_constraints());
}

bool EventLocator::Run() {
  const std::vector<double> breaks = BreakPoints(problem_);
  std::vector<double> ends = KnownKinks(problem_);
  ends.push_back(problem_.horizon);
  const double norm = InfinityNorm(problem_.A);
  length_ = norm > 0 ? 4 / norm : problem_.horizon;
  bool may_jump = true;
  for (const double end : ends) {
    if (may_jump && !Start(t_)) return false;
    if (!Cross(end)) return false;
    may_jump = std::binary_search(breaks.begin(), breaks.end(), end);
    if (may_jump || end == problem_.horizon) HandOver(output_.EndStretch(end, x_, y_, w_));
  }
  progress_.Finish(problem_.horizon);
  return true;
}

bool EventLocator::Start(double begin) {
  Vector g(problem_.num_constraints());
  sampler_.G(begin, Side::kRight, g);
  bool y_is_solution = false;
  return StartStretch(context_, begin, g, x_, y_, y_is_solution);
}

bool EventLocator::Cross(double end) {
  mode_ = nullptr;
  attempt_ = 0;
  short_modes_ = 0;
  mode_begin_ = t_;
  last_mode_length_ = end - t_;
  gap_.reset();
  while (t_ < end) {
    if (context_.stop.stop_requested()) return context_.FailCancelled(t_);
    if (HasSpentTheDefault()) {
      return context_.Fail(Termination::kIterationLimit, t_,
                           "The work that is taken without being asked for ended at t = " + FormatNumber(t_) +
                               ": ask for an error.");
    }
    progress_.At(t_);
    Progressed progressed = mode_ ? Progressed::kYes : Choose(end);
    if (progressed == Progressed::kYes) progressed = Advance(end);
    if (progressed == Progressed::kFailed) return false;
    if (progressed == Progressed::kNoMode && !MarchOn(end)) return false;
  }
  return true;
}

// By counts, so that it does not depend on the machine.
bool EventLocator::HasSpentTheDefault() const {
  constexpr Index kStepsOfASmoothStep = 10;  // of a march, that take as long
  constexpr Index kStepsOfAMarchedStep = 3;  // one, and two of half its length
  if (!context_.error_by_default) return false;
  const Index spent = kStepsOfASmoothStep * (record_.steps + record_.rejected_steps) +
                      kStepsOfAMarchedStep * record_.marched_steps;
  return spent >= Options::kMostDefaultSteps;
}

// Proposes the next mode that y is determined in.
EventLocator::Progressed EventLocator::Choose(double end) {
  bool lost_least_element = false;
  while (attempt_ < kAttempts) {
    const ModeSearch::Proposal proposal = search_.Find(t_, x_, length_, end - t_, attempt_++);
    const bool solved = proposal.verdict == LcpVerdict::kSolved;
    lost_least_element = lost_least_element || (solved && !proposal.kept_selection);
    mode_ = proposal.kept_selection ? proposal.mode : nullptr;
    if (mode_) return Progressed::kYes;
    why_march_ = solved ? "the active set does not determine y (relative degree above one)"
                        : "the coupled LCP that proposes an active set was not solved";
  }
  if (!lost_least_element) return Progressed::kNoMode;
  context_.FailLostLeastElement(t_);
  return Progressed::kFailed;
}

// Another proposal where some are left.
EventLocator::Progressed EventLocator::GiveUpMode(const char* why) {
  mode_ = nullptr;
  why_march_ = why;
  return attempt_ < kAttempts ? Progressed::kYes : Progressed::kNoMode;
}

double EventLocator::Share(double length) const { return std::max(length / problem_.horizon, kLeastShare); }

double EventLocator::StepLength(double end) const {
  const double left = end - t_;
  if (length_ >= left) return left;
  return std::min(length_, left / 2);
}

// One step in the mode: accepted up to its end or to the first event, or shortened, or the mode given up.
EventLocator::Progressed EventLocator::Advance(double end) {
  const double length = StepLength(end);
  const double step_end = length == end - t_ ? end : t_ + length;  // not beyond a break point by rounding
  sampler_.Sample(t_, step_end, sources_);
  if (!sources_.finite) return FailNonFinite(step_end);
  if (!Project()) return GiveUpMode("the state is off the constraints of the active set");
  const auto take = [&] {
    return TakeSmoothStep(*mode_, x_, sources_, magnitudes_, tolerance_, Share(length), gap_ ? &*gap_ : nullptr);
  };
  step_ = take();
  if (step_.error_ratio <= 1 && sampler_.Probe(sources_)) {
    if (!sources_.finite) return FailNonFinite(step_end);
    step_ = take();
  }
  const double factor = 0.9 * std::pow(step_.error_ratio, -1.0 / (kLegendreDegree - 1));
  if (!(step_.error_ratio <= 1)) return Shorten(length * (std::isfinite(factor) ? std::clamp(factor, 0.1, 0.7) : 0.1));

  const auto mode_end = FindModeEnd(step_);
  if (!mode_end) {
    length_ = std::max(length_, length * std::clamp(factor, 0.5, 5.0));
    Accept(step_end, 1);
    return Progressed::kYes;
  }
  const double lasted = length * (1 + mode_end->s) / 2;
  const double again = lasted / kLeastKept;
  step_.error_ratio = NanMax(
      step_.error_ratio, ErrorRatioBefore(mode_end->s, *mode_, step_, magnitudes_, tolerance_, Share(length)));
  if (!(step_.error_ratio <= 1) && again < length && again > kShortestPart * problem_.horizon) return Shorten(again);
  search_.GuessBehind(*mode_, mode_end->guard);
  if (lasted <= std::max(kNoModePart * problem_.horizon, 4e-16 * t_)) return GiveUpMode("no active set lasts");
  Accept(t_ + lasted, mode_end->s);
  return EndMode(mode_end->s);
}

EventLocator::Progressed EventLocator::FailNonFinite(double step_end) {
  context_.Fail(Termination::kNonFinite, t_,
                "f or g is not finite between t = " + FormatNumber(t_) + " and " + FormatNumber(step_end) + ".");
  return Progressed::kFailed;
}

EventLocator::Progressed EventLocator::Shorten(double length) {
  const double shortest = kShortestPart * problem_.horizon;
  ++record_.rejected_steps;
  length_ = length;
  if (length_ >= shortest) return Progressed::kYes;
  why_march_ = "no step was short enough for the tolerance: a source jumps or has a kink at an undeclared time";
  length_ = 16 * shortest;
  return Progressed::kNoMode;
}

// An event at t, the position `s` of the last step.
EventLocator::Progressed EventLocator::EndMode(double s) {
  gap_ = GapOf(sources_);
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
  const Vector slope = step_.x * (2 / sources_.length * (GetLegendreBasis().derivative * LegendreValues(s)));
  const bool moved = (lasted * slope.array().abs() > tolerance_ * magnitudes_.x.array()).any();
  short_modes_ += moved ? 1 : kCountOfStill;
  if (short_modes_ < kMostShortModes) return Progressed::kYes;
  why_march_ = "switching times accumulate";
  return Progressed::kNoMode;
}

// Onto the constraints that the mode lays on the state: a drift of rounding, or of the tolerance at its
// start. False, and nothing done, where the state is farther off.
bool EventLocator::Project() {
  if (!mode_->differentiated()) return true;
  const Vector g = sources_.g * LegendreValues(-1);
  const Vector change = mode_->correction * (mode_->rows * x_ + mode_->rows_g * g);
  if ((change.array().abs() > tolerance_ * magnitudes_.x.array() + 1e-12 * MaxAbs(x_)).any()) return false;
  x_ -= change;
  return true;
}

// Takes the part of the step up to `end`, at position `s_end`.
void EventLocator::Accept(double end, double s_end) {
  if (sources_.check_s > s_end) sampler_.MoveCheck((s_end - 1) / 2, sources_);
  output_.AddSmooth(sources_, step_, mode_->active, end, s_end);
  NoteInterval(end, mode_);
  const LegendreVector at = LegendreValues(s_end);
  record_.accumulated_error += step_.error_ratio * tolerance_ * Share(sources_.length);
  x_ = step_.x * at;
  y_ = (step_.y * at).cwiseMax(0);
  t_ = end;
  magnitudes_.x = magnitudes_.x.cwiseMax(x_.cwiseAbs());
  magnitudes_.y = magnitudes_.y.cwiseMax(y_);
  w_ = (step_.guard * at).cwiseMax(0);
  for (const Index i : mode_->active) w_[i] = 0;
  magnitudes_.w = magnitudes_.w.cwiseMax(w_);
  ++record_.steps;
  attempt_ = 0;
  gap_.reset();
}

void EventLocator::NoteInterval(double end, const Mode* mode) {
  ModeInterval interval;
  interval.begin = t_;
  interval.end = end;
  interval.marched = !mode;
  if (mode) interval.active = mode->active;
  if (!mode) interval.why = why_march_;
  record_.Add(std::move(interval));
  record_.longest_step = std::max(record_.longest_step, end - t_);
}

// A burst of coupled steps. Each burst without a lasting mode between is twice as long as the one before and
// may err four times as much, so that the solve survives a point that the tolerance cannot pass; the record
// holds what it cost.
bool EventLocator::MarchOn(double end) {
  const double shortest = kShortestPart * problem_.horizon;
  if (burst_ == 1) march_length_ = std::max(shortest, std::min(length_, 1e3 * shortest));
  for (Index k = 0; k < burst_ && t_ < end;) {
    if (context_.stop.stop_requested()) return context_.FailCancelled(t_);
    if (record_.marched_steps >= kMostMarchedSteps) {
      return context_.Fail(Termination::kIterationLimit, t_,
                           "No active set lasts at t = " + FormatNumber(t_) + " (" + why_march_ + "), and " +
                               std::to_string(kMostMarchedSteps) +
                               " steps of first order did not carry on at the accuracy asked for. Use "
                               "exponential-march, or a larger tolerance.");
    }
    const double power = std::ldexp(1.0, std::ilogb(march_length_));
    const double length = std::min(power, end - t_);
    const double step_end = length == end - t_ ? end : t_ + length;
    const CoupledMarch::Step step = march_.Take(t_, step_end, length, x_);
    if (step.verdict != LcpVerdict::kSolved) {
      return FailLcp(context_, step.verdict, step_end, "The coupled step LCP(q, M + K_0)");
    }
    if (!step.kept_selection) return context_.FailLostLeastElement(step_end);
    const double allowed = tolerance_ * Share(length) * static_cast<double>(burst_) * static_cast<double>(burst_);
    const double ratio = (step.error.array() /
                          (allowed * magnitudes_.x.array().max(step.x.array().abs()) + 1e-14 * MaxAbs(step.x) + 1e-300))
                             .maxCoeff();
    if (!(ratio <= 1) && length > shortest) {
      march_length_ = length / 2;
      continue;
    }
    output_.AddMarched(t_, step_end, x_, step.x, step.y, step.w);
    NoteInterval(step_end, nullptr);
    record_.accumulated_error += ratio * allowed;
    x_ = step.x;
    y_ = step.y;
    w_ = step.w;
    t_ = step_end;
    magnitudes_.x = magnitudes_.x.cwiseMax(x_.cwiseAbs());
    ++record_.marched_steps;
    ++k;
    if (ratio < 0.2) march_length_ = 2 * length;
  }
  burst_ *= 2;
  mode_ = nullptr;
  attempt_ = 0;
  short_modes_ = 0;
  mode_begin_ = t_;
  last_mode_length_ = march_length_;
  length_ = std::max(length_, march_length_);
  return true;
}

void EventLocator::HandOver(const EventOutput::Stretch& stretch) {
  const Segment& segment = stretch.segment;
  if (segment.steps < 0) return;
  context_.recorder.Add(segment, stretch.w);
  context_.NoteImpulses(segment, 0, segment.steps);
}

void EventLocator::Finish() {
  Solution& solution = context_.solution;
  if (t_ < problem_.horizon) HandOver(output_.Finish());
  Cost& cost = solution.cost;
  cost.steps = record_.steps + record_.marched_steps;
  cost.marched_steps = record_.marched_steps;
  cost.lcps += search_.lcps() + march_.lcps();
  context_.certificate.Replace(output_.certificate());
  solution.pieces = output_.TakePieces();
}

}  // namespace dlcs
