// SPDX-License-Identifier: Apache-2.0
#include "core/stepping/iterative_step.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"
#include "core/stepping/distributed_steps.h"

namespace dlcs {

std::string IterativeStep::WhyNot(const Problem& problem) {
  if (DistributedSteps* const distributed = Team::Current().distributed_steps()) return distributed->WhyNot(problem);
  if (problem.has_mass() && !(problem.E.Sparse().diagonal().minCoeff() > 0)) return kNoPositiveMass;
  return FindUnserved(AllPairs(problem), problem.num_states()).Text();
}

double IterativeStep::ToleranceFor(const Options& options, Index steps) {
  // No tolerance is so large that a step is not one of the rule: it may take 1e-10 of its size. An iteration gains
  // about a digit with multigrid, so that four times as much saves one at most.
  constexpr double kMost = 1e-10;
  constexpr double kPart = 0.01;  // of the tolerance, for all steps
  if (!(options.error_tolerance > 0)) return std::max(options.iteration_tolerance, kLeastTolerance);
  return std::clamp(kPart * options.error_tolerance / static_cast<double>(steps), kLeastTolerance, kMost);
}

namespace {

std::unique_ptr<BoundedSolver> SolverOf(const IterativeSystem& system, Workers& workers) {
  std::vector<BoundedUnknown> bounded;
  for (const IterativeSystem::Pair& pair : system.pairs) bounded.push_back(pair.bound());
  return std::make_unique<BoundedSolver>(SparseMatrix(system.K), std::move(bounded), workers);
}

}  // namespace

IterativeStep::IterativeStep(const Problem& problem, double step, SparseRule rule, double theta, Workers& workers,
                             double tolerance)
    : rule_(problem, step, rule, theta),
      tolerance_(tolerance),
      system_(AssembleAll(rule_)),
      solver_(SolverOf(system_, workers)),
      team_(Team::Alone()) {
  system_.K = RowMajorMatrix();
  Prepare();
}

IterativeStep::IterativeStep(const StepRule& rule, IterativeSystem system, std::unique_ptr<BoundedSolver> solver,
                             Team& team, double tolerance)
    : rule_(rule), tolerance_(tolerance), system_(std::move(system)), solver_(std::move(solver)), team_(team) {
  Prepare();
}

void IterativeStep::Prepare() {
  Index unknowns = rule_.problem().num_states();
  for (const IterativeSystem::Pair& pair : system_.pairs) unknowns += !pair.is_obstacle;
  right_.resize(unknowns);
  bounds_.setZero(static_cast<Index>(system_.pairs.size()));
  if (!team_.is_alone()) return;
  const Problem& problem = rule_.problem();
  sizes_of_N_ = problem.N.AbsTimes(Vector::Ones(problem.num_states()));
  sizes_of_M_ = problem.M.AbsTimes(Vector::Ones(problem.num_constraints()));
}

IterativeStep::State IterativeStep::StateOf(const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y,
                                            const Eigen::Ref<const Vector>& g) const {
  const Problem& problem = rule_.problem();
  const Vector w = problem.N * x + problem.M * y + g;
  State state{.z = Vector(right_.size()), .multipliers = Vector(y.size())};
  state.z.head(x.size()) = x;
  if (system_.scales.size() > 0) state.z.head(x.size()).array() /= system_.scales.array();
  for (Index i = 0; i < y.size(); ++i) {
    const IterativeSystem::Pair& pair = system_.pairs[i];
    if (!pair.is_obstacle) state.z[pair.unknown] = y[i];
    state.multipliers[i] = pair.scale * std::max(pair.is_obstacle ? y[i] : w[i], 0.0);
  }
  return state;
}

LcpStatus IterativeStep::Solve(const Vector& right, const Eigen::Ref<const Vector>& g, State& state) {
  const Index m = rule_.problem().num_states();
  right_.head(m) = right;
  if (system_.scales.size() > 0) right_.head(m).array() *= system_.scales.array();
  double size_of_g = 0;
  for (Index i = 0; i < g.size(); ++i) {
    const IterativeSystem::Pair& pair = system_.pairs[i];
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
  const double least = std::numeric_limits<double>::min();  // a tolerance of zero could not be divided by
  const ResidualScale tolerance{.split = m,
                                .first = NanMax(tolerance_ * size_of_x + RoundingOf(8) * of_states, least),
                                .second = NanMax(tolerance_ * of_pairs, least)};
  const LcpStatus verdict = solver_->Solve(right_, bounds_, tolerance, state.z, state.multipliers);
  return verdict == LcpStatus::kSolved && !HoldsInEachPair(state, g) ? LcpStatus::kPivotLimit : verdict;
}

bool IterativeStep::HoldsInEachPair(const State& state, const Eigen::Ref<const Vector>& g) const {
  // Terms of rows on a grid differ by some hundreds. A pair that the solver does not see is wrong by as much as its own
  // terms, many digits more.
  constexpr double kGross = 1e3;
  if (!team_.is_alone()) return true;
  const Problem& problem = rule_.problem();
  const Vector x = StatesOf(state), y = PairsOf(state);
  const Vector w = problem.N * x + problem.M * y + g;
  const Vector terms = sizes_of_N_ * MaxAbs(x) + sizes_of_M_ * MaxAbs(y) + g.cwiseAbs();
  for (Index i = 0; i < w.size(); ++i) {
    const double wrong = y[i] > 0 ? std::abs(w[i]) : -w[i];
    if (!system_.pairs[i].is_obstacle && wrong > kGross * tolerance_ * terms[i]) return false;
  }
  return true;
}

Vector IterativeStep::StatesOf(const State& state) const {
  Vector x = state.z.head(rule_.problem().num_states());
  if (system_.scales.size() > 0) x.array() *= system_.scales.array();
  return x;
}

Vector IterativeStep::PairsOf(const State& state) const {
  Vector y(static_cast<Index>(system_.pairs.size()));
  for (Index i = 0; i < y.size(); ++i) {
    const IterativeSystem::Pair& pair = system_.pairs[i];
    y[i] = pair.is_obstacle ? state.multipliers[i] / pair.scale : state.z[pair.unknown];
  }
  return y;
}

}  // namespace dlcs
