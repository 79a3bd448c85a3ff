// SPDX-License-Identifier: Apache-2.0
#include "core/stepping/iterative_system.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_set>
#include <utility>

#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// The only entry of a row that is not zero, or none.
struct Single {
  Index count = 0, column = 0;
  double value = 0;
};

Single SingleEntry(const RowMajorMatrix& matrix, Index row) {
  Single single;
  for (RowMajorMatrix::InnerIterator entry(matrix, row); entry; ++entry) {
    if (entry.value() == 0) continue;
    ++single.count;
    single.column = entry.col();
    single.value = entry.value();
  }
  return single;
}

double DiagonalOfM(const RowsOfPairs& rows, Index i) {
  return rows.M.coeff(i, rows.numbers[static_cast<std::size_t>(i)]);
}

// Of entries that were rounded on different ways.
constexpr Index kOperationsOfEntries = 64;

// D_i such that D_i N_ic = -w B_ci for all c, up to rounding; 0 if there is none.
double SymmetricScale(const RowsOfPairs& rows, Index i, double weight) {
  RowMajorMatrix::InnerIterator of_N(rows.N, i), of_B(rows.columns_of_B, i);
  double scale = 0;
  for (; of_N && of_B; ++of_N, ++of_B) {
    const double ratio = -weight * of_B.value() / of_N.value();
    if (of_N.index() != of_B.index() || !(ratio > 0)) return 0;
    if (scale == 0) scale = ratio;
    if (std::abs(ratio - scale) > RoundingOf(kOperationsOfEntries) * scale) return 0;
  }
  return of_N || of_B ? 0 : scale;
}

// Otherwise entries of the same size in row and column.
double BalancedScale(const RowsOfPairs& rows, Index i, double weight) {
  const double of_N = rows.N.row(i).cwiseAbs().sum(), of_B = weight * rows.columns_of_B.row(i).cwiseAbs().sum();
  return of_N > 0 && of_B > 0 ? of_B / of_N : 1 / DiagonalOfM(rows, i);
}

std::vector<Index> Consecutive(Index count) {
  std::vector<Index> numbers(static_cast<std::size_t>(count));
  std::iota(numbers.begin(), numbers.end(), Index{0});
  return numbers;
}

// Calls entry(c, e_c - s a_c) for each column of a row of E - sA; without E, of I - sA.
template <typename Entry>
void ForRowOfStates(const RowsOfStates& states, Index i, double shift, const Entry& entry) {
  constexpr Index kEnd = std::numeric_limits<Index>::max();
  const bool has_mass = states.E.rows() > 0;
  const Index diagonal = states.numbers[static_cast<std::size_t>(i)];
  RowMajorMatrix::InnerIterator of_A(states.A, i), of_E(has_mass ? states.E : states.A, i);
  bool is_before_diagonal = true;
  for (;;) {
    const Index in_A = of_A ? of_A.col() : kEnd;
    const Index in_E = has_mass ? (of_E ? of_E.col() : kEnd) : (is_before_diagonal ? diagonal : kEnd);
    const Index column = std::min(in_A, in_E);
    if (column == kEnd) return;
    double value = 0;
    if (column == in_E) {
      value = has_mass ? of_E.value() : 1;
      if (has_mass) ++of_E;
      is_before_diagonal = false;
    }
    if (column == in_A) {
      value -= shift * of_A.value();
      ++of_A;
    }
    entry(column, value);
  }
}

}  // namespace

bool RowsOfPairs::IsObstacle(Index i) const { return SingleEntry(M, i).count == 0; }

RowsOfPairs AllPairs(const Problem& problem) {
  const SparseMatrix M = problem.M.Sparse();
  return {.N = problem.N.Sparse(),
          .M = M,
          .columns_of_B = RowMajorMatrix(problem.B.Sparse().transpose()),
          .columns_of_M = RowMajorMatrix(M.transpose()),
          .numbers = Consecutive(problem.num_constraints())};
}

RowsOfStates AllStates(const Problem& problem) {
  return {.A = problem.A.Sparse(),
          .B = problem.B.Sparse(),
          .E = problem.E.Sparse(),
          .numbers = Consecutive(problem.num_states())};
}

std::string UnservedPair::Text() const {
  const std::string at = "pair " + std::to_string(pair);
  switch (rule) {
    case Rule::kNone:
      return "";
    case Rule::kNoDiagonal:
      return "M has no positive diagonal at " + at;
    case Rule::kNoSingleState:
      return "where M is zero, as at " + at + ", y must act on one state, and N must bound that one";
    case Rule::kTwoBounds:
      break;
  }
  return "state " + std::to_string(state) + " has two bounds";
}

UnservedPair FindUnserved(const RowsOfPairs& rows, Index states) {
  using Rule = UnservedPair::Rule;
  std::unordered_set<Index> bounded;
  bounded.reserve(static_cast<std::size_t>(std::min(rows.count(), states)));
  for (Index i = 0; i < rows.count(); ++i) {
    const Index pair = rows.numbers[static_cast<std::size_t>(i)];
    if (DiagonalOfM(rows, i) > 0) continue;
    if (!rows.IsObstacle(i) || SingleEntry(rows.columns_of_M, i).count > 0) return {Rule::kNoDiagonal, pair};
    const Single of_N = SingleEntry(rows.N, i), of_B = SingleEntry(rows.columns_of_B, i);
    if (of_N.count != 1 || of_B.count != 1 || of_N.column != of_B.column || !(of_N.value * of_B.value > 0)) {
      return {Rule::kNoSingleState, pair};
    }
    if (!bounded.insert(of_N.column).second) return {Rule::kTwoBounds, pair, of_N.column};
  }
  return {};
}

IterativeSystem AssembleRows(const StepRule& rule, const RowsOfStates& states, RowsOfPairs pairs, const Vector& scales,
                             const UnknownNumbers& numbers) {
  const double weight = rule.weight();
  const bool has_scales = scales.size() > 0;
  const auto scale_of = [&](Index state) { return has_scales ? scales[state] : 1.0; };
  IterativeSystem system;
  if (has_scales) {
    system.scales = scales(states.numbers);
    pairs.N = RowMajorMatrix(pairs.N * scales.asDiagonal());
    pairs.columns_of_B = RowMajorMatrix(pairs.columns_of_B * scales.asDiagonal());
  }
  Index unknowns_y = 0;
  for (Index i = 0; i < pairs.count(); ++i) {
    IterativeSystem::Pair pair{.is_obstacle = pairs.IsObstacle(i)};
    if (pair.is_obstacle) {
      const Single of_N = SingleEntry(pairs.N, i);
      pair.unknown = numbers.of_state(of_N.column);
      pair.coefficient = of_N.value;
      pair.scale = weight * std::abs(SingleEntry(pairs.columns_of_B, i).value);
    } else {
      ++unknowns_y;
      pair.unknown = numbers.of_pair(pairs.numbers[static_cast<std::size_t>(i)]);
      pair.scale = SymmetricScale(pairs, i, weight);
      if (pair.scale == 0) pair.scale = BalancedScale(pairs, i, weight);
    }
    system.pairs.push_back(pair);
  }

  const auto m = static_cast<Index>(states.numbers.size());
  RowWriter K(
      m + unknowns_y, numbers.count,
      m + states.A.nonZeros() + states.E.nonZeros() + states.B.nonZeros() + pairs.N.nonZeros() + pairs.M.nonZeros());
  for (Index i = 0; i < m; ++i) {
    const double scale = scale_of(states.numbers[static_cast<std::size_t>(i)]);
    double of_states = 0, of_pairs = 0;
    ForRowOfStates(states, i, rule.shift(), [&](Index column, double value) {
      if (has_scales) value = scale * value * scale_of(column);
      K.Add(numbers.of_state(column), value);
      of_states += std::abs(value);
    });
    for (RowMajorMatrix::InnerIterator entry(states.B, i); entry; ++entry) {
      const Index unknown = numbers.of_pair(entry.col());
      if (unknown < 0) continue;
      const double value = -weight * (scale * entry.value());
      K.Add(unknown, value);
      of_pairs += std::abs(value);
    }
    K.EndRow();
    system.norm_of_states = NanMax(system.norm_of_states, of_states);
    system.norm_of_coupling = NanMax(system.norm_of_coupling, of_pairs);
  }
  for (Index i = 0; i < pairs.count(); ++i) {
    const IterativeSystem::Pair& pair = system.pairs[static_cast<std::size_t>(i)];
    if (pair.is_obstacle) continue;
    double of_states = 0, of_pairs = 0;
    for (RowMajorMatrix::InnerIterator entry(pairs.N, i); entry; ++entry) {
      K.Add(numbers.of_state(entry.col()), pair.scale * entry.value());
      of_states += std::abs(pair.scale * entry.value());
    }
    for (RowMajorMatrix::InnerIterator entry(pairs.M, i); entry; ++entry) {
      if (entry.value() == 0) continue;  // an obstacle may be stored as one
      K.Add(numbers.of_pair(entry.col()), pair.scale * entry.value());
      of_pairs += std::abs(pair.scale * entry.value());
    }
    K.EndRow();
    system.norm_of_pair_states = NanMax(system.norm_of_pair_states, of_states);
    system.norm_of_pairs = NanMax(system.norm_of_pairs, of_pairs);
  }
  K.Finish().swap(system.K);
  return system;
}

bool DifferByRounding(const RowMajorMatrix& K, const RowMajorMatrix& transpose) {
  for (Index i = 0; i < K.rows(); ++i) {
    RowMajorMatrix::InnerIterator a(K, i), b(transpose, i);
    while (a || b) {
      const bool has_a = a && (!b || a.col() <= b.col()), has_b = b && (!a || b.col() <= a.col());
      const double of_a = has_a ? a.value() : 0, of_b = has_b ? b.value() : 0;
      if (!(std::abs(of_a - of_b) <= RoundingOf(kOperationsOfEntries) * (std::abs(of_a) + std::abs(of_b))))
        return false;
      if (has_a) ++a;
      if (has_b) ++b;
    }
  }
  return true;
}

IterativeSystem AssembleAll(const StepRule& rule) {
  const Problem& problem = rule.problem();
  RowsOfPairs pairs = AllPairs(problem);
  const Index m = problem.num_states();
  std::vector<Index> unknowns;  // of pairs
  Index count = m;
  for (Index i = 0; i < pairs.count(); ++i) unknowns.push_back(pairs.IsObstacle(i) ? -1 : count++);
  Vector scales;
  if (problem.has_mass()) scales = problem.E.Sparse().diagonal().cwiseSqrt().cwiseInverse();
  IterativeSystem system =
      AssembleRows(rule, AllStates(problem), std::move(pairs), scales,
                   {.count = count,
                    .of_state = [](Index state) { return state; },
                    .of_pair = [&](Index pair) { return unknowns[static_cast<std::size_t>(pair)]; }});
  const RowMajorMatrix transpose = system.K.transpose();
  if (DifferByRounding(system.K, transpose)) system.K = (system.K + transpose) / 2;
  return system;
}

}  // namespace dlcs
