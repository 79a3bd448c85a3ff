// SPDX-License-Identifier: Apache-2.0
// The main loop of event_driven, from mode to mode.

#ifndef DLCS_CORE_EVENT_DRIVEN_EVENT_DRIVEN_LOOP_H_
#define DLCS_CORE_EVENT_DRIVEN_EVENT_DRIVEN_LOOP_H_

#include <optional>
#include <string>

#include "core/context/progress.h"
#include "core/context/solve_context.h"
#include "core/discretization/step_sources.h"
#include "core/event_driven/coupled_steps.h"
#include "core/event_driven/error_growth.h"
#include "core/event_driven/event_output.h"
#include "core/event_driven/event_record.h"
#include "core/event_driven/first_crossing.h"
#include "core/event_driven/flow_derivative.h"
#include "core/event_driven/mode_search.h"
#include "core/event_driven/smooth_step.h"

namespace dlcs {

class EventDrivenLoop {
 public:
  // Keeps references. `tolerance` and the others as in EventDriven(). Gives up when EventRecord::Work() exceeds
  // `most_work`, or eight times that if its pace is enough for T.
  EventDrivenLoop(SolveContext& context, double tolerance, Index most_work, EventRecord& record);

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
  Progressed Advance(double end);
  bool AreCoupledStepsHopeless() const;
  bool TakeCoupledSteps(double end);
  void BeginWith(const Mode& mode);

  DataSizes SizesOfData();
  DataSizes SizesSoFar() const;
  Progressed GiveUpMode(const char* why);
  bool RefineEvent();
  Progressed FailNonFinite(double step_end);
  Progressed Shorten(double length);
  bool PassKink();
  bool SourceJumps(double time, double part);
  bool IsStuck();
  bool IsBeyondWork() const;
  Progressed EndMode(const ModeEnd& mode_end, double end);
  void RaiseReach();
  bool Project();
  Dip MissedDip(Index guard, double error, double s_end) const;
  ErrorGrowth::Overlooked Overlooked(double s_end, double duration) const;
  void Accept(double end, double s_end);
  void NoteInterval(double end, const Mode* mode);
  void Record(const EventOutput::SmoothInterval& interval);
  double StepLength(double end) const;
  double Shortest(double part_of_horizon, double part_of_rate) const;
  double ShortestMode() const;
  bool FallsFromZero(const ModeEnd& mode_end) const;
  bool TryAgainFromBelow();
  void LetStartBelow();
  bool StartsBelowByTruncation(Index guard) const;
  double Share(double length) const;  // the part of the tolerance for a step of this length

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
  std::optional<FlowDerivative> flow_;
  Progress progress_;

  double t_ = 0;
  Vector x_;
  Vector y_;
  Vector w_;
  Vector x_begin_;  // at t_, before it was projected onto the constraints of a mode
  Vector x_start_;  // where the last step started: after that
  Magnitudes magnitudes_;
  DataSizes sizes_;  // known before the solve
  const Mode* mode_ = nullptr;
  int attempt_ = 0;
  bool may_start_below_ = false;  // since all attempts without failed
  double length_ = 0;             // the last length that the tolerance allowed
  int short_modes_ = 0;           // in a row
  double mode_begin_ = 0;
  double last_mode_length_ = 0;
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
  int rejected_in_a_row_ = 0;
  double rejected_ratio_ = 0;  // SmoothStep::error_ratio of the last rejected step
  int of_one_length_ = 0;      // steps in a row that found no reason to grow
  Index tries_ = 0;            // since `tries_from_`
  double tries_from_ = 0;
  Index burst_ = 1;  // number of coupled steps to take before the next search for a mode
  double coupled_length_ = 0;
  double first_coupled_ = 0;  // where the first of them began
  std::string why_coupled_;
  StepSources sources_;
  SmoothStep step_;
  LegendreRows legendre_at_samples_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_EVENT_DRIVEN_LOOP_H_
