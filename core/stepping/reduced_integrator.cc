// SPDX-License-Identifier: Apache-2.0
#include "core/stepping/reduced_integrator.h"

#include "core/context/progress.h"
#include "core/context/reduced_run.h"
#include "core/context/shared_setup.h"
#include "core/discretization/step_cache.h"
#include "core/parallel/stop_scope.h"
#include "core/stepping/split_step.h"
#include "core/stepping/stepping.h"

namespace dlcs {
namespace {

// Guesses y_j from the polynomial through up to three preceding nodes. Negative values become zero.
void Extrapolate(Matrix& y, Index j) {
  if (j == 1) {
    y.col(j) = y.col(j - 1);
  } else if (j == 2) {
    y.col(j) = (2 * y.col(j - 1) - y.col(j - 2)).cwiseMax(0);
  } else {
    y.col(j) = (3 * (y.col(j - 1) - y.col(j - 2)) + y.col(j - 3)).cwiseMax(0);
  }
}

class ReducedStepper {
 public:
  ReducedStepper(SolveContext& context, Hold hold, Progress& progress)
      : context_(context), hold_(hold), progress_(progress), steps_([this](double) { return MakeStep(); }) {}

  // Takes the steps of `run` and returns the number of completed steps.
  Index TakeSteps(ReducedRun& run) {
    kernel_ = run.kernel;
    SplitStep& step = steps_.At(run.run.step);
    const auto memory = kernel_->Start(run.y.col(0));
    const Vector size = run.Sizes();
    Vector past(size.size()), q(size.size());
    const double begin = context_.Seconds();
    Index done = run.first_step;
    for (Index j = 1; j <= done; ++j) memory->Push(run.y.col(j));
    try {
      for (; done < run.steps(); ++done) {
        if (done % kStepsPerBlock == 0) {
          step.StartFrom(run.y.col(done));
          if (done > run.first_step) run.offer_checkpoint(done, Vector());
        }
        const Index j = done + 1;
        const double time = run.Time(context_.grid, j);
        if (done % kStepsPerLook == 0) {
          if (context_.stop.stop_requested()) {
            context_.FailCancelled(time);
            break;
          }
          progress_.At(run.Time(context_.grid, done));
        }
        memory->Next(past);
        q = run.free.nodes.col(j) + run.g.col(j) + past;
        Extrapolate(run.y, j);
        const LcpStatus verdict = step.Solve(q, size + past.cwiseAbs(), departures_, run.y.col(j));
        if (verdict != LcpStatus::kSolved) {
          Fail(verdict, time);
          break;
        }
        memory->Push(run.y.col(j));
        ++context_.solution.cost.lcps;
      }
    } catch (const Stopped&) {
      context_.FailCancelled(run.Time(context_.grid, done + 1));
    }
    context_.solution.cost.seconds_lcp += context_.Seconds() - begin;
    context_.solution.cost.steps += done;
    return done;
  }

  const SelectionStats& departures() const { return departures_; }
  // What runs leave to the next ones, for checkpoints.
  friend void CarryFields(StateArchive& state, ReducedStepper& stepper) {
    state(stepper.departures_.steps_off_selection, stepper.departures_.steps_with_ties);
  }

 private:
  static constexpr Index kStepsPerLook = 16;
  static constexpr Index kStepsPerBlock = 256;  // the bits of a block depend on y before it alone

  std::unique_ptr<SplitStep> MakeStep() const {
    const StructuredMatrix& M = context_.problem.M;
    std::optional<BandSplitting> splitting;
    if (context_.selection == Selection::kUnique) splitting = SplitOffBand(M.Dense() + kernel_->K0());
    return std::make_unique<SplitStep>(std::move(splitting), [this, kernel = kernel_] {
      return std::make_unique<CoupledStep>(SharedCoupledSolver(context_, kernel->K0()), kernel->K0().rows(),
                                           hold_ == Hold::kLinear);
    });
  }

  void Fail(LcpStatus verdict, double time) {
    if (departures_.steps_off_selection > 0 && hold_ == Hold::kLinear) {
      context_.FailLostLeastElement(time);
    } else {
      FailLcp(context_, verdict, time, "The coupled step LCP(q, M + K_0)");
    }
  }

  SolveContext& context_;
  Hold hold_;
  Progress& progress_;
  std::shared_ptr<const ReducedKernel> kernel_;  // of the run
  StepCache<SplitStep> steps_;
  SelectionStats departures_;
};

}  // namespace

bool IntegrateReduced(SolveContext& context) {
  const Hold hold = context.y_is_lipschitz() ? Hold::kLinear : Hold::kConstant;
  Progress progress(context);
  ReducedStepper stepper(context, hold, progress);
  const auto carry = [&](StateArchive& state) { state(stepper); };
  if (!SolveRunByRun(context, hold, carry, [&](ReducedRun& run) { return stepper.TakeSteps(run); })) return false;
  progress.Finish(context.problem.horizon);
  WarnOf(stepper.departures(), context);
  return true;
}

}  // namespace dlcs
