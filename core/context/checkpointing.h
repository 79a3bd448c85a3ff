// SPDX-License-Identifier: Apache-2.0
// How a method makes checkpoints and resumes from one.

#ifndef DLCS_CORE_CONTEXT_CHECKPOINTING_H_
#define DLCS_CORE_CONTEXT_CHECKPOINTING_H_

#include <functional>

#include "absl/status/status.h"
#include "core/context/solve_context.h"
#include "core/discretization/state_archive.h"

namespace dlcs {

// A method lists the state that it needs to resume, besides the context, in one function for both writing and reading:
//
//     const auto carry = [&](StateArchive& state) { state(run, done, x, y); };
//     if (!ResumeFromCheckpoint(context, carry)) return false;
//     for (...) {
//       ...
//       OfferCheckpoint(context, time, carry);
//     }
//
// When OfferCheckpoint() is called depends on step numbers alone. Whether a checkpoint is then made is the observer's
// decision, and may depend on the clock, since a checkpoint does not change the result.
using CarryMethod = std::function<void(StateArchive& state)>;

// If there is a state to resume from, sets the context and the method to it. Call it once, before the first step.
// Returns false if the state does not belong to this solve; ResumeStatus() then says why.
bool ResumeFromCheckpoint(SolveContext& context, const CarryMethod& carry);

// To be called when certificate and output are complete up to `time`. Makes a checkpoint if the observer wants one.
void OfferCheckpoint(SolveContext& context, double time, const CarryMethod& carry);

// OK, or InvalidArgument if the resume point does not belong to this solve or the method cannot resume. If the solve
// was `stopped`, it may have ended before it resumed; that is not an error.
absl::Status ResumeStatus(const CheckpointRecord& checkpoints, bool stopped);

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_CHECKPOINTING_H_
