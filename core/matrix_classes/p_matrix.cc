// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/p_matrix.h"

#include <algorithm>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/linalg/bounded_sum.h"
#include "core/matrix_classes/m_matrix.h"
#include "core/matrix_classes/positive_semidefinite.h"
#include "core/matrix_classes/principal_minors.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

std::string Indices(const std::vector<Index>& indices) {
  std::string text = "{";
  for (std::size_t i = 0; i < indices.size(); ++i) absl::StrAppend(&text, i ? ", " : "", indices[i]);
  return text + "}";
}

Fact NotPositive(std::vector<Index> indices, double minor, bool beyond_rounding) {
  std::sort(indices.begin(), indices.end());
  Fact fact{Answer::kNo, absl::StrCat("the principal minor of rows ", Indices(indices), " is ",
                                      beyond_rounding ? "" : "zero to working precision: ", minor)};
  fact.witness.indices = std::move(indices);
  if (beyond_rounding) fact.witness.value = minor;
  return fact;
}

// M is a P-matrix exactly when its first diagonal entry is positive and both the matrix without the first
// row and column and the Schur complement of that entry are P-matrices [Tsatsomeros & Li 2000].
class AllMinors {
 public:
  explicit AllMinors(const Matrix& M) : size_(M.rows()), level_(M.rows() + 1) {
    for (Index s = 0; s < size_; ++s) level_[s] = {Matrix(s, s), Matrix(s, s)};
    level_[size_] = TrackedMatrix::Rounded(M);
  }

  bool Positive() { return Positive(size_, 1.0); }

  Fact witness() const { return NotPositive(eliminated_, minor_, beyond_rounding_); }

 private:
  bool Positive(Index remaining, double minor) {
    if (remaining == 0) return true;
    LookForStop();
    const TrackedMatrix& here = level_[remaining];
    TrackedMatrix& below = level_[remaining - 1];
    const Index first = size_ - remaining;
    eliminated_.push_back(first);
    if (!here.PivotIsPositive()) {
      minor_ = minor * here.value(0, 0);
      beyond_rounding_ = here.value(0, 0) < -here.error(0, 0);
      return false;
    }
    here.EliminateInto(below);
    if (!Positive(remaining - 1, minor * here.value(0, 0))) return false;
    eliminated_.pop_back();
    here.DropInto(below);
    return Positive(remaining - 1, minor);
  }

  const Index size_;
  std::vector<TrackedMatrix> level_;  // level_[s] is s × s
  std::vector<Index> eliminated_;
  double minor_ = 0;
  bool beyond_rounding_ = false;
};

// A nonpositive minor of order one or two, or kUnknown.
Fact SmallMinors(const Matrix& M) {
  for (Index i = 0; i < M.rows(); ++i) {
    if (!(M(i, i) > 0)) {
      Fact fact{Answer::kNo, absl::StrCat("M[", i, "][", i, "] = ", M(i, i), " is not positive")};
      fact.witness.indices = {i};
      fact.witness.value = M(i, i);
      return fact;
    }
  }
  for (Index i = 0; i < M.rows(); ++i) {
    for (Index j = i + 1; j < M.rows(); ++j) {
      const double plus = M(i, i) * M(j, j);
      const double minus = M(i, j) * M(j, i);
      const double rounding = RoundingOf(8) * (plus + std::abs(minus));
      if (plus - minus <= rounding) return NotPositive({i, j}, plus - minus, plus - minus < -rounding);
    }
  }
  return {};
}

// Looks for a nonpositive leading minor of M and of reorderings of it.
Fact LeadingMinors(const Matrix& M) {
  constexpr int kOrders = 8;
  const Index size = M.rows();
  std::vector<Index> order(size);
  std::iota(order.begin(), order.end(), Index{0});
  std::mt19937_64 generator(20130521);  // fixed: the answer must not change from call to call
  for (int attempt = 0; attempt < kOrders; ++attempt) {
    TrackedMatrix tracked = TrackedMatrix::Rounded(M(order, order));
    double minor = 1;
    for (Index p = 0; p < size; ++p) {
      LookForStop();
      if (!tracked.PivotIsPositive()) {
        const double pivot = tracked.value(0, 0);
        return NotPositive({order.begin(), order.begin() + p + 1}, minor * pivot, pivot < -tracked.error(0, 0));
      }
      minor *= tracked.value(0, 0);
      TrackedMatrix schur{Matrix(size - p - 1, size - p - 1), Matrix(size - p - 1, size - p - 1)};
      tracked.EliminateInto(schur);
      tracked = std::move(schur);
    }
    std::shuffle(order.begin(), order.end(), generator);
  }
  return {};
}

}  // namespace

Fact TestPMatrix(const Matrix& M) {
  if (Fact small = SmallMinors(M); small.answer == Answer::kNo) return small;
  const bool z = IsZMatrix(M);
  if (IsNonsingularMMatrix(ComparisonMatrix(M))) {
    return {Answer::kYes, z ? "a Z-matrix with positive pivots (nonsingular M-matrix)"
                            : "an H-matrix with positive diagonal: diagonally dominant after column scaling"};
  }
  if (z && M.rows() > kMaxExactSize) {
    Fact leading = LeadingMinors(M);
    return leading.answer == Answer::kNo ? leading
                                         : Fact{Answer::kNo, "a Z-matrix that is singular to working precision"};
  }
  if (IsSymmetricPartPositiveDefinite(M)) return {Answer::kYes, "its symmetric part is positive definite"};
  if (M.rows() <= kMaxExactSize) {
    AllMinors minors(M);
    if (!minors.Positive()) return minors.witness();
    return {Answer::kYes, "all principal minors are positive"};
  }
  if (Fact leading = LeadingMinors(M); leading.answer == Answer::kNo) return leading;
  return {Answer::kUnknown, absl::StrCat("n = ", M.rows(), " is beyond the exact test (n <= ", kMaxExactSize,
                                         ") and no sufficient or necessary test decides")};
}

}  // namespace dlcs
