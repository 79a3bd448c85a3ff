// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/sparse/multigrid.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/linalg/sparse/aggregation.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

constexpr Index kRowsOfABlock = 4096;
// Up to here a level is factored.
constexpr Index kCoarsest = 300;
// A level that is hardly smaller than the one before it is not worth its cost.
constexpr double kWorthwhile = 0.7;
// Couplings below this, relative to the diagonal, are weak; halved at each level, since coarse couplings are smoother
// (the source of aggregation.h).
constexpr double kStrong = 0.08;

CompressedRows<float> InSinglePrecision(const CompressedRows<double>& K) {
  CompressedRows<float> A{.cols = K.cols, .start = K.start, .column = K.column};
  A.value.assign(K.value.begin(), K.value.end());
  return A;
}

// The pattern of R A P, with zeros.
CompressedRows<float> CoarsePattern(const CompressedRows<float>& A, const CompressedRows<float>& P,
                                    const CompressedRows<float>& R, Workers& workers) {
  constexpr Index kBlock = 512;
  const Index size = R.rows();
  std::vector<std::vector<int>> columns((size + kBlock - 1) / kBlock);
  std::vector<int> length(size);
  workers.ForBlocks(size, kBlock, [&](Index block, Index begin, Index end) {
    std::vector<int> last_row(size, -1);
    std::vector<int>& found = columns[block];
    for (int row = static_cast<int>(begin); row < end; ++row) {
      const std::size_t first = found.size();
      for (int a = R.start[row]; a < R.start[row + 1]; ++a) {
        const int i = R.column[a];
        for (int b = A.start[i]; b < A.start[i + 1]; ++b) {
          const int k = A.column[b];
          for (int c = P.start[k]; c < P.start[k + 1]; ++c) {
            const int column = P.column[c];
            if (std::exchange(last_row[column], row) != row) found.push_back(column);
          }
        }
      }
      std::sort(found.begin() + first, found.end());
      length[row] = static_cast<int>(found.size() - first);
    }
  });
  CompressedRows<float> pattern{.cols = size};
  for (const int entries : length) pattern.start.push_back(pattern.start.back() + entries);
  for (const std::vector<int>& found : columns) {
    pattern.column.insert(pattern.column.end(), found.begin(), found.end());
  }
  pattern.value.resize(pattern.column.size());
  return pattern;
}

}  // namespace

Multigrid::Multigrid(const CompressedRows<double>& K, Workers& workers)
    : workers_(workers), levels_(1), is_fixed_(K.rows(), 0) {
  levels_[0].A = InSinglePrecision(K);
  AddLevels();
}

void Multigrid::AddLevels() {
  double threshold = kStrong;
  for (;;) {
    Level& fine = levels_.back();
    const Index size = fine.A.rows();
    for (std::vector<float>* vector : {&fine.inverse_diagonal, &fine.b, &fine.x, &fine.work}) vector->resize(size);
    workers_.ForBlocks(size, kRowsOfABlock,
                       [&](Index, Index begin, Index end) { InvertDiagonal(fine, nullptr, begin, end); });
    has_coarsest_ = size <= kCoarsest;
    if (has_coarsest_) return FactorCoarsest();
    // Coarse matrices of flows have such couplings although they have no states and controls.
    const bool without_skew = levels_.size() == 1;
    CompressedRows<float> P = SmoothedAggregation(fine.A, threshold, without_skew);
    threshold /= 2;
    if (P.cols == 0 || double(P.cols) > kWorthwhile * double(size)) return;
    fine.R = Transposed(P);
    fine.P = std::move(P);
    Level coarse;
    coarse.A = CoarsePattern(fine.A, fine.P, fine.R, workers_);
    ComputeRows(fine, std::vector<std::uint8_t>(coarse.A.rows(), 1), coarse);
    levels_.push_back(std::move(coarse));
  }
}

void Multigrid::InvertDiagonal(Level& level, const std::vector<std::uint8_t>* is_fixed, Index begin, Index end) const {
  const CompressedRows<float>& A = level.A;
  for (Index i = begin; i < end; ++i) {
    const Index block = i / kRowsOfABlock;
    float diagonal = 0, outside = 0;
    for (int k = A.start[i]; k < A.start[i + 1]; ++k) {
      const Index j = A.column[k];
      if (j == i) diagonal = A.value[k];
      if (j / kRowsOfABlock != block) outside += std::abs(A.value[k]);
    }
    const bool is_unknown = diagonal != 0 && !(is_fixed && (*is_fixed)[i]);
    level.inverse_diagonal[i] = is_unknown ? 1 / (diagonal + std::copysign(outside, diagonal)) : 0;
  }
}

void Multigrid::ComputeRows(const Level& fine, const std::vector<std::uint8_t>& marks, Level& coarse) const {
  constexpr Index kBlock = 512;
  const CompressedRows<float>&A = fine.A, &P = fine.P, &R = fine.R;
  // Where a fine unknown is fixed or has no entries, its inverse diagonal is zero.
  const std::vector<float>& is_unknown = fine.inverse_diagonal;
  CompressedRows<float>& product = coarse.A;
  workers_.ForBlocks(product.rows(), kBlock, [&](Index, Index begin, Index end) {
    if (std::find(marks.begin() + begin, marks.begin() + end, 1) == marks.begin() + end) return;
    std::vector<double> sums(product.rows(), 0);
    for (Index row = begin; row < end; ++row) {
      if (!marks[row]) continue;
      for (int a = R.start[row]; a < R.start[row + 1]; ++a) {
        const int i = R.column[a];
        if (is_unknown[i] == 0) continue;
        for (int b = A.start[i]; b < A.start[i + 1]; ++b) {
          const int k = A.column[b];
          if (is_unknown[k] == 0) continue;
          const double weight = double(R.value[a]) * double(A.value[b]);
          for (int c = P.start[k]; c < P.start[k + 1]; ++c) sums[P.column[c]] += weight * double(P.value[c]);
        }
      }
      for (int k = product.start[row]; k < product.start[row + 1]; ++k) {
        product.value[k] = static_cast<float>(std::exchange(sums[product.column[k]], 0));
      }
    }
  });
}

void Multigrid::FactorCoarsest() {
  // Coarse functions cut off at fixed unknowns may be dependent, and single precision then makes their matrix
  // indefinite. This keeps it definite, and changes the smallest eigenvalues of a level of this size by a few percent
  // at most.
  constexpr double kRegularization = 1e-5;
  const CompressedRows<float>& A = levels_.back().A;
  Matrix dense = Matrix::Zero(A.rows(), A.rows());
  for (Index i = 0; i < A.rows(); ++i) {
    // Rows and columns of no unknown are zero, but for the rounding of weights that cancel.
    if (levels_.back().inverse_diagonal[i] == 0) {
      dense(i, i) = 1;
      continue;
    }
    for (int k = A.start[i]; k < A.start[i + 1]; ++k) {
      if (levels_.back().inverse_diagonal[A.column[k]] != 0) dense(i, A.column[k]) = A.value[k];
    }
    dense(i, i) *= 1 + kRegularization;
  }
  coarsest_.compute(dense);
}

void Multigrid::Fix(const std::vector<std::uint8_t>& is_fixed) {
  std::vector<int> changed;
  for (std::size_t i = 0; i < is_fixed.size(); ++i) {
    if ((is_fixed[i] != 0) != (is_fixed_[i] != 0)) changed.push_back(static_cast<int>(i));
  }
  if (changed.empty()) return;
  is_fixed_ = is_fixed;
  // The rows of each level whose entries change; on the finest one those whose entries count or do not count.
  const CompressedRows<float>& finest = levels_[0].A;
  std::vector<std::uint8_t> marks(levels_[0].A.rows(), 0);
  for (const int i : changed) {
    InvertDiagonal(levels_[0], &is_fixed_, i, i + 1);
    for (int k = finest.start[i]; k < finest.start[i + 1]; ++k) marks[finest.column[k]] = 1;
  }
  for (std::size_t at = 0; at + 1 < levels_.size(); ++at) {
    const CompressedRows<float>& P = levels_[at].P;
    Level& coarse = levels_[at + 1];
    std::vector<std::uint8_t> coarse_marks(coarse.A.rows(), 0);
    for (Index i = 0; i < P.rows(); ++i) {
      if (!marks[i]) continue;
      for (int k = P.start[i]; k < P.start[i + 1]; ++k) coarse_marks[P.column[k]] = 1;
    }
    ComputeRows(levels_[at], coarse_marks, coarse);
    for (Index row = 0; row < coarse.A.rows(); ++row) {
      if (coarse_marks[row]) InvertDiagonal(coarse, nullptr, row, row + 1);
    }
    marks = std::move(coarse_marks);
  }
  if (has_coarsest_) FactorCoarsest();
}

void Multigrid::SweepForwardFromZero(Level& level) const {
  const CompressedRows<float>& A = level.A;
  const int *const start = A.start.data(), *const column = A.column.data();
  const float *const value = A.value.data(), *const b = level.b.data(), *const inverse = level.inverse_diagonal.data();
  float* const x = level.x.data();
  workers_.ForBlocks(A.rows(), kRowsOfABlock, [&](Index, Index begin, Index end) {
    for (int i = static_cast<int>(begin); i < end; ++i) {
      float sum = b[i];
      // Values of other blocks and of later rows are zero.
      for (int k = start[i]; k < start[i + 1] && column[k] < i; ++k) {
        if (column[k] >= begin) sum -= value[k] * x[column[k]];
      }
      x[i] = inverse[i] * sum;
    }
  });
}

// From `work` to x.
void Multigrid::SweepBackward(Level& level) const {
  const CompressedRows<float>& A = level.A;
  const int *const start = A.start.data(), *const column = A.column.data();
  const float *const value = A.value.data(), *const b = level.b.data(), *const inverse = level.inverse_diagonal.data();
  const float* const before = level.work.data();
  float* const x = level.x.data();
  workers_.ForBlocks(A.rows(), kRowsOfABlock, [&](Index, Index begin, Index end) {
    std::copy(before + begin, before + end, x + begin);
    const auto size = static_cast<unsigned>(end - begin);
    for (int i = static_cast<int>(end) - 1; i >= begin; --i) {
      float sum = b[i];
      for (int k = start[i]; k < start[i + 1]; ++k) {
        const int j = column[k];
        const float* const values = static_cast<unsigned>(j - static_cast<int>(begin)) < size ? x : before;
        sum -= value[k] * values[j];
      }
      x[i] += inverse[i] * sum;
    }
  });
}

void Multigrid::Cycle(std::size_t at) {
  Level& level = levels_[at];
  const bool is_last = at + 1 == levels_.size();
  if (is_last && has_coarsest_) {
    const auto size = static_cast<Index>(level.b.size());
    const Vector solution = coarsest_.solve(Eigen::Map<const Eigen::VectorXf>(level.b.data(), size).cast<double>());
    for (Index i = 0; i < size; ++i) level.x[i] = static_cast<float>(solution[i]);
    return;
  }
  SweepForwardFromZero(level);
  if (is_last) {
    std::copy(level.x.begin(), level.x.end(), level.work.begin());
    return SweepBackward(level);
  }
  const CompressedRows<float>&A = level.A, &P = level.P, &R = level.R;
  Level& coarse = levels_[at + 1];
  workers_.ForBlocks(A.rows(), kRowsOfABlock, [&](Index, Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      float sum = level.b[i];
      for (int k = A.start[i]; k < A.start[i + 1]; ++k) sum -= A.value[k] * level.x[A.column[k]];
      level.work[i] = level.inverse_diagonal[i] == 0 ? 0 : sum;
    }
  });
  workers_.ForBlocks(R.rows(), kRowsOfABlock / 8, [&](Index, Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      float sum = 0;
      for (int k = R.start[i]; k < R.start[i + 1]; ++k) sum += R.value[k] * level.work[R.column[k]];
      coarse.b[i] = coarse.inverse_diagonal[i] == 0 ? 0 : sum;
    }
  });
  Cycle(at + 1);
  workers_.ForBlocks(P.rows(), kRowsOfABlock, [&](Index, Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      float sum = level.x[i];
      if (level.inverse_diagonal[i] != 0) {
        for (int k = P.start[i]; k < P.start[i + 1]; ++k) sum += P.value[k] * coarse.x[P.column[k]];
      }
      level.work[i] = sum;
    }
  });
  SweepBackward(level);
}

void Multigrid::Apply(const Vector& r, double size, Vector& z) {
  if (!(size > 0)) {
    z.setZero();
    return;
  }
  Level& finest = levels_[0];
  workers_.ForBlocks(r.size(), kRowsOfABlock, [&](Index, Index begin, Index end) {
    for (Index i = begin; i < end; ++i) finest.b[i] = static_cast<float>(r[i] / size);
  });
  Cycle(0);
  workers_.ForBlocks(r.size(), kRowsOfABlock, [&](Index, Index begin, Index end) {
    for (Index i = begin; i < end; ++i) z[i] = size * double(finest.x[i]);
  });
}

double Multigrid::complexity() const {
  double entries = 0;
  for (const Level& level : levels_) entries += double(level.A.nonzeros());
  return entries / double(levels_[0].A.nonzeros());
}

}  // namespace dlcs
