// SPDX-License-Identifier: Apache-2.0
#include "core/methods/reduced_iteration.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "core/linalg/norms.h"
#include "core/methods/reduced_run.h"
#include "core/methods/shared_setup.h"
#include "core/methods/window_sequence.h"

namespace dlcs {
namespace {

// The steps `begin` + 1 ... `begin` + steps of a run.
class ReducedWindow final : public WindowModel {
 public:
  // `past` is the response at its nodes to y up to its start, later y being zero. Keeps references.
  ReducedWindow(SolveContext& context, const ReducedRun& run, Index begin, const Matrix& past)
      : context_(context), run_(run), begin_(begin), g_(run.g.middleCols(begin, past.cols() + 1)), without_y_(g_) {
    y = run.y.col(begin).replicate(1, past.cols() + 1);
    without_y_.col(0) += run.q.col(begin);
    without_y_.rightCols(past.cols()) += run.free.nodes.middleCols(begin + 1, past.cols()) + past;
  }

  Index first_node() const override { return run_.run.first_node + begin_; }
  Matrix Frozen() override {
    y.rightCols(steps()).colwise() = y.col(0);
    return Follow();
  }
  Matrix Constant() override { return g_.colwise() + run_.q.col(begin_); }
  Matrix Follow() override {
    Matrix q = without_y_;
    q.rightCols(steps()) += run_.kernel->Respond(y.rightCols(steps()), context_.workers);
    return q;
  }
  Vector Sizes() const override { return run_.Sizes() + RowMaxAbs(without_y_); }
  double KernelBound() override { return run_.kernel->Bound(steps()) * run_.kernel->step(); }
  void Finish() override { N_x = Follow() - g_; }
  LcpVerdict March(Departures& departures) override {
    CoupledStep step(SharedCoupledSolver(context_, run_.kernel->K0()), y.rows(), true);
    const LcpVerdict verdict = step.Solve(without_y_.col(1), Sizes(), departures, y.col(1));
    if (verdict == LcpVerdict::kSolved) Finish();
    return verdict;
  }

  Matrix N_x;  // finished

 private:
  SolveContext& context_;
  const ReducedRun& run_;
  Index begin_;
  Matrix g_;
  Matrix without_y_;  // q without the response to the y of this window
};

// Finds y and q of `run`; returns the number of steps done.
Index Iterate(SolveContext& context, WindowSequence& windows, ReducedRun& run) {
  const auto memory = run.kernel->Start(run.y.col(0));
  Matrix past;  // of as many steps as have been asked for, after `done`
  Index done = 0;
  while (done < run.steps()) {
    past.resize(0, 0);
    const auto window = windows.Take([&]() -> std::unique_ptr<WindowModel> {
      const Index steps = std::min(windows.Width(), run.steps() - done);
      if (past.cols() < steps) past = memory->History(steps);
      return std::make_unique<ReducedWindow>(context, run, done, past.leftCols(steps));
    });
    if (!window) break;
    const Index steps = window->steps();
    run.y.middleCols(done + 1, steps) = window->y.rightCols(steps);
    run.q.middleCols(done + 1, steps) = static_cast<const ReducedWindow&>(*window).N_x.rightCols(steps);
    done += steps;
    if (done == run.steps()) break;
    for (Index j = 1; j <= steps; ++j) memory->Push(window->y.col(j));
  }
  return done;
}

}  // namespace

bool ReducedIteration(SolveContext& context) {
  WindowSequence windows(context);
  bool begun = false;
  return SolveRunByRun(context, Hold::kLinear, [&](ReducedRun& run) {
    if (!begun) windows.Begin([&] { return run.kernel->Bound(2) * run.kernel->step(); });
    begun = true;
    return Iterate(context, windows, run);
  });
}

}  // namespace dlcs
