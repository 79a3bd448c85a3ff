// SPDX-License-Identifier: Apache-2.0
// Equivalent forms of a system have the same verdict and the same answer. Needs no reference, since the engine is
// compared with itself.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/problem/verdict.h"
#include "tests/hostile/generator.h"
#include "tests/hostile/transforms.h"
#include "tests/hostile/trial.h"

namespace dlcs::hostile {
namespace {

constexpr double kSameBits = 1e-13;  // of the size of each component: powers of two change no bit but for underflow

struct Answer {
  Verdict verdict;
  Matrix x;  // at ComparisonTimes()
};

Answer Solved(const System& system, double tolerance) {
  Options options;
  options.error_tolerance = tolerance;
  options.output_times = ComparisonTimes(system);
  options.output_times_only = true;
  options.num_threads = 1;
  const absl::StatusOr<Solution> solution = SolveFor(system, options, 3);
  EXPECT_TRUE(solution.ok()) << solution.status();
  if (!solution.ok()) return {};
  Answer answer{JudgeSolution(*solution), {}};
  answer.x = Matrix::Zero(system.num_states(), static_cast<Index>(options.output_times.size()));
  for (size_t k = 0; k < options.output_times.size(); ++k) {
    const auto found = std::find(solution->times.begin(), solution->times.end(), options.output_times[k]);
    if (found != solution->times.end()) {
      answer.x.col(static_cast<Index>(k)) = solution->x.col(found - solution->times.begin());
    }
  }
  return answer;
}

// Largest difference of the first rows, relative to the size of each in `first`.
double Difference(const Matrix& first, const Matrix& second) {
  double worst = 0;
  for (Index i = 0; i < first.rows(); ++i) {
    const double difference = (first.row(i) - second.row(i)).lpNorm<Eigen::Infinity>();
    if (difference > 0) worst = std::max(worst, difference / first.row(i).lpNorm<Eigen::Infinity>());
  }
  return worst;
}

// With the first of its concerns.
std::string TextOf(const Verdict& verdict) {
  return verdict.concerns.empty() ? verdict.text : verdict.text + " (" + verdict.concerns.front() + ")";
}

// Systems of several classes with one solution each, as the generator draws them.
std::vector<System> SomeSystems() {
  std::vector<System> systems;
  for (const uint64_t seed : {600002, 600008, 600012, 600013, 600016, 600019, 600020, 600022, 600027}) {
    systems.push_back(MakeSystem(seed));
  }
  return systems;
}

class Metamorphic : public ::testing::TestWithParam<double> {
 protected:
  double tolerance() const { return GetParam(); }
  double asked() const { return Asked{.tolerance = tolerance()}.error(); }

  // `changed` is an equivalent form of `system`: its first states, divided by `units`, are those of `system`.
  void ExpectSame(const System& system, const System& changed, const Eigen::VectorXd& units, double allowed,
                  const std::string& what) {
    const Answer first = Solved(system, tolerance()), second = Solved(changed, tolerance());
    EXPECT_EQ(VerdictName(first.verdict.kind), std::string(VerdictName(second.verdict.kind)))
        << "seed " << system.seed << ", " << what << ": " << TextOf(first.verdict) << " / " << TextOf(second.verdict);
    if (first.verdict.kind != VerdictKind::kSolved || second.verdict.kind != VerdictKind::kSolved) return;
    const Matrix x = units.cwiseInverse().asDiagonal() * second.x.topRows(units.size());
    EXPECT_LE(Difference(first.x, x), allowed) << "seed " << system.seed << ", " << what << ", " << system.traits;
  }
};

TEST_P(Metamorphic, UnitsOfStatesByPowersOfTwo) {
  Random random(1);
  for (const System& system : SomeSystems()) {
    UnitChange units = NoUnitChange(system);
    units.states = RandomUnits(random, system.num_states(), 6, true);
    ExpectSame(system, Rescaled(system, units), units.states, kSameBits, "states rescaled");
  }
}

TEST_P(Metamorphic, UnitsOfPairsByPowersOfTwo) {
  Random random(2);
  for (const System& system : SomeSystems()) {
    UnitChange units = NoUnitChange(system);
    units.w = RandomUnits(random, system.num_pairs(), 6, true);
    // Where M is a P- or Z-matrix y and w have units of their own; else y_i w_i keeps one.
    units.y = system.rank_matters && !system.least_element ? Eigen::VectorXd(units.w.cwiseInverse())
                                                           : RandomUnits(random, system.num_pairs(), 6, true);
    ExpectSame(system, Rescaled(system, units), units.states, kSameBits, "pairs rescaled");
  }
}

TEST_P(Metamorphic, TimeStretchedByPowersOfTwo) {
  for (const System& system : SomeSystems()) {
    for (const double time : {0x1p20, 0x1p-20}) {
      UnitChange units = NoUnitChange(system);
      units.time = time;
      ExpectSame(system, Rescaled(system, units), units.states, kSameBits, "time stretched");
    }
  }
}

TEST_P(Metamorphic, OtherUnits) {
  Random random(3);
  for (const System& system : SomeSystems()) {
    if (system.rank_matters) continue;  // rounded, M would lose its rank
    UnitChange units = NoUnitChange(system);
    units.states = RandomUnits(random, system.num_states(), 4, false);
    units.w = RandomUnits(random, system.num_pairs(), 4, false);
    units.y = RandomUnits(random, system.num_pairs(), 4, false);
    ExpectSame(system, Rescaled(system, units), units.states, 2 * asked(), "other units");
  }
}

TEST_P(Metamorphic, UnreachableAndUnobservableStates) {
  Random random(4);
  for (const System& system : SomeSystems()) {
    const Eigen::VectorXd units = Eigen::VectorXd::Ones(system.num_states());
    for (const double size : {1e-8, 1.0, 1e8}) {
      ExpectSame(system, WithUnreachableStates(system, 2, size, random), units, 2 * asked(), "unreachable states");
      ExpectSame(system, WithUnobservableStates(system, 2, size, random), units, 2 * asked(), "unobservable states");
    }
  }
}

TEST_P(Metamorphic, Permuted) {
  for (const System& system : SomeSystems()) {
    std::vector<int> states(system.num_states()), pairs(system.num_pairs());
    for (size_t i = 0; i < states.size(); ++i) states[i] = static_cast<int>(states.size() - 1 - i);
    for (size_t i = 0; i < pairs.size(); ++i) pairs[i] = static_cast<int>(pairs.size() - 1 - i);
    const System permuted = Permuted(system, states, pairs);
    const Answer first = Solved(system, tolerance()), second = Solved(permuted, tolerance());
    EXPECT_EQ(VerdictName(first.verdict.kind), std::string(VerdictName(second.verdict.kind)))
        << "seed " << system.seed << ", " << system.traits << ": " << TextOf(first.verdict) << " / "
        << TextOf(second.verdict);
    if (first.verdict.kind != VerdictKind::kSolved || second.verdict.kind != VerdictKind::kSolved) continue;
    EXPECT_LE(Difference(first.x, second.x.colwise().reverse()), 2 * asked())
        << "seed " << system.seed << ", " << system.traits;
  }
}

// Two systems side by side: the worse verdict of the two is that of both.
TEST_P(Metamorphic, TwoHalves) {
  std::vector<System> systems;
  for (const System& system : SomeSystems()) {
    if (system.starts.size() == 1) systems.push_back(system);
  }
  // A state that runs into its bound: nothing can hold it.
  System blocked;
  blocked.A = blocked.B = Eigen::MatrixXd::Zero(1, 1);
  blocked.N = Eigen::MatrixXd::Ones(1, 1);
  blocked.M = Eigen::MatrixXd::Zero(1, 1);
  blocked.x0 = Eigen::VectorXd::Ones(1);
  blocked.functions = {{}};
  blocked.starts = {0};
  blocked.G = {Eigen::MatrixXd::Zero(1, 1)};
  for (size_t k = 0; k + 1 < systems.size(); k += 2) {
    System second = systems[k + 1];
    UnitChange units = NoUnitChange(second);
    units.time = systems[k].horizon / second.horizon;
    second = Rescaled(second, units);
    second.horizon = systems[k].horizon;
    blocked.horizon = systems[k].horizon;
    blocked.F = {Eigen::MatrixXd::Constant(1, 1, -2 / blocked.horizon)};
    for (const System& half : {second, blocked}) {
      const Answer one = Solved(systems[k], tolerance()), two = Solved(half, tolerance());
      const Answer both = Solved(Joined(systems[k], half), tolerance());
      EXPECT_EQ(VerdictName(std::max(one.verdict.kind, two.verdict.kind)), std::string(VerdictName(both.verdict.kind)))
          << "seeds " << systems[k].seed << " and " << half.seed << ": " << one.verdict.text << " / "
          << two.verdict.text << " / " << both.verdict.text;
      if (both.verdict.kind != VerdictKind::kSolved) continue;
      EXPECT_LE(Difference(one.x, both.x.topRows(one.x.rows())), 2 * asked()) << "seed " << systems[k].seed;
      EXPECT_LE(Difference(two.x, both.x.bottomRows(two.x.rows())), 2 * asked()) << "seed " << half.seed;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Tolerances, Metamorphic, ::testing::Values(1e-4, 1e-7));

}  // namespace
}  // namespace dlcs::hostile
