// SPDX-License-Identifier: Apache-2.0
#include "core/methods/sparse_step.h"

namespace dlcs {
namespace {

SparseFactor<double> Factor(const Problem& problem, double scale) {
  const SparseMatrix A = problem.A.Sparse();
  return {A, SparseOrder(A), 1.0, scale};
}

}  // namespace

SparseStep::SparseStep(const Problem& problem, double step, double theta, bool averaged, Workers& workers)
    : problem_(problem),
      step_(step),
      theta_(theta),
      averaged_(averaged),
      weight_(averaged ? step / 2 : step),
      factor_(Factor(problem, step * (1 - theta))) {
  constexpr Index kColumnsAtOnce = 4;
  const Index m = problem.num_states(), n = problem.num_constraints();
  const SparseMatrix B = problem.B.Sparse();
  coupled_term_.resize(n, n);
  if (m <= StructuredMatrix::kMostDenseEntries / n) response_.resize(m, n);
  workers.ForBlocks(n, kColumnsAtOnce, [&](Index, Index begin, Index end) {
    const Matrix columns = factor_.Solve(weight_ * Matrix(B.middleCols(begin, end - begin)));
    coupled_term_.middleCols(begin, end - begin) = problem.N * columns;
    if (response_.size() > 0) response_.middleCols(begin, end - begin) = columns;
  });
}

Scheme SparseStep::Description() const {
  Scheme scheme;
  scheme.step = step_;
  scheme.x_is_linear = true;
  scheme.y_is_linear = averaged_;
  scheme.order = averaged_ ? 2 : 1;
  return scheme;
}

void SparseStep::StartWithSources(Segment& segment) const {
  auto x = segment.x.rightCols(segment.steps);
  x = weight_ * segment.f.rightCols(segment.steps);
  if (averaged_) x += weight_ * segment.f.leftCols(segment.steps);
}

void SparseStep::AddBefore(Segment& segment, Index j) const {
  const auto before = segment.x.col(j - 1);
  Vector sum = segment.x.col(j) + before;
  if (theta_ > 0) sum += step_ * theta_ * (problem_.A * before);
  if (averaged_) sum += weight_ * (problem_.B * segment.y.col(j - 1));
  segment.x.col(j) = factor_.Solve(sum);
}

void SparseStep::AddAfter(Segment& segment, Index j) const {
  if (response_.size() > 0) {
    segment.x.col(j).noalias() += response_ * segment.y.col(j);
  } else {
    segment.x.col(j) += factor_.Solve(Vector(weight_ * (problem_.B * segment.y.col(j))));
  }
}

}  // namespace dlcs
