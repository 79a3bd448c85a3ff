// SPDX-License-Identifier: Apache-2.0
// How a method leaves checkpoints, and goes on from one.

#ifndef DLCS_CORE_CONTEXT_CHECKPOINTING_H_
#define DLCS_CORE_CONTEXT_CHECKPOINTING_H_

#include <functional>

#include "absl/status/status.h"
#include "core/discretization/state_archive.h"
#include "core/problem/observer.h"

namespace dlcs {

struct SolveContext;

// A method names what it needs to go on, besides what is in the context, in one function that carries it both ways:
//
//     const auto carry = [&](StateArchive& state) { state(run, done, x, y); };
//     if (!context.checkpointing.Resume(context, carry)) return false;
//     for (...) {
//       ...
//       context.checkpointing.Offer(context, time, carry);
//     }
//
// Offers depend on step numbers alone; whether one is taken is the observer's wish and may depend on the clock, since a
// checkpoint changes nothing.
class Checkpointing {
 public:
  using CarryMethod = std::function<void(StateArchive& state)>;

  // Makes none, and resumes nothing.
  Checkpointing() = default;
  // Goes on from `resume` where that is not null; it must outlive this. Without `makes` no checkpoints are made.
  Checkpointing(const ResumePoint* resume, bool makes) : resume_(resume), makes_(makes) {}

  bool resumes() const { return resume_ != nullptr; }
  // Where there is a state to go on from, sets the context and the method to it. To be called once, before the first
  // step. Returns false, and status() says why, where the state is not one of this solve.
  bool Resume(SolveContext& context, const CarryMethod& carry);
  // All is filed up to `time`: makes a checkpoint if the observer wants one.
  void Offer(SolveContext& context, double time, const CarryMethod& carry);

  // Of a solve that was `stopped`, perhaps before it came as far as to resume, or that was not. Errors: InvalidArgument
  // where the resume point does not belong to this solve, or the method cannot go on from one.
  absl::Status status(bool stopped) const;

 private:
  const ResumePoint* resume_ = nullptr;
  bool makes_ = false;
  bool resumed_ = false;
  bool refused_ = false;
  Index parted_ = 0;  // columns of the trajectory that checkpoints have had
};

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_CHECKPOINTING_H_
