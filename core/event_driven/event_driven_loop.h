// SPDX-License-Identifier: Apache-2.0
// The main loop of event_driven, from mode to mode.

#ifndef DLCS_CORE_EVENT_DRIVEN_EVENT_DRIVEN_LOOP_H_
#define DLCS_CORE_EVENT_DRIVEN_EVENT_DRIVEN_LOOP_H_

#include <limits>
#include <optional>
#include <string>

#include "core/context/progress.h"
#include "core/context/solve_context.h"
#include "core/discretization/step_sources.h"
#include "core/event_driven/coupled_steps.h"
#include "core/event_driven/discrete_layer.h"
#include "core/event_driven/error_growth.h"
#include "core/event_driven/event_output.h"
#include "core/event_driven/event_record.h"
#include "core/event_driven/flow_derivative.h"
#include "core/event_driven/jumps_near_zero.h"
#include "core/event_driven/magnitudes.h"
#include "core/event_driven/mode_end.h"
#include "core/event_driven/mode_search.h"
#include "core/event_driven/smooth_step.h"
#include "core/event_driven/step_length.h"
#include "core/outputs/output_evaluator.h"

namespace dlcs {

class EventDrivenLoop {
 public:
  // Keeps references. `asked` is the tolerance of the solution, `tolerance` that of its steps, and `allowed_rounding`
  // that of Magnitudes. Gives up when EventRecord::Work() exceeds `most_work`, or EventRecord::kPatience times that if
  // its pace is enough for T.
  EventDrivenLoop(SolveContext& context, double asked, double tolerance, double allowed_rounding, Index most_work,
                  EventRecord& record);

  // Solves up to T and passes the trajectory to the recorder of the context. Returns whether T was reached; otherwise
  // the solution says why not.
  bool Run();
  // Records the unfinished smooth interval, and sets counts, certificate and polynomials of the solution.
  void Finish();
  // The time up to which the system is solved.
  double reached() const { return t_; }

 private:
  enum class Progressed { kYes, kNoMode, kFailed };

  bool Start(double begin);
  bool Cross(double end);
  Progressed Choose(double end);
  Progressed Propose(double end);
  Progressed ResolveInstant(double end);
  Progressed Advance(double end);
  Progressed Repeat(double length);
  double SpeedOfGuard(const ModeEnd& mode_end) const;
  bool IsKnownWellEnough(const ModeEnd& mode_end, double lasted) const;
  void RetakeUpTo(double length, ModeEnd& mode_end);
  bool TakeOneMore(const Mode& mode, const Vector& start, double begin, double end, const EventGap* gap);
  double DelayAtEnd(Index guard) const;
  void Accept(double end, double s_end, std::optional<Index> guard = std::nullopt);
  Progressed EndMode(const ModeEnd& mode_end, double end);
  void GiveUpMode(const char* why);
  bool TryAgainFromBelow();
  bool RefineEvent();
  bool TakeCoupledSteps(double end);

  bool HappenAtKnownTime();
  bool PassTimer();
  bool Enter(const Instant& instant, FlipCause cause);
  void AddStatesToSources(const std::vector<char>& on);
  void AddUnknownFlips(const OverlookedByCause& overlooked);
  bool FailAtInstant(const Instant& instant);
  bool FailWithoutMode();
  bool IsOnLevel(const SwitchCondition& condition, const Vector& states) const;
  std::string WhyNoneLasts(const std::vector<Index>& switches) const;

  bool PassKink();
  double ErrorOfBreak(double time) const;
  bool IsStuck();
  bool IsBeyondWork() const;
  Progressed FailNonFinite();
  DataSizes SizesSoFar() const;
  void TakeStep(const Mode& mode, const Vector& start, const EventGap* gap);
  double ErrorOfStart();
  bool HasDips(double s_end, double length);
  void MeasureOutputs(double s_end);
  void NoteInterval(double end, const Mode* mode);
  void Record(const EventOutput::SmoothInterval& interval);

  SolveContext& context_;
  const Problem& problem_;
  SourceSampler sampler_;
  const double tolerance_;
  const Index most_work_;
  EventRecord& record_;
  ModeSearch search_;
  CoupledSteps coupled_steps_;
  EventOutput output_;
  ErrorGrowth errors_;
  RepelledStarts repelled_;
  JumpsNearZero jumps_near_zero_;
  std::vector<UncertainTime> uncertain_times_;  // of jumps of f and g
  std::optional<DiscreteLayer> discrete_;       // of problems with switches
  std::vector<Index> last_active_;              // of the last step
  std::vector<std::vector<char>> passed_;       // states of switches that did not last at t
  bool has_moved_ = false;                      // what y or constraints depend on has jumped: the state may have to
  std::optional<FlowDerivative> flow_;
  std::optional<OutputEvaluator> outputs_;
  Progress progress_;

  double t_ = 0;
  Vector x_;
  Vector y_;
  Vector w_;
  Vector x_start_;  // where the last step started: x_, projected onto the constraints of its mode
  Magnitudes magnitudes_;
  DataSizes sizes_;  // known before the solve
  const Mode* mode_ = nullptr;
  int attempt_ = 0;
  bool may_start_below_ = false;  // since all attempts without failed
  StepLength length_;
  int short_modes_ = 0;  // in a row
  double dips_ = std::numeric_limits<double>::infinity();  // RatioOfDips() of a step that was repeated for it
  double mode_begin_ = 0;
  double begin_error_ = 0;       // how far that may be off
  std::optional<EventGap> gap_;  // after an event
  // The step that an event ended, until a mode lasts after it.
  struct EventStep {
    std::vector<Index> active;
    double begin;
    double limit;  // no event is located beyond it
    Vector x;
    Index guard;
  };
  std::optional<EventStep> event_step_;
  std::optional<double> kink_;  // the next time at which a source is not smooth although it is no break point
  Index tries_ = 0;             // since `tries_from_`
  double tries_from_ = 0;
  std::string why_coupled_;
  StepSources sources_;
  SmoothStep step_;
  LegendreRows legendre_at_samples_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_EVENT_DRIVEN_LOOP_H_
