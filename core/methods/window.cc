// SPDX-License-Identifier: Apache-2.0
#include "core/methods/window.h"

#include <utility>

#include "core/methods/propagation.h"

namespace dlcs {

void Window::Append(StepTools& tools, Segment segment) {
  const Index first = steps;
  steps += segment.steps;
  g.conservativeResize(segment.g.rows(), steps + 1);
  g.rightCols(steps + 1 - first) = segment.g;
  pieces.push_back({&tools, std::move(segment)});
}

StepTools* Window::SharedTools() const {
  for (const WindowPiece& piece : pieces) {
    if (piece.tools != pieces.front().tools) return nullptr;
  }
  return pieces.front().tools;
}

Matrix Window::Propagate(const Problem& problem, const Vector& start) {
  Matrix q = g;
  Vector x = start;
  Index first = 0;
  for (WindowPiece& piece : pieces) {
    Segment& segment = piece.segment;
    segment.x.resize(x.size(), segment.steps + 1);
    segment.x.col(0) = x;
    segment.y = y.middleCols(first, segment.steps + 1);
    dlcs::Propagate(piece.tools->scheme(), segment);
    x = segment.x.col(segment.steps);
    q.middleCols(first + 1, segment.steps).noalias() += problem.N * segment.x.rightCols(segment.steps);
    first += segment.steps;
  }
  q.col(0) += problem.N * start;
  return q;
}

Vector Window::SizeOfSums(const Problem& problem) const {
  Vector size = Vector::Zero(problem.num_constraints());
  for (const WindowPiece& piece : pieces) {
    size = size.cwiseMax(dlcs::SizeOfSums(problem.N, piece.segment.x, piece.segment.g));
  }
  return size;
}

}  // namespace dlcs
