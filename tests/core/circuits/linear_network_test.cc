// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/linear_network.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace dlcs {
namespace {

using ::testing::ElementsAre;

Branch Resistor(Index plus, Index minus, double ohms) {
  return {.plus = plus, .minus = minus, .role = BranchRole::kResistor, .order = 1, .resistance = ohms};
}
Branch Voltage(Index plus, Index minus) { return {.plus = plus, .minus = minus, .role = BranchRole::kVoltage}; }
Branch Current(Index plus, Index minus) {
  return {.plus = plus, .minus = minus, .role = BranchRole::kCurrent, .order = 9};
}

TEST(LinearNetworkTest, DividesAVoltage) {
  const auto made = LinearNetwork::Create(3, {Voltage(1, 0), Resistor(1, 2, 3000), Resistor(2, 0, 1000)});
  const auto& network = std::get<LinearNetwork>(made);
  EXPECT_DOUBLE_EQ(network.Potential(2)[0], 0.25);
  EXPECT_DOUBLE_EQ(network.Current(1)[0], 0.00025);
  EXPECT_DOUBLE_EQ(network.Current(0)[0], -0.00025);  // SPICE: from plus through the source
}

TEST(LinearNetworkTest, FactorsThatNoResistorMakesAreExact) {
  const auto made = LinearNetwork::Create(3, {Voltage(1, 0), Current(0, 2), Resistor(1, 2, 1.0 / 3)});
  const auto& network = std::get<LinearNetwork>(made);
  EXPECT_EQ(network.Potential(2)[0], 1);
  EXPECT_EQ(network.Current(2)[0], 0);
  EXPECT_EQ(network.Current(2)[1], -1);
}

// Random ladders with resistances from 1e-12 to 1e12: Tellegen's theorem, Σ v i = 0, with what is given at random.
TEST(LinearNetworkTest, PowerBalancesForAllResistances) {
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> exponent(-12, 12), value(-1, 1);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<Branch> branches = {Voltage(1, 0), Current(0, 6)};
    for (Index node = 1; node < 6; ++node)
      branches.push_back(Resistor(node, node + 1, std::pow(10, exponent(generator))));
    for (Index node = 2; node <= 6; ++node) branches.push_back(Resistor(node, 0, std::pow(10, exponent(generator))));
    const auto made = LinearNetwork::Create(7, branches);
    ASSERT_TRUE(std::holds_alternative<LinearNetwork>(made));
    const auto& network = std::get<LinearNetwork>(made);
    const Vector given = Vector::NullaryExpr(2, [&] { return value(generator); });
    double sum = 0, size = 0;
    for (Index b = 0; b < static_cast<Index>(branches.size()); ++b) {
      const double v = network.Voltage(b).dot(given), i = network.Current(b).dot(given);
      sum += v * i;
      size += std::abs(v * i);
      const double ohms = branches[static_cast<std::size_t>(b)].resistance;
      EXPECT_TRUE(ohms == 0 || std::abs(v - ohms * i) <= 1e-12 * (std::abs(v) + ohms * std::abs(i)));
    }
    EXPECT_NEAR(sum, 0, 1e-12 * size);
  }
}

TEST(LinearNetworkTest, FindsControlledSources) {
  // A voltage follower of gain 1e6: v(2) = 1e6 (v(1) - v(2)).
  Branch amplifier = {.plus = 2, .minus = 0, .role = BranchRole::kControlledVoltage, .order = 1};
  amplifier.controls = {{.factor = 1e6, .plus = 1, .minus = 2}};
  const auto made = LinearNetwork::Create(3, {Voltage(1, 0), amplifier, Resistor(2, 0, 50)});
  EXPECT_NEAR(std::get<LinearNetwork>(made).Potential(2)[0], 1e6 / (1e6 + 1), 1e-15);
}

TEST(LinearNetworkTest, NamesLoopsCutsetsAndFloatingNodes) {
  const auto loop = LinearNetwork::Create(2, {Voltage(1, 0), Resistor(1, 0, 1), Voltage(0, 1)});
  const auto& first = std::get<NetworkFault>(loop);
  EXPECT_EQ(first.kind, NetworkFault::Kind::kVoltageLoop);
  EXPECT_THAT(first.branches, ElementsAre(2, 0));

  const auto cutset = LinearNetwork::Create(3, {Resistor(1, 0, 1), Current(1, 2), Current(2, 0)});
  const auto& second = std::get<NetworkFault>(cutset);
  EXPECT_EQ(second.kind, NetworkFault::Kind::kCurrentCutset);
  EXPECT_THAT(second.branches, ::testing::UnorderedElementsAre(1, 2));

  const auto floating = LinearNetwork::Create(4, {Resistor(1, 0, 1), Resistor(2, 3, 1)});
  EXPECT_THAT(std::get<NetworkFault>(floating).nodes, ElementsAre(2, 3));
}

TEST(LinearNetworkTest, NamesDependentEquations) {
  // v(2) = v(2): any value.
  Branch follower = {.plus = 2, .minus = 0, .role = BranchRole::kControlledVoltage, .order = 1};
  follower.controls = {{.plus = 2}};
  const auto made = LinearNetwork::Create(3, {Voltage(1, 0), follower, Resistor(1, 2, 1)});
  EXPECT_EQ(std::get<NetworkFault>(made).kind, NetworkFault::Kind::kSingular);
}

}  // namespace
}  // namespace dlcs
