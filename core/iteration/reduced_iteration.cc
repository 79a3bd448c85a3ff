// SPDX-License-Identifier: Apache-2.0
#include "core/iteration/reduced_iteration.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "core/context/reduced_run.h"
#include "core/context/shared_setup.h"
#include "core/iteration/window_sequence.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// The steps `begin` + 1 ... `begin` + steps of a run.
class ReducedWindow final : public WindowModel {
 public:
  // `sizes` are those of the run. `start` is N x at the start of the run. `past` is the response, at the nodes of the
  // window, to y before it. Keeps references.
  ReducedWindow(SolveContext& context, const ReducedRun& run, const Vector& sizes, Index begin, const Vector& start,
                const Matrix& past)
      : context_(context),
        run_(run),
        sizes_(sizes),
        begin_(begin),
        start_(start),
        without_y_(run.g.middleCols(begin, past.cols() + 1)) {
    y = run.y.col(begin).replicate(1, past.cols() + 1);
    without_y_.col(0) += start;
    without_y_.rightCols(past.cols()) += run.free.nodes.middleCols(begin + 1, past.cols()) + past;
  }

  Index first_node() const override { return run_.run.first_node + begin_; }
  Matrix Frozen() override {
    y.rightCols(steps()).colwise() = y.col(0);
    Matrix q;
    Follow(q);
    return q;
  }
  Matrix Constant() override { return run_.g.middleCols(begin_, steps() + 1).colwise() + start_; }
  using WindowModel::Follow;
  void Follow(Matrix& q, const OnColumns& computed) override {
    q.resizeLike(without_y_);
    q.col(0) = without_y_.col(0);
    computed(0, 1);
    run_.kernel->AddResponse(without_y_.rightCols(steps()), y.rightCols(steps()), context_.workers, scratch_,
                             q.rightCols(steps()), [&](Index begin, Index end) { computed(begin + 1, end + 1); });
  }
  Vector Sizes() const override { return sizes_ + RowMaxAbs(without_y_); }
  double KernelBound() override { return run_.kernel->Bound(steps()) * run_.kernel->step(); }
  void Finish() override {}
  // N x at the end.
  Vector End() {
    Matrix q;
    Follow(q);
    return q.rightCols(1) - run_.g.col(begin_ + steps());
  }
  LcpStatus SolveCoupledStep(SelectionStats& departures) override {
    CoupledStep step(SharedCoupledSolver(context_, run_.kernel->K0()), y.rows(), true);
    return step.Solve(without_y_.col(1), Sizes(), departures, y.col(1));
  }

 private:
  SolveContext& context_;
  const ReducedRun& run_;
  const Vector& sizes_;
  Index begin_;
  Vector start_;
  Matrix without_y_;  // q without the response to the y of this window
  ResponseScratch scratch_;
};

// Finds y of `run`; returns the number of steps done.
Index Iterate(SolveContext& context, WindowSequence& windows, ReducedRun& run) {
  const Vector sizes = run.Sizes();
  const auto memory = run.kernel->Start(run.y.col(0));
  Matrix past;  // of as many steps as have been asked for, after `done`
  Index done = run.first_step;
  Vector N_x = done > 0 ? run.N_x : Vector(run.free.nodes.col(0));  // at `done`
  for (Index j = 1; j <= done; ++j) memory->Push(run.y.col(j));
  while (done < run.steps()) {
    past.resize(0, 0);
    const auto window = windows.Take([&]() -> std::unique_ptr<WindowModel> {
      const Index steps = std::min(windows.Width(), run.steps() - done);
      if (past.cols() < steps) past = memory->History(steps);
      return std::make_unique<ReducedWindow>(context, run, sizes, done, N_x, past.leftCols(steps));
    });
    if (!window) break;
    const Index steps = window->steps();
    run.y.middleCols(done + 1, steps) = window->y.rightCols(steps);
    done += steps;
    if (done == run.steps()) break;
    N_x = static_cast<ReducedWindow&>(*window).End();
    for (Index j = 1; j <= steps; ++j) memory->Push(window->y.col(j));
    run.offer_checkpoint(done, N_x);
  }
  return done;
}

}  // namespace

bool ReducedIteration(SolveContext& context) {
  WindowSequence windows(context);
  bool begun = false;
  const auto carry = [&](StateArchive& state) { state(windows, begun); };
  return SolveRunByRun(context, Hold::kLinear, carry, [&](ReducedRun& run) {
    if (!begun) windows.Begin([&] { return run.kernel->Bound(2) * run.kernel->step(); });
    begun = true;
    return Iterate(context, windows, run);
  });
}

}  // namespace dlcs
