// SPDX-License-Identifier: Apache-2.0

#include "core/linalg/balance.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <optional>
#include <utility>

#include "core/linalg/panel_lu.h"
#include "core/linalg/strong_components.h"

namespace dlcs {
namespace {

using Exponents = std::vector<int>;

int ExponentOf(double value) { return std::ilogb(value); }

// 2^{e_j - e_i} a_ij
Matrix Scaled(const Matrix& A, const Exponents& e) {
  Matrix scaled(A.rows(), A.cols());
  for (Index j = 0; j < A.cols(); ++j) {
    for (Index i = 0; i < A.rows(); ++i) scaled(i, j) = std::ldexp(A(i, j), e[j] - e[i]);
  }
  return scaled;
}

// Units in which the entries of a tree that reaches every state from the first have one exponent, the mean along a
// circle of the graph: neither depends on the units in which A is given. A is irreducible.
struct TreeUnits {
  Exponents e;
  int mean;  // the exponent of the entries
};
TreeUnits UnitsFromTree(const Matrix& A) {
  const Index size = A.rows();
  std::vector<Index> reached = {0}, parent(size, -1);
  for (std::size_t next = 0; next < reached.size(); ++next) {
    const Index i = reached[next];
    for (Index j = 1; j < size; ++j) {
      if (j == i || parent[j] >= 0 || A(i, j) == 0) continue;
      parent[j] = i;
      reached.push_back(j);
    }
  }
  Index last = 0;
  for (const Index i : reached) {
    if (i == 0 || A(i, 0) == 0) continue;
    last = i;
    break;
  }
  long sum = ExponentOf(A(last, 0)), length = 1;
  for (Index i = last; i != 0; i = parent[i]) sum += ExponentOf(A(parent[i], i)), ++length;
  const int mean = static_cast<int>(std::floor(static_cast<double>(sum) / static_cast<double>(length)));
  Exponents e(size, 0);
  for (const Index j : reached) {
    if (j != 0) e[j] = e[parent[j]] + mean - ExponentOf(A(parent[j], j));
  }
  return {std::move(e), mean};
}

// The exponents that bring all entries of `A` nearest to 2^mean, in the sum of the squares of their logarithms: exact
// where a symmetric matrix was given in other units. Absent where there are none.
std::optional<Exponents> NearestUnits(const Matrix& A, int mean) {
  const Index size = A.rows();
  // That of the first state is zero.
  Matrix normal = Matrix::Zero(size - 1, size - 1);
  Matrix right = Matrix::Zero(size - 1, 1);
  for (Index j = 0; j < size; ++j) {
    for (Index i = 0; i < size; ++i) {
      if (i == j || A(i, j) == 0) continue;
      const double above = std::log2(std::abs(A(i, j))) - mean;
      if (i > 0) normal(i - 1, i - 1) += 1, right(i - 1) += above;
      if (j > 0) normal(j - 1, j - 1) += 1, right(j - 1) -= above;
      if (i > 0 && j > 0) normal(i - 1, j - 1) -= 1, normal(j - 1, i - 1) -= 1;
    }
  }
  const Matrix nearest = PanelLu(std::move(normal)).Solve(right);
  if (!nearest.allFinite()) return std::nullopt;
  Exponents e(size, 0);
  for (Index i = 1; i < size; ++i) e[i] = static_cast<int>(std::lround(nearest(i - 1)));
  return e;
}

// Halves and doubles the units of single states, in place, while that makes the sum of row and column smaller by 5 % at
// least; adds the exponents to `e`.
void EvenOut(Matrix& A, Exponents& e) {
  constexpr int kMaxSweeps = 200;  // some five are usual
  constexpr double kEnough = 0.95;
  const Index size = A.rows();
  bool changed = true;
  for (int sweep = 0; changed && sweep < kMaxSweeps; ++sweep) {
    changed = false;
    for (Index i = 0; i < size; ++i) {
      double column = A.col(i).cwiseAbs().sum() - std::abs(A(i, i));
      double row = A.row(i).cwiseAbs().sum() - std::abs(A(i, i));
      // The difference above may have lost all digits.
      if (std::abs(A(i, i)) > column || std::abs(A(i, i)) > row) {
        column = row = 0;
        for (Index k = 0; k < size; ++k) {
          if (k != i) column += std::abs(A(k, i)), row += std::abs(A(i, k));
        }
      }
      if (!(column > 0 && row > 0 && std::isfinite(column) && std::isfinite(row))) continue;
      // 2^p column + 2^-p row is least near p = log2(row / column) / 2.
      const int p = static_cast<int>(std::lround((std::log2(row) - std::log2(column)) / 2));
      if (p == 0 || !(std::ldexp(column, p) + std::ldexp(row, -p) < kEnough * (column + row))) continue;
      for (Index k = 0; k < size; ++k) {
        if (k == i) continue;
        A(k, i) = std::ldexp(A(k, i), p);
        A(i, k) = std::ldexp(A(i, k), -p);
      }
      e[i] += p;
      changed = true;
    }
  }
}

// One irreducible block: its states in order, and their exponents in that order.
void BalanceBlock(const Matrix& A, std::vector<Index>& states, Exponents& e) {
  const Index size = static_cast<Index>(states.size());
  const Matrix given = A(states, states);
  const TreeUnits tree = UnitsFromTree(given);
  e = tree.e;
  Matrix block = Scaled(given, e);
  std::optional<Exponents> nearest;
  if (block.allFinite()) {
    nearest = NearestUnits(block, tree.mean);
  } else {
    e.assign(size, 0);
    block = given;
  }
  // Single steps may not lead out of bad units: from two starts, which are the same in any units of `A`.
  Matrix from_nearest = nearest ? Scaled(block, *nearest) : Matrix();
  EvenOut(block, e);
  if (nearest && from_nearest.allFinite()) {
    for (Index i = 0; i < size; ++i) (*nearest)[i] += tree.e[i];
    EvenOut(from_nearest, *nearest);
    if (from_nearest.cwiseAbs().sum() <= block.cwiseAbs().sum()) {
      block = std::move(from_nearest);
      e = *std::move(nearest);
    }
  }
  // Graded from large to small, as the QR algorithm needs it.
  std::vector<Index> order(size);
  std::iota(order.begin(), order.end(), 0);
  std::vector<int> row_exponents(size);
  for (Index i = 0; i < size; ++i) row_exponents[i] = ExponentOf(block.row(i).cwiseAbs().maxCoeff());
  std::stable_sort(order.begin(), order.end(), [&](Index i, Index j) { return row_exponents[i] > row_exponents[j]; });
  const std::vector<Index> old_states = states;
  const Exponents old_exponents = e;
  for (Index k = 0; k < size; ++k) states[k] = old_states[order[k]], e[k] = old_exponents[order[k]];
}

double SumNorm(const Eigen::Ref<const Matrix>& block) { return block.cwiseAbs().colwise().sum().maxCoeff(); }

// The exponent to add to block `b`, so that the largest of its couplings to the blocks before it is as large as the two
// blocks that it couples.
int UnitOfBlock(const Matrix& A, const BalancedMatrix& balanced, const std::vector<double>& norms, const Exponents& e,
                Index b) {
  bool is_coupled = false;
  int largest = 0;
  for (Index before = 0; before < b; ++before) {
    const double norm = std::max(norms[before], norms[b]);
    const int reference = norm > 0 ? ExponentOf(norm) : 0;
    for (Index l = balanced.begins[b]; l < balanced.begins[b + 1]; ++l) {
      for (Index k = balanced.begins[before]; k < balanced.begins[before + 1]; ++k) {
        const double entry = A(balanced.order[k], balanced.order[l]);
        if (entry == 0) continue;
        const int exponent = ExponentOf(entry) + e[l] - e[k] - reference;
        largest = is_coupled ? std::max(largest, exponent) : exponent;
        is_coupled = true;
      }
    }
  }
  return is_coupled ? -largest : 0;
}

}  // namespace

BalancedMatrix Balance(const Matrix& A) {
  const Index m = A.rows();
  BalancedMatrix balanced;
  balanced.begins.push_back(0);
  if (!A.allFinite()) {
    balanced.order.resize(m);
    std::iota(balanced.order.begin(), balanced.order.end(), 0);
    balanced.exponents.assign(m, 0);
    balanced.begins.push_back(m);
    balanced.matrix = A;
    return balanced;
  }
  Exponents& e = balanced.exponents;
  std::vector<double> norms;
  for (std::vector<Index>& states : StronglyConnected(A)) {
    Exponents of_block(states.size(), 0);
    if (states.size() > 1) BalanceBlock(A, states, of_block);
    balanced.order.insert(balanced.order.end(), states.begin(), states.end());
    e.insert(e.end(), of_block.begin(), of_block.end());
    balanced.begins.push_back(static_cast<Index>(balanced.order.size()));
    const Matrix block = A(states, states);
    norms.push_back(SumNorm(states.size() > 1 ? Scaled(block, of_block) : block));
  }
  for (Index b = 1; b < balanced.num_blocks(); ++b) {
    const int unit = UnitOfBlock(A, balanced, norms, e, b);
    for (Index k = balanced.begins[b]; k < balanced.begins[b + 1]; ++k) e[k] += unit;
  }
  // Units outside the range of doubles are of no use.
  constexpr int kLargestExponent = 900;
  if (std::any_of(e.begin(), e.end(), [](int exponent) { return std::abs(exponent) > kLargestExponent; }))
    e.assign(m, 0);
  balanced.matrix = InUnitsOf(balanced, A);
  return balanced;
}

Matrix InUnitsOf(const BalancedMatrix& balanced, const Matrix& given) {
  return Scaled(given(balanced.order, balanced.order), balanced.exponents);
}

Matrix InGivenUnits(const Matrix& matrix, const BalancedMatrix& balanced) {
  const Index m = matrix.rows();
  Matrix given(m, m);
  for (Index l = 0; l < m; ++l) {
    for (Index k = 0; k < m; ++k) {
      given(balanced.order[k], balanced.order[l]) =
          std::ldexp(matrix(k, l), balanced.exponents[k] - balanced.exponents[l]);
    }
  }
  return given;
}

}  // namespace dlcs
