// SPDX-License-Identifier: Apache-2.0
#include "tests/plain/plain_system.h"

#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "tests/hostile/transforms.h"
#include "tests/plain/families.h"

namespace dlcs::plain {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using hostile::SourceFunction;

struct Family {
  const char* name;
  PlainSystem (*make)(Random&);
};
constexpr Family kFamilies[] = {
    {"boxes on springs", BoxesOnSprings},
    {"boxes on floors", BoxesOnFloors},
    {"network at its operating point", NetworkAtItsOperatingPoint},
    {"equilibrium", Equilibrium},
    {"tank at rest", TankAtRest},
    {"balanced star", BalancedStar},
    {"split supply", SplitSupply},
    {"balanced bridge", BalancedBridge},
    {"swapped pair", SwappedPair},
    {"difference of sensors", DifferenceOfSensors},
    {"sum of three phases", SumOfThreePhases},
    {"modal coordinates", ModalCoordinates},
    {"decoupled and zero", DecoupledAndZero},
    {"unreached states", UnreachedStates},
    {"small parts", SmallParts},
    {"feebly coupled oscillators", FeeblyCoupledOscillators},
    {"gains from a small signal", GainsFromASmallSignal},
    {"cascade", Cascade},
    {"charge counter", ChargeCounter},
    {"gain of a difference", GainOfADifference},
    {"growth of a difference", GrowthOfADifference},
    {"nearly equal decays", NearlyEqualDecays},
    {"closed switches", ClosedSwitches},
    {"coils at a stray node", CoilsAtAStrayNode},
    {"dense", DenseSystem},
    {"box drops on floor", BoxDropsOnFloor},
    {"rectifier beside balanced part", RectifierBesideBalancedPart},
    {"rectifier feeds bridge", RectifierFeedsBridge},
    {"stop beside rest", StopBesideRest},
    {"relay beside rest", RelayBesideRest},
    {"friction that sticks", FrictionThatSticks},
};

std::vector<int> RandomOrder(Random& random, int size) {
  std::vector<int> order(size);
  std::iota(order.begin(), order.end(), 0);
  for (int i = size - 1; i > 0; --i) std::swap(order[i], order[random.Integer(0, i)]);
  return order;
}

VectorXd RandomPowersOfTwo(Random& random, int size, int most) {
  VectorXd units(size);
  for (double& unit : units) unit = std::ldexp(1, random.Integer(-most, most));
  return units;
}

void ChangeUnits(Random& random, PlainSystem& plain) {
  constexpr int kMost = 26;
  System& system = plain.system;
  hostile::UnitChange units = hostile::NoUnitChange(system);
  units.states = RandomPowersOfTwo(random, system.num_states(), kMost);
  if (random.Chance(0.5)) {
    units.w = RandomPowersOfTwo(random, system.num_pairs(), kMost);
    units.y = system.is_lipschitz ? RandomPowersOfTwo(random, system.num_pairs(), kMost) : units.w.cwiseInverse();
  }
  if (random.Chance(0.5)) units.time = RandomPowersOfTwo(random, 1, kMost)[0];
  system = hostile::Rescaled(std::move(system), units);
  plain.beside = units.states.cwiseProduct(plain.beside);
  system.traits += ", in other units";
}

}  // namespace

double LogUniform(Random& random, double low, double high) {
  return std::exp(random.Uniform(std::log(low), std::log(high)));
}

PlainSystem LinearSystem(const MatrixXd& A, const VectorXd& x0, const VectorXd& constant, double horizon,
                         const VectorXd& beside) {
  const auto m = A.rows();
  PlainSystem result{{}, {}, beside};
  System& system = result.system;
  system.A = A;
  system.B = MatrixXd::Zero(m, 1);
  system.N = MatrixXd::Zero(1, m);
  system.M = MatrixXd::Ones(1, 1);
  system.x0 = x0;
  system.horizon = horizon;
  system.functions = {{}};
  system.starts = {0};
  system.F = {constant};
  system.G = {MatrixXd::Ones(1, 1)};
  system.C = MatrixXd::Zero(0, m);
  system.D = MatrixXd::Zero(0, 1);
  system.is_lipschitz = true;
  return result;
}

void AddWave(System& system, int row, double amplitude, double rate, double phase) {
  const auto at = static_cast<Index>(system.functions.size());
  system.functions.push_back({SourceFunction::Kind::kSine, 0, rate, phase});
  system.functions.push_back({SourceFunction::Kind::kCosine, 0, rate, phase});
  for (MatrixXd* factors : {&system.F[0], &system.G[0]}) {
    factors->conservativeResize(Eigen::NoChange, at + 2);
    factors->rightCols(2).setZero();
  }
  const int m = system.num_states();
  (row < m ? system.F[0](row, at) : system.G[0](row - m, at)) = amplitude;
}

void AddOutput(System& system, const VectorXd& of_x) {
  const auto p = system.C.rows();
  system.C.conservativeResize(p + 1, Eigen::NoChange);
  system.D.conservativeResize(p + 1, Eigen::NoChange);
  system.C.row(p) = of_x.transpose();
  system.D.row(p).setZero();
}

PlainSystem Beside(const PlainSystem& first, const PlainSystem& second, const MatrixXd& gains) {
  PlainSystem result;
  System& system = result.system;
  system = hostile::Joined(first.system, second.system);
  system.A.bottomLeftCorner(gains.rows(), gains.cols()) = gains;
  system.is_lipschitz = first.system.is_lipschitz && second.system.is_lipschitz;
  system.rank_matters = first.system.rank_matters || second.system.rank_matters;
  result.beside = VectorXd(first.beside.size() + second.beside.size());
  result.beside << first.beside, second.beside;
  return result;
}

int NumFamilies() { return static_cast<int>(std::size(kFamilies)); }

PlainSystem MakePlainSystem(uint64_t seed) {
  Random random(seed);
  const Family& family = kFamilies[seed % std::size(kFamilies)];
  PlainSystem plain = family.make(random);
  plain.family = family.name;
  System& system = plain.system;
  system.seed = seed;
  system.traits = plain.family + (system.traits.empty() ? "" : ", " + system.traits);
  if (random.Chance(0.3)) ChangeUnits(random, plain);
  if (random.Chance(0.3)) {
    const std::vector<int> states = RandomOrder(random, system.num_states());
    system = hostile::Permuted(system, states, RandomOrder(random, system.num_pairs()));
    plain.beside = VectorXd(plain.beside(states));
    system.traits += ", permuted";
  }
  return plain;
}

}  // namespace dlcs::plain
