// SPDX-License-Identifier: Apache-2.0
// The way of event_located from mode to mode.

#ifndef DLCS_CORE_EVENTS_EVENT_LOCATOR_H_
#define DLCS_CORE_EVENTS_EVENT_LOCATOR_H_

#include <optional>
#include <string>

#include "core/events/coupled_march.h"
#include "core/events/event_output.h"
#include "core/events/event_record.h"
#include "core/events/mode_search.h"
#include "core/events/smooth_step.h"
#include "core/events/step_sources.h"
#include "core/methods/progress.h"
#include "core/methods/solve_context.h"

namespace dlcs {

class EventLocator {
 public:
  // Keeps references; `tolerance` and the rest as EventLocated().
  EventLocator(SolveContext& context, double tolerance, EventRecord& record);

  // Goes to T and hands the trajectory to the recorder of the context. Returns whether it came there;
  // otherwise the solution says why not.
  bool Run();
  // Hands over what a stretch had that was not finished, counts, certificate and polynomials.
  void Finish();
  // The time up to which the system is solved.
  double reached() const { return t_; }

 private:
  enum class Progressed { kYes, kNoMode, kFailed };

  bool Start(double begin);
  bool Cross(double end);
  Progressed Choose(double end);
  Progressed Advance(double end);
  bool MarchOn(double end);

  bool HasSpentTheDefault() const;
  Progressed GiveUpMode(const char* why);
  Progressed FailNonFinite(double step_end);
  Progressed Shorten(double length);
  Progressed EndMode(double s);
  bool Project();
  void Accept(double end, double s_end);
  void NoteInterval(double end, const Mode* mode);
  void HandOver(const EventOutput::Stretch& stretch);
  double StepLength(double end) const;
  double Share(double length) const;  // of the tolerance, for a step

  SolveContext& context_;
  const Problem& problem_;
  SourceSampler sampler_;
  const double tolerance_;
  EventRecord& record_;
  ModeSearch search_;
  CoupledMarch march_;
  EventOutput output_;
  Progress progress_;

  double t_ = 0;
  Vector x_;
  Vector y_;
  Vector w_;
  Magnitudes magnitudes_;
  const Mode* mode_ = nullptr;
  int attempt_ = 0;
  double length_ = 0;    // that the tolerance allowed last
  int short_modes_ = 0;  // in a row
  double mode_begin_ = 0;
  double last_mode_length_ = 0;
  std::optional<SourceGap> gap_;  // behind an event
  Index burst_ = 1;               // steps of the next march
  double march_length_ = 0;
  std::string why_march_;
  StepSources sources_;
  SmoothStep step_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENTS_EVENT_LOCATOR_H_
