// SPDX-License-Identifier: Apache-2.0
#include "core/iteration/window.h"

#include <limits>
#include <utility>

#include "core/discretization/scheme.h"
#include "core/lcp/basis/tolerance.h"

namespace dlcs {

Window::Window(SolveContext& context, const Vector& start, const Vector& y_start)
    : context_(context), start_(start), g_(y_start.size(), 1) {
  y = y_start;
}

void Window::Append(StepTools& tools, Segment segment) {
  const Index first = steps(), added = segment.steps;
  g_.conservativeResize(Eigen::NoChange, first + added + 1);
  g_.rightCols(added + 1) = segment.g;
  y = y.col(0).replicate(1, first + added + 1).eval();
  pieces_.push_back({&tools, std::move(segment)});
}

StepTools* Window::SharedTools() {
  StepTools* tools = pieces_.front().tools;
  for (const WindowPiece& piece : pieces_) {
    if (piece.tools != tools) return nullptr;
  }
  tools->kernel.Reserve(steps(), context_.stop);
  return tools->kernel.longest_window() < steps() ? nullptr : tools;
}

Matrix Window::Propagate() {
  Matrix q = g_;
  Vector x = start_;
  Index first = 0;
  for (WindowPiece& piece : pieces_) {
    Segment& segment = piece.segment;
    segment.x.resize(x.size(), segment.steps + 1);
    segment.x.col(0) = x;
    segment.y = y.middleCols(first, segment.steps + 1);
    dlcs::Propagate(piece.tools->scheme(), segment);
    x = segment.x.col(segment.steps);
    q.middleCols(first + 1, segment.steps).noalias() += context_.problem.N * segment.x.rightCols(segment.steps);
    first += segment.steps;
  }
  q.col(0) += context_.problem.N * start_;
  return q;
}

Matrix Window::Frozen() {
  y.rightCols(steps()).colwise() = y.col(0);
  frozen_ = Propagate();
  return frozen_;
}

Matrix Window::Constant() { return g_.colwise() + context_.problem.N * start_; }

void Window::Follow(Matrix& q, const OnColumns& computed) {
  if (StepTools* tools = SharedTools()) {
    const Matrix deviation = y.rightCols(steps()).colwise() - y.col(0);
    q = frozen_;
    q.rightCols(steps()) += tools->kernel.Respond(deviation);
  } else {
    q = Propagate();
  }
  context_.workers.ForBlocks(q.cols(), kColumnsPerBlock, [&](Index, Index begin, Index end) { computed(begin, end); });
}

Vector Window::Sizes() const {
  Vector size = Vector::Zero(y.rows());
  for (const WindowPiece& piece : pieces_) {
    size = size.cwiseMax(dlcs::SizeOfSums(context_.problem.N, piece.segment.x, piece.segment.g));
  }
  return size;
}

double Window::KernelBound() {
  StepTools* tools = pieces_.front().tools;
  for (const WindowPiece& piece : pieces_) {
    if (piece.tools != tools) return std::numeric_limits<double>::quiet_NaN();
  }
  tools->kernel.Reserve(steps(), context_.stop);
  return tools->kernel.Bound(steps()) * tools->scheme().step;
}

LcpStatus Window::SolveCoupledStep(SelectionStats& departures) {
  Index solved = 0;
  WindowPiece& piece = pieces_.front();
  piece.segment.x.col(0) = start_;
  piece.segment.y.col(0) = y.col(0);
  const LcpStatus verdict = piece.tools->stepper.TakeSteps(piece.segment, context_.stop, departures, solved);
  return verdict == LcpStatus::kSolved && solved < 1 ? LcpStatus::kPivotLimit : verdict;  // stopped
}

}  // namespace dlcs
