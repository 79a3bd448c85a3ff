// SPDX-License-Identifier: Apache-2.0
#include "core/discretization/sparse_step.h"

namespace dlcs {
namespace {

SparseFactor<double> Factor(const Problem &problem, double scale) {
  const SparseMatrix A = problem.A.Sparse(), E = problem.E.Sparse();
  return {A, SparseOrder(A, E), 1.0, scale, E};
}

}  // namespace

SparseStep::SparseStep(const Problem &problem, double step, SparseRule rule, double theta, Workers &workers)
    : rule_(problem, step, rule, theta), factor_(Factor(problem, rule_.shift())) {
  constexpr Index kColumnsAtOnce = 4;
  const Index m = problem.num_states(), n = problem.num_constraints();
  const SparseMatrix B = problem.B.Sparse();
  coupled_term_.resize(n, n);
  if (m <= StructuredMatrix::kMaxDenseEntries / n) response_.resize(m, n);
  workers.ForBlocks(n, kColumnsAtOnce, [&](Index, Index begin, Index end) {
    const Matrix columns = factor_.Solve(rule_.weight() * Matrix(B.middleCols(begin, end - begin)));
    coupled_term_.middleCols(begin, end - begin) = problem.N * columns;
    if (response_.size() > 0) response_.middleCols(begin, end - begin) = columns;
  });
}

void SparseStep::AddBefore(Segment &segment, Index j, const Segment &stage) const {
  segment.x.col(j) = factor_.Solve(rule_.RightHandSide(segment, j, stage));
}

void SparseStep::StartStage(const Segment &segment, Index j, Segment &stage) const {
  const Vector sum = rule_.StartStage(segment, j, stage);
  stage.x.col(1) = factor_.Solve(sum);
}

void SparseStep::AddAfter(Segment &segment, Index j) const {
  if (response_.size() > 0) {
    segment.x.col(j).noalias() += response_ * segment.y.col(j);
  } else {
    segment.x.col(j) += factor_.Solve(Vector(rule_.weight() * (rule_.problem().B * segment.y.col(j))));
  }
}

}  // namespace dlcs
