// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/principal_minors.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

__extension__ using Integer = __int128;

// M_ij = 2^(r_i + c_j) · integers, where Bareiss' products of two minors fit into 127 bits.
struct ShortEntries {
  std::vector<Integer> entry;  // column by column
  int exponent = 0;            // Σ r + Σ c
};

// The exponent of the last bit of a number that is not zero.
int LastBit(double value) {
  constexpr int kMantissaBits = 53;
  int exponent = 0;
  const auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(value, &exponent), kMantissaBits));
  return exponent - kMantissaBits + std::countr_zero(static_cast<std::uint64_t>(mantissa));
}

// The least exponent of the last bits of a vector, 0 where all is zero.
template <typename Entries>
int LastBitOf(const Entries& entries) {
  std::optional<int> least;
  for (const double value : entries) {
    if (value != 0) least = least ? std::min(*least, LastBit(value)) : LastBit(value);
  }
  return least.value_or(0);
}

std::optional<ShortEntries> AsShortEntries(Matrix M) {
  ShortEntries result{.entry = {}, .exponent = 0};
  for (Index i = 0; i < M.rows(); ++i) {
    const int shift = LastBitOf(M.row(i));
    for (double& value : M.row(i)) value = std::ldexp(value, -shift);
    result.exponent += shift;
  }
  double hadamard = 0;  // log2 of the bound
  for (Index j = 0; j < M.cols(); ++j) {
    const int shift = LastBitOf(M.col(j));
    for (double& value : M.col(j)) value = std::ldexp(value, -shift);
    result.exponent += shift;
    const double norm = M.col(j).norm();
    if (norm > 0) hadamard += std::max(0.0, std::log2(norm));
  }
  if (!(hadamard < 62) || !(M.cwiseAbs().maxCoeff() < 0x1p62)) return std::nullopt;
  for (const double value : M.reshaped()) result.entry.push_back(static_cast<std::int64_t>(value));
  return result;
}

Integer BareissDeterminant(std::vector<Integer> a, Index n) {
  const auto at = [&](Index i, Index j) -> Integer& { return a[static_cast<std::size_t>(j * n + i)]; };
  Integer previous = 1;
  int sign = 1;
  for (Index k = 0; k + 1 < n; ++k) {
    Index row = k;
    while (row < n && at(row, k) == 0) ++row;
    if (row == n) return 0;
    if (row != k) {
      for (Index j = k; j < n; ++j) std::swap(at(row, j), at(k, j));
      sign = -sign;
    }
    for (Index i = k + 1; i < n; ++i) {
      for (Index j = k + 1; j < n; ++j) at(i, j) = (at(i, j) * at(k, k) - at(i, k) * at(k, j)) / previous;
    }
    previous = at(k, k);
  }
  return sign * at(n - 1, n - 1);
}

int SignOf(double value) { return (value > 0) - (value < 0); }

// Moves the largest entry to the front and returns the sign of the exchange.
int PivotCompletely(TrackedMatrix& a) {
  Index row = 0, col = 0;
  a.value.cwiseAbs().maxCoeff(&row, &col);
  for (Matrix* part : {&a.value, &a.error}) {
    part->row(0).swap(part->row(row));
    part->col(0).swap(part->col(col));
  }
  return (row == 0) == (col == 0) ? 1 : -1;
}

PrincipalMinor DeterminantByElimination(const Matrix& M) {
  PrincipalMinor minor{.subset = 0, .order = M.rows(), .value = 1, .sign = 1};
  TrackedMatrix a = TrackedMatrix::Exactly(M);
  for (Index remaining = M.rows(); remaining > 0; --remaining) {
    const int exchange = PivotCompletely(a);
    const double pivot = exchange * a.value(0, 0);
    minor.value *= pivot;
    const bool last = remaining == 1;
    const bool clear = last ? std::abs(pivot) > a.error(0, 0) : a.PivotIsClear();
    if (pivot == 0 && a.error.maxCoeff() == 0) {
      minor.value = 0;
      minor.sign = 0;
      return minor;
    }
    if (!clear) {
      minor.sign.reset();
      if (last) return minor;
      if (pivot == 0) return minor;
    }
    if (minor.sign) *minor.sign *= SignOf(pivot);
    TrackedMatrix schur{Matrix(remaining - 1, remaining - 1), Matrix(remaining - 1, remaining - 1)};
    a.EliminateInto(schur);
    a = std::move(schur);
  }
  return minor;
}

// The recursion of [Tsatsomeros & Li 2000]: the minors with the first of the remaining indices are those of
// the Schur complement of its pivot, times that pivot; the minors without it are those of the rest.
class MinorVisitor {
 public:
  MinorVisitor(const Matrix& M, const std::function<bool(const PrincipalMinor&)>& visit)
      : M_(M), visit_(visit), size_(M.rows()), level_(static_cast<std::size_t>(M.rows()) + 1) {
    for (Index s = 0; s < size_; ++s) At(s) = {Matrix(s, s), Matrix(s, s)};
    At(size_) = TrackedMatrix::Exactly(M);
  }

  bool Visit() { return Visit(size_, {.subset = 0, .order = 0, .value = 1, .sign = 1}); }

 private:
  TrackedMatrix& At(Index s) { return level_[static_cast<std::size_t>(s)]; }

  bool Visit(Index remaining, const PrincipalMinor& eliminated) {
    if (remaining == 0) return true;
    LookForStop();
    const TrackedMatrix& here = At(remaining);
    TrackedMatrix& below = At(remaining - 1);
    const Index first = size_ - remaining;
    const std::uint32_t subset = eliminated.subset | 1u << first;
    if (here.PivotIsClear()) {
      const double pivot = here.value(0, 0);
      const PrincipalMinor minor{.subset = subset,
                                 .order = eliminated.order + 1,
                                 .value = eliminated.value * pivot,
                                 .sign = *eliminated.sign * SignOf(pivot)};
      if (!visit_(minor)) return false;
      here.EliminateInto(below);
      if (!Visit(remaining - 1, minor)) return false;
    } else if (!VisitOneByOne(subset, first + 1)) {
      return false;
    }
    here.DropInto(below);
    return Visit(remaining - 1, eliminated);
  }

  // All minors of `subset` and any of the indices from `next` on.
  bool VisitOneByOne(std::uint32_t subset, Index next) {
    for (std::uint32_t more = 0; more < 1u << (size_ - next); ++more) {
      LookForStop();
      const std::vector<Index> indices = IndicesOf(subset | more << next);
      PrincipalMinor minor = Determinant(M_(indices, indices));
      minor.subset = subset | more << next;
      if (!visit_(minor)) return false;
    }
    return true;
  }

  const Matrix& M_;
  const std::function<bool(const PrincipalMinor&)>& visit_;
  const Index size_;
  std::vector<TrackedMatrix> level_;  // level_[s] is s × s
};

}  // namespace

std::vector<Index> IndicesOf(std::uint32_t subset) {
  std::vector<Index> indices;
  for (; subset != 0; subset &= subset - 1) indices.push_back(std::countr_zero(subset));
  return indices;
}

std::optional<double> ExactDeterminant(const Matrix& M) {
  const auto entries = AsShortEntries(M);
  if (!entries) return std::nullopt;
  const Integer integer = BareissDeterminant(entries->entry, M.rows());
  const auto rounded = static_cast<double>(integer);
  if (static_cast<Integer>(rounded) != integer) return std::nullopt;
  return std::ldexp(rounded, entries->exponent);
}

PrincipalMinor Determinant(const Matrix& M) {
  PrincipalMinor minor = DeterminantByElimination(M);
  if (minor.sign) return minor;
  if (const auto entries = AsShortEntries(M)) {
    const auto exact = static_cast<double>(BareissDeterminant(entries->entry, M.rows()));
    minor.value = std::ldexp(exact, entries->exponent);
    minor.sign = SignOf(exact);
  }
  return minor;
}

void VisitPrincipalMinors(const Matrix& M, const std::function<bool(const PrincipalMinor&)>& visit) {
  MinorVisitor(M, visit).Visit();
}

}  // namespace dlcs
