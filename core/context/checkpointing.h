// SPDX-License-Identifier: Apache-2.0
// How a method makes checkpoints and resumes from one.

#ifndef DLCS_CORE_CONTEXT_CHECKPOINTING_H_
#define DLCS_CORE_CONTEXT_CHECKPOINTING_H_

#include <functional>

#include "absl/status/status.h"
#include "core/discretization/state_archive.h"
#include "core/problem/observer.h"

namespace dlcs {

struct SolveContext;

// A method lists the state that it needs to resume, besides the context, in one function for both writing and reading:
//
//     const auto carry = [&](StateArchive& state) { state(run, done, x, y); };
//     if (!context.checkpointing.Resume(context, carry)) return false;
//     for (...) {
//       ...
//       context.checkpointing.Offer(context, time, carry);
//     }
//
// When Offer() is called depends on step numbers alone. Whether a checkpoint is then made is the observer's decision,
// and may depend on the clock, since a checkpoint does not change the result.
class Checkpointing {
 public:
  using CarryMethod = std::function<void(StateArchive& state)>;

  // Makes no checkpoints and does not resume.
  Checkpointing() = default;
  // Resumes from `resume` if it is not null; it must outlive this object. Checkpoints are made only if `makes`.
  Checkpointing(const ResumePoint* resume, bool makes) : resume_(resume), makes_(makes) {}

  bool resumes() const { return resume_ != nullptr; }
  // If there is a state to resume from, sets the context and the method to it. Call it once, before the first step.
  // Returns false if the state does not belong to this solve; status() then says why.
  bool Resume(SolveContext& context, const CarryMethod& carry);
  // To be called when certificate and output are complete up to `time`. Makes a checkpoint if the observer wants one.
  void Offer(SolveContext& context, double time, const CarryMethod& carry);

  // OK, or InvalidArgument if the resume point does not belong to this solve or the method cannot resume. If the solve
  // was `stopped`, it may have ended before it called Resume(); that is not an error.
  absl::Status status(bool stopped) const;

 private:
  const ResumePoint* resume_ = nullptr;
  bool makes_ = false;
  bool resumed_ = false;
  bool refused_ = false;
  Index parted_ = 0;  // columns of the trajectory that earlier checkpoints hold
};

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_CHECKPOINTING_H_
