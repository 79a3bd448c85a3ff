// SPDX-License-Identifier: Apache-2.0
#include "core/stepping/iterative_step.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

using RowMajor = Eigen::SparseMatrix<double, Eigen::RowMajor>;

// The only entry of an inner vector that is not zero, or none.
struct Single {
  Index count = 0, index = 0;
  double value = 0;
};

template <typename Sparse>
Single SingleEntry(const Sparse& matrix, Index outer) {
  Single single;
  for (typename Sparse::InnerIterator entry(matrix, outer); entry; ++entry) {
    if (entry.value() == 0) continue;
    ++single.count;
    single.index = entry.index();
    single.value = entry.value();
  }
  return single;
}

// The matrices of the pairs by the pairs, and what kind each is; those of scaled states with `scales`.
struct PairMatrices {
  explicit PairMatrices(const Problem& problem, const Vector& scales = {})
      : B(problem.B.Sparse()), N(problem.N.Sparse()), M_rows(problem.M.Sparse()), M(problem.M.Sparse()) {
    if (scales.size() == 0) return;
    B = SparseMatrix(scales.asDiagonal() * B);
    N = RowMajor(N * scales.asDiagonal());
  }

  bool HasZeroRowOfM(Index i) const { return SingleEntry(M_rows, i).count == 0; }
  bool HasZeroColumnOfM(Index i) const { return SingleEntry(M, i).count == 0; }

  SparseMatrix B;
  RowMajor N, M_rows;
  SparseMatrix M;
};

// D_i such that D_i N_ic = -w B_ci for all c, up to rounding; 0 if there is none.
double SymmetricScale(const PairMatrices& matrices, Index i, double weight) {
  constexpr double kRounding = 1e-14;
  RowMajor::InnerIterator of_N(matrices.N, i);
  SparseMatrix::InnerIterator of_B(matrices.B, i);
  double scale = 0;
  for (; of_N && of_B; ++of_N, ++of_B) {
    const double ratio = -weight * of_B.value() / of_N.value();
    if (of_N.index() != of_B.index() || !(ratio > 0)) return 0;
    if (scale == 0) scale = ratio;
    if (std::abs(ratio - scale) > kRounding * scale) return 0;
  }
  return of_N || of_B ? 0 : scale;
}

// Otherwise entries of the same size in row and column.
double BalancedScale(const PairMatrices& matrices, Index i, double weight) {
  const double of_N = matrices.N.row(i).cwiseAbs().sum(), of_B = weight * matrices.B.col(i).cwiseAbs().sum();
  return of_N > 0 && of_B > 0 ? of_B / of_N : 1 / matrices.M.coeff(i, i);
}

double InfinityNormOf(const RowMajor& matrix) {
  double norm = 0;
  for (Index i = 0; i < matrix.rows(); ++i) norm = NanMax(norm, matrix.row(i).cwiseAbs().sum());
  return norm;
}

// (K + Kᵀ)/2 if the two differ by rounding only, else K.
SparseMatrix SymmetricUpToRounding(SparseMatrix K) {
  constexpr double kRounding = 1e-14;
  const SparseMatrix transpose = K.transpose();
  const SparseMatrix difference = K - transpose, sum = K.cwiseAbs() + SparseMatrix(transpose.cwiseAbs());
  for (Index j = 0; j < K.cols(); ++j) {
    SparseMatrix::InnerIterator of_sum(sum, j);
    for (SparseMatrix::InnerIterator entry(difference, j); entry; ++entry, ++of_sum) {
      while (of_sum.index() < entry.index()) ++of_sum;
      if (!(std::abs(entry.value()) <= kRounding * of_sum.value())) return K;
    }
  }
  return (K + transpose) / 2;
}

}  // namespace

std::string IterativeStep::WhyNot(const Problem& problem) {
  if (problem.has_mass() && !(problem.E.Sparse().diagonal().minCoeff() > 0)) {
    return "the diagonal of E is not positive";
  }
  const PairMatrices matrices(problem);
  std::vector<bool> has_bound(static_cast<std::size_t>(problem.num_states()), false);
  for (Index i = 0; i < problem.num_constraints(); ++i) {
    const std::string pair = "pair " + std::to_string(i);
    if (matrices.M.coeff(i, i) > 0) continue;
    if (!matrices.HasZeroRowOfM(i) || !matrices.HasZeroColumnOfM(i)) return "M has no positive diagonal at " + pair;
    const Single of_N = SingleEntry(matrices.N, i), of_B = SingleEntry(matrices.B, i);
    if (of_N.count != 1 || of_B.count != 1 || of_N.index != of_B.index || !(of_N.value * of_B.value > 0)) {
      return "where M is zero, as at " + pair + ", y must act on one state, and N must bound that one";
    }
    if (has_bound[of_N.index]) return "state " + std::to_string(of_N.index) + " has two bounds";
    has_bound[of_N.index] = true;
  }
  return "";
}

double IterativeStep::ToleranceFor(const Options& options, Index steps) {
  constexpr double kMost = 1e-10, kPart = 0.01;
  if (!(options.error_tolerance > 0)) return std::max(options.iteration_tolerance, kLeastTolerance);
  return std::clamp(kPart * options.error_tolerance / static_cast<double>(steps), kLeastTolerance, kMost);
}

IterativeStep::System IterativeStep::Assemble(const StepRule& rule) {
  const Problem& problem = rule.problem();
  System system;
  if (problem.has_mass()) system.scales = problem.E.Sparse().diagonal().cwiseSqrt().cwiseInverse();
  const PairMatrices matrices(problem, system.scales);
  const Index m = problem.num_states(), n = problem.num_constraints();
  Index size = m;
  for (Index i = 0; i < n; ++i) {
    const double weight = rule.weight();
    Pair pair{.is_obstacle = matrices.HasZeroRowOfM(i)};
    if (pair.is_obstacle) {
      const Single of_N = SingleEntry(matrices.N, i);
      pair.unknown = of_N.index;
      pair.coefficient = of_N.value;
      pair.scale = weight * std::abs(SingleEntry(matrices.B, i).value);
    } else {
      pair.unknown = size++;
      pair.scale = SymmetricScale(matrices, i, weight);
      if (pair.scale == 0) pair.scale = BalancedScale(matrices, i, weight);
    }
    system.pairs.push_back(pair);
  }

  RowMajor states = problem.E.Sparse();
  if (!problem.has_mass()) {
    states.resize(m, m);
    states.setIdentity();
  }
  states = states - rule.shift() * RowMajor(problem.A.Sparse());
  if (system.scales.size() > 0) states = RowMajor(system.scales.asDiagonal() * states * system.scales.asDiagonal());
  system.norm_of_states = InfinityNormOf(states);
  const RowMajor B_rows = matrices.B;
  RowMajor K(size, size);
  K.reserve(states.nonZeros() + matrices.B.nonZeros() + matrices.N.nonZeros() + matrices.M.nonZeros());
  for (Index i = 0; i < m; ++i) {
    K.startVec(i);
    for (RowMajor::InnerIterator entry(states, i); entry; ++entry) K.insertBack(i, entry.index()) = entry.value();
    double sum = 0;
    for (RowMajor::InnerIterator entry(B_rows, i); entry; ++entry) {
      const Pair& pair = system.pairs[entry.index()];
      if (pair.is_obstacle) continue;
      K.insertBack(i, pair.unknown) = -rule.weight() * entry.value();
      sum += std::abs(rule.weight() * entry.value());
    }
    system.norm_of_coupling = NanMax(system.norm_of_coupling, sum);
  }
  for (Index i = 0; i < n; ++i) {
    const Pair& pair = system.pairs[i];
    if (pair.is_obstacle) continue;
    K.startVec(pair.unknown);
    double of_states = 0, of_pairs = 0;
    for (RowMajor::InnerIterator entry(matrices.N, i); entry; ++entry) {
      K.insertBack(pair.unknown, entry.index()) = pair.scale * entry.value();
      of_states += std::abs(pair.scale * entry.value());
    }
    for (RowMajor::InnerIterator entry(matrices.M_rows, i); entry; ++entry) {
      if (entry.value() == 0) continue;  // an obstacle may be stored as one
      K.insertBack(pair.unknown, system.pairs[entry.index()].unknown) = pair.scale * entry.value();
      of_pairs += std::abs(pair.scale * entry.value());
    }
    system.norm_of_pair_states = NanMax(system.norm_of_pair_states, of_states);
    system.norm_of_pairs = NanMax(system.norm_of_pairs, of_pairs);
  }
  K.finalize();
  system.K = SymmetricUpToRounding(K);
  return system;
}

namespace {

std::unique_ptr<BoundedSolver> SolverOf(const IterativeStep::System& system, Workers& workers) {
  std::vector<BoundedUnknown> bounded;
  for (const IterativeStep::Pair& pair : system.pairs) bounded.push_back(pair.bound());
  return std::make_unique<BoundedSolver>(system.K, std::move(bounded), workers);
}

}  // namespace

IterativeStep::IterativeStep(const Problem& problem, double step, SparseRule rule, double theta, Workers& workers,
                             double tolerance)
    : rule_(problem, step, rule, theta),
      tolerance_(tolerance),
      system_(Assemble(rule_)),
      solver_(SolverOf(system_, workers)),
      team_(Team::Alone()) {
  system_.K = SparseMatrix();
  PrepareRightHandSides();
}

IterativeStep::IterativeStep(const StepRule& rule, System system, std::unique_ptr<BoundedSolver> solver, Team& team,
                             double tolerance)
    : rule_(rule), tolerance_(tolerance), system_(std::move(system)), solver_(std::move(solver)), team_(team) {
  PrepareRightHandSides();
}

void IterativeStep::PrepareRightHandSides() {
  Index unknowns = rule_.problem().num_states();
  for (const Pair& pair : system_.pairs) unknowns += !pair.is_obstacle;
  right_.resize(unknowns);
  bounds_.setZero(static_cast<Index>(system_.pairs.size()));
}

IterativeStep::State IterativeStep::StateOf(const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y,
                                            const Eigen::Ref<const Vector>& g) const {
  const Problem& problem = rule_.problem();
  const Vector w = problem.N * x + problem.M * y + g;
  State state{.z = Vector(right_.size()), .multipliers = Vector(y.size())};
  state.z.head(x.size()) = x;
  if (system_.scales.size() > 0) state.z.head(x.size()).array() /= system_.scales.array();
  for (Index i = 0; i < y.size(); ++i) {
    const Pair& pair = system_.pairs[i];
    if (!pair.is_obstacle) state.z[pair.unknown] = y[i];
    state.multipliers[i] = pair.scale * std::max(pair.is_obstacle ? y[i] : w[i], 0.0);
  }
  return state;
}

LcpStatus IterativeStep::Solve(const Vector& right, const Eigen::Ref<const Vector>& g, State& state) {
  constexpr double kRounding = 4 * std::numeric_limits<double>::epsilon();
  const Index m = rule_.problem().num_states();
  right_.head(m) = right;
  if (system_.scales.size() > 0) right_.head(m).array() *= system_.scales.array();
  double size_of_g = 0;
  for (Index i = 0; i < g.size(); ++i) {
    const Pair& pair = system_.pairs[i];
    if (pair.is_obstacle) {
      bounds_[i] = -g[i] / pair.coefficient;
    } else {
      right_[pair.unknown] = -pair.scale * g[i];
      size_of_g = NanMax(size_of_g, std::abs(pair.scale * g[i]));
    }
  }
  const double size_of_x = team_.Max(NanMax(MaxAbs(right_.head(m)), MaxAbs(state.z.head(m))));
  const double size_of_y = team_.Max(MaxAbs(state.z.tail(state.z.size() - m)));
  size_of_g = team_.Max(size_of_g);
  const double of_states = system_.norm_of_states * size_of_x + system_.norm_of_coupling * size_of_y;
  const double of_pairs = system_.norm_of_pair_states * size_of_x + system_.norm_of_pairs * size_of_y + size_of_g;
  constexpr double kLeast = std::numeric_limits<double>::min();  // a tolerance of zero could not be divided by
  const ResidualScale tolerance{.split = m,
                                .first = NanMax(tolerance_ * size_of_x + kRounding * of_states, kLeast),
                                .second = NanMax(tolerance_ * of_pairs, kLeast)};
  return solver_->Solve(right_, bounds_, tolerance, state.z, state.multipliers);
}

Vector IterativeStep::StatesOf(const State& state) const {
  Vector x = state.z.head(rule_.problem().num_states());
  if (system_.scales.size() > 0) x.array() *= system_.scales.array();
  return x;
}

Vector IterativeStep::PairsOf(const State& state) const {
  Vector y(static_cast<Index>(system_.pairs.size()));
  for (Index i = 0; i < y.size(); ++i) {
    const Pair& pair = system_.pairs[i];
    y[i] = pair.is_obstacle ? state.multipliers[i] / pair.scale : state.z[pair.unknown];
  }
  return y;
}

}  // namespace dlcs
