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

using Eigen::VectorXd;

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
