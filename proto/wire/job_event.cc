// SPDX-License-Identifier: Apache-2.0
#include "proto/wire/job_event.h"

namespace dlcs {

std::optional<v1::SolveEvent> AsSolveEvent(const v1::JobEvent& event) {
  v1::SolveEvent told;
  told.set_sequence(event.sequence());
  switch (event.kind_case()) {
    case v1::JobEvent::kAnalysis:
      *told.mutable_analysis() = event.analysis();
      return told;
    case v1::JobEvent::kWindowStarted:
      *told.mutable_window_started() = event.window_started();
      return told;
    case v1::JobEvent::kIterate:
      *told.mutable_iterate() = event.iterate();
      return told;
    case v1::JobEvent::kWindowFinished:
      *told.mutable_window_finished() = event.window_finished();
      return told;
    case v1::JobEvent::kGap:
      told.mutable_gap()->set_first_sequence(event.gap().first_sequence());
      told.mutable_gap()->set_last_sequence(event.gap().last_sequence());
      return told;
    case v1::JobEvent::kHeartbeat:
      told.mutable_waiting();
      return told;
    case v1::JobEvent::kState:
    case v1::JobEvent::kCheckpointed:
    case v1::JobEvent::kLog:
    case v1::JobEvent::kFinished:
    case v1::JobEvent::KIND_NOT_SET:  // an event of a newer server
      return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace dlcs
