// SPDX-License-Identifier: Apache-2.0
#include "core/methods/reduced_march.h"

#include "core/methods/coupled_step.h"
#include "core/methods/marching.h"
#include "core/methods/progress.h"
#include "core/methods/reduced_run.h"
#include "core/methods/step_cache.h"

namespace dlcs {
namespace {

class ReducedMarcher {
 public:
  ReducedMarcher(SolveContext& context, Hold hold, Progress& progress)
      : context_(context),
        hold_(hold),
        progress_(progress),
        coupled_([this](double) {
          return std::make_unique<CoupledStep>(
              MakeCoupledLcpSolver(context_.problem.M, kernel_->K0(), context_.choice()),
              context_.problem.num_constraints(), hold_ == Hold::kLinear);
        }) {}

  // Marches `run`; returns the number of steps done.
  Index March(ReducedRun& run) {
    kernel_ = run.kernel.get();
    CoupledStep& coupled = coupled_.At(run.run.step);
    const auto memory = kernel_->Start(run.y.col(0));
    const Vector size = run.Sizes();
    Vector past(size.size()), q(size.size());
    const double begin = context_.Seconds();
    Index done = 0;
    for (; done < run.steps(); ++done) {
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
      run.q.col(j) += past;
      q = run.q.col(j) + run.g.col(j);
      const LcpVerdict verdict = coupled.Solve(q, size + past.cwiseAbs(), departures_, run.y.col(j));
      if (verdict != LcpVerdict::kSolved) {
        Fail(verdict, time);
        break;
      }
      run.q.col(j).noalias() += kernel_->K0() * run.y.col(j);
      memory->Push(run.y.col(j));
      ++context_.solution.cost.lcps;
    }
    context_.solution.cost.seconds_lcp += context_.Seconds() - begin;
    return done;
  }

  const Departures& departures() const { return departures_; }

 private:
  static constexpr Index kStepsPerLook = 16;

  void Fail(LcpVerdict verdict, double time) {
    if (departures_.steps_off_selection > 0 && hold_ == Hold::kLinear) {
      context_.FailLostLeastElement(time);
    } else {
      FailLcp(context_, verdict, time, "The coupled step LCP(q, M + K_0)");
    }
  }

  SolveContext& context_;
  Hold hold_;
  Progress& progress_;
  const ReducedKernel* kernel_ = nullptr;  // of the run
  StepCache<CoupledStep> coupled_;
  Departures departures_;
};

}  // namespace

bool ReducedMarch(SolveContext& context) {
  const Hold hold = context.y_is_lipschitz() ? Hold::kLinear : Hold::kConstant;
  Progress progress(context);
  ReducedMarcher marcher(context, hold, progress);
  if (!SolveRunByRun(context, hold, [&](ReducedRun& run) { return marcher.March(run); })) return false;
  progress.Finish(context.problem.horizon);
  WarnOf(marcher.departures(), context);
  return true;
}

}  // namespace dlcs
