// SPDX-License-Identifier: Apache-2.0
#include "core/discretization/sparse_step.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

constexpr Index kColumnsAtOnce = 4;

SparseFactor<double> Factor(const Problem &problem, double scale) {
  const SparseMatrix A = problem.A.Sparse(), E = problem.E.Sparse();
  return {A, SparseOrder(A, E), 1.0, scale, E};
}

// Entries that are lost beside the largest one of their column, even in twice the working precision, are left out: they
// decay on the way through the factor.
double LeastEntry(const Vector &half) { return RoundingOf(2) * RoundingOf(2) * MaxAbs(half); }

// Whether the first halves of the solves for the columns of Nᵀ and B take less reading than a solve. Some of Nᵀ tell.
bool AreHalvesSparse(const SparseFactor<double> &factor, const SparseMatrix &transpose_of_N) {
  constexpr Index kSamples = 4;
  const Index count = transpose_of_N.cols();
  double entries = 0, columns = 0;
  for (Index j = 0; j < count; j += std::max<Index>(1, count / kSamples)) {
    const Vector half = factor.FirstHalfOfTranspose(Vector(transpose_of_N.col(j)));
    entries += static_cast<double>((half.array().abs() > LeastEntry(half)).count());
    ++columns;
  }
  const double bytes_of_column = entries / columns * (sizeof(double) + sizeof(int));
  return 2 * static_cast<double>(count) * bytes_of_column <= factor.bytes_of_a_solve();
}

// half_of(column) for each of the columns.
template <class HalfOf>
SparseMatrix Halves(const HalfOf &half_of, const SparseMatrix &columns, Workers &workers) {
  const Index count = columns.cols();
  std::vector<std::vector<std::pair<Index, double>>> entries(static_cast<std::size_t>(count));
  workers.ForBlocks(count, kColumnsAtOnce, [&](Index, Index begin, Index end) {
    for (Index j = begin; j < end; ++j) {
      const Vector half = half_of(Vector(columns.col(j)));
      const double least = LeastEntry(half);
      for (Index i = 0; i < half.size(); ++i) {
        if (std::abs(half[i]) > least) entries[static_cast<std::size_t>(j)].emplace_back(i, half[i]);
      }
    }
  });
  SparseMatrix halves(columns.rows(), count);
  std::size_t nonzeros = 0;
  for (const auto &of_column : entries) nonzeros += of_column.size();
  halves.reserve(static_cast<Index>(nonzeros));
  for (Index j = 0; j < count; ++j) {
    halves.startVec(j);
    for (const auto &[row, value] : entries[static_cast<std::size_t>(j)]) halves.insertBack(row, j) = value;
  }
  halves.finalize();
  return halves;
}

}  // namespace

SparseStep::SparseStep(const Problem &problem, double step, SparseRule rule, double theta, Workers &workers)
    : rule_(problem, step, rule, theta), factor_(Factor(problem, rule_.shift())) {
  const Index m = problem.num_states(), n = problem.num_constraints();
  const SparseMatrix B = problem.B.Sparse(), transpose_of_N = problem.N.Sparse().transpose();
  keeps_halves_ = factor_.has_halves() && AreHalvesSparse(factor_, transpose_of_N);
  coupled_term_.resize(n, n);
  if (keeps_halves_) {
    const auto half = [this](const Vector &column) { return factor_.FirstHalf(column); };
    const auto half_of_transpose = [this](const Vector &column) { return factor_.FirstHalfOfTranspose(column); };
    Halves(half_of_transpose, transpose_of_N, workers).swap(half_of_N_);
    Halves(half, rule_.weight() * B, workers).swap(half_of_B_);
    workers.ForBlocks(n, kColumnsAtOnce, [&](Index, Index begin, Index end) {
      coupled_term_.middleCols(begin, end - begin) =
          half_of_N_.transpose() * Matrix(half_of_B_.middleCols(begin, end - begin));
    });
    return;
  }
  const double bytes_of_response = sizeof(double) * static_cast<double>(m) * static_cast<double>(n);
  if (m <= StructuredMatrix::kMaxDenseEntries / n && bytes_of_response <= factor_.bytes_of_a_solve()) {
    response_.resize(m, n);
  }
  workers.ForBlocks(n, kColumnsAtOnce, [&](Index, Index begin, Index end) {
    const Matrix columns = factor_.Solve(rule_.weight() * Matrix(B.middleCols(begin, end - begin)));
    coupled_term_.middleCols(begin, end - begin) = problem.N * columns;
    if (response_.size() > 0) response_.middleCols(begin, end - begin) = columns;
  });
}

Vector SparseStep::Before(const Vector &right) const {
  return keeps_halves_ ? factor_.FirstHalf(right) : Vector(factor_.Solve(right));
}

void SparseStep::AddBefore(Segment &segment, Index j, const Segment &stage) const {
  segment.x.col(j) = Before(rule_.RightHandSide(segment, j, stage));
}

void SparseStep::StartStage(const Segment &segment, Index j, Segment &stage) const {
  const Vector sum = rule_.StartStage(segment, j, stage);
  stage.x.col(1) = Before(sum);
}

void SparseStep::AddPairs(const Segment &segment, Index j, Vector &q, Vector &size) const {
  const auto x = segment.x.col(j);
  if (!keeps_halves_) {
    const Problem &problem = rule_.problem();
    q += problem.N * x;
    size += problem.N.AbsTimes(x.cwiseAbs());
    return;
  }
  for (Index i = 0; i < q.size(); ++i) {
    double sum = 0, size_of_sum = 0;
    for (SparseMatrix::InnerIterator entry(half_of_N_, i); entry; ++entry) {
      const double term = entry.value() * x[entry.row()];
      sum += term;
      size_of_sum += std::abs(term);
    }
    q[i] += sum;
    size[i] += size_of_sum;
  }
}

void SparseStep::AddAfter(Segment &segment, Index j) const {
  const auto y = segment.y.col(j);
  if (keeps_halves_) {
    Vector half = segment.x.col(j);
    for (Index i = 0; i < y.size(); ++i) {
      if (y[i] == 0) continue;
      for (SparseMatrix::InnerIterator entry(half_of_B_, i); entry; ++entry) half[entry.row()] += y[i] * entry.value();
    }
    segment.x.col(j) = factor_.SecondHalf(std::move(half));
  } else if (response_.size() > 0) {
    segment.x.col(j).noalias() += response_ * y;
  } else {
    segment.x.col(j) += factor_.Solve(Vector(rule_.weight() * (rule_.problem().B * y)));
  }
}

}  // namespace dlcs
