// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/circuit_problem.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "core/linalg/norms.h"
#include "core/problem/time_axis.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::SolveForEnd;

Element Part(ElementKind kind, const char* name, Index plus, Index minus, double value) {
  return {.name = name, .kind = kind, .plus = plus, .minus = minus, .value = value};
}
Element Resistor(const char* name, Index plus, Index minus, double ohms) {
  return Part(ElementKind::kResistor, name, plus, minus, ohms);
}
Element Capacitor(const char* name, Index plus, Index minus, double farads) {
  return Part(ElementKind::kCapacitor, name, plus, minus, farads);
}
Element Inductor(const char* name, Index plus, Index minus, double henries) {
  return Part(ElementKind::kInductor, name, plus, minus, henries);
}
Element Source(const char* name, Index plus, Index minus, Waveform wave) {
  Element element =
      Part(name[0] == 'V' ? ElementKind::kVoltageSource : ElementKind::kCurrentSource, name, plus, minus, 0);
  element.source = std::move(wave);
  return element;
}
Element Diode(const char* name, Index anode, Index cathode, DiodeModel model) {
  Element element = Part(ElementKind::kDiode, name, anode, cathode, 0);
  element.diode = model;
  return element;
}

Circuit CircuitOf(std::vector<std::string> nodes, std::vector<Element> elements, double horizon) {
  Circuit circuit;
  circuit.nodes = std::move(nodes);
  circuit.elements = std::move(elements);
  circuit.horizon = horizon;
  return circuit;
}

std::string MessageOf(const Circuit& circuit) { return std::string(MakeCircuitProblem(circuit).status().message()); }

TEST(CircuitProblemTest, ALowPassIsItsDifferentialEquation) {
  Circuit circuit =
      CircuitOf({"0", "in", "out"},
                {Source("V1", 1, 0, ConstantWave{10}), Resistor("R1", 1, 2, 1e3), Capacitor("C1", 2, 0, 1e-6)}, 2e-3);
  circuit.uses_initial_conditions = true;
  const auto made = MakeCircuitProblem(circuit);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_THAT(made->state_names, ElementsAre("v_C1"));
  EXPECT_NEAR(made->problem.A(0, 0), -1000, 1e-9);
  const Solution solution = SolveForEnd(made->problem);
  EXPECT_NEAR(solution.x(0, 0), 10 * (1 - std::exp(-2.0)), 1e-5);
}

TEST(CircuitProblemTest, TheOperatingPointIsAtRest) {
  // 10 V over 1 and 3 kilohm, an inductor in series with the first.
  const Circuit circuit = CircuitOf({"0", "in", "a", "out"},
                                    {Source("V1", 1, 0, ConstantWave{10}), Inductor("L1", 1, 2, 1e-3),
                                     Resistor("R1", 2, 3, 1e3), Resistor("R2", 3, 0, 3e3), Capacitor("C1", 3, 0, 1e-6)},
                                    1e-3);
  const auto made = MakeCircuitProblem(circuit);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_THAT(made->state_names, ElementsAre("i_L1", "v_C1"));
  EXPECT_NEAR(made->problem.x0[0], 2.5e-3, 1e-15);
  EXPECT_NEAR(made->problem.x0[1], 7.5, 1e-12);
}

TEST(CircuitProblemTest, ADiodeAtRestConductsAsTheComplementarityProblemSays) {
  const auto start = [](double volts) {
    const Circuit circuit =
        CircuitOf({"0", "in", "out"},
                  {Source("V1", 1, 0, ConstantWave{volts}), Diode("D1", 1, 2, {.forward = 0.7, .on_resistance = 1}),
                   Resistor("R1", 2, 0, 9), Capacitor("C1", 2, 0, 1e-6)},
                  1e-3);
    const auto made = MakeCircuitProblem(circuit);
    EXPECT_TRUE(made.ok()) << made.status();
    return made.ok() ? made->problem.x0[0] : 0;
  };
  EXPECT_NEAR(start(10.7), 9, 1e-12);
  EXPECT_EQ(start(-5), 0);
}

// A loop of a source and three capacitors has two states; the charge of the node between them is kept when the source
// jumps.
TEST(CircuitProblemTest, ALoopOfCapacitorsKeepsChargeWhenASourceJumps) {
  const Circuit circuit =
      CircuitOf({"0", "in", "a"},
                {Source("V1", 1, 0, PulseWave{.low = 0, .high = 3, .delay = 1e-3, .width = 1}),
                 Capacitor("C1", 1, 2, 1e-6), Capacitor("C2", 2, 0, 2e-6), Resistor("R1", 2, 0, 1e3)},
                2e-3);
  const auto made = MakeCircuitProblem(circuit);
  ASSERT_TRUE(made.ok()) << made.status();
  ASSERT_EQ(made->state_names.size(), 1);
  EXPECT_THAT(made->state_names[0], ::testing::StartsWith("v0_"));
  EXPECT_THAT(made->notes, ::testing::Contains(HasSubstr("do not show these impulses")));
  // The jump of 3 V is divided by the capacitors: 1 V at the node between them, which R1 then discharges.
  const Solution solution = SolveForEnd(made->problem);
  const double out = (made->outputs.x_factors.row(1) * solution.x.col(0))(0);
  const double of_source = made->outputs.sources.lift(1, 1) * 3;
  EXPECT_NEAR(out + of_source, std::exp(-1.0 / 3), 1e-5);
}

TEST(CircuitProblemTest, ACutsetOfInductorsLosesAState) {
  const Circuit circuit = CircuitOf({"0", "a", "b"},
                                    {Source("I1", 0, 1, SineWave{.amplitude = 1, .frequency = 1000}),
                                     Inductor("L1", 1, 2, 1e-3), Inductor("L2", 2, 0, 2e-3), Resistor("R1", 1, 0, 100)},
                                    1e-3);
  const auto made = MakeCircuitProblem(circuit);
  ASSERT_TRUE(made.ok()) << made.status();
  ASSERT_EQ(made->problem.num_states(), 1);
  // (L1 + L2) i' = R (I - i)
  EXPECT_NEAR(made->problem.A(0, 0), -100 / 3e-3, 1e-9);
}

TEST(CircuitProblemTest, DiodesAcrossEverythingMakeAPositiveSemidefiniteSkewOrSymmetricM) {
  // A leg of two ideal diodes across a source, with an inductor: one is driven by its voltage, the other by its
  // current.
  const Circuit circuit = CircuitOf({"0", "p", "m", "o"},
                                    {Source("V1", 1, 0, ConstantWave{10}), Diode("D1", 2, 1, {}), Diode("D2", 0, 2, {}),
                                     Inductor("L1", 2, 3, 1e-3), Resistor("R1", 3, 0, 10)},
                                    1e-3);
  const auto made = MakeCircuitProblem(circuit);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->problem.M.Dense(), -made->problem.M.Dense().transpose());
  EXPECT_EQ(std::abs(made->problem.M(0, 1)), 1);
}

// Passivity: y·w is the power into the network, and A, B, N, M in energy coordinates are passive.
TEST(CircuitProblemTest, TheSystemIsPassive) {
  const DiodeModel model = {.forward = 0.7, .on_resistance = 0.01, .off_resistance = 1e6};
  const Circuit circuit = CircuitOf(
      {"0", "a", "b", "c", "p", "o"},
      {Source("V1", 1, 0, SineWave{.amplitude = 10, .frequency = 50}), Inductor("L1", 1, 2, 1e-3),
       Diode("D1", 2, 4, model), Diode("D2", 0, 2, model), Capacitor("C1", 4, 0, 1e-4), Resistor("R1", 4, 5, 10),
       Capacitor("C2", 5, 3, 1e-9), Resistor("R2", 3, 0, 1e7), Resistor("R3", 5, 0, 100)},
      1e-3);
  const auto made = MakeCircuitProblem(circuit);
  ASSERT_TRUE(made.ok()) << made.status();
  const Problem& problem = made->problem;
  const Index m = problem.num_states(), n = problem.num_constraints();
  Vector P(m);
  for (Index k = 0; k < m; ++k) {
    for (const Element& element : circuit.elements) {
      if (made->state_names[static_cast<std::size_t>(k)].substr(2) == element.name) P[k] = element.value;
    }
  }
  Matrix energy(m + n, m + n);
  energy << P.asDiagonal() * problem.A.Dense() + problem.A.Dense().transpose() * P.asDiagonal(),
      P.asDiagonal() * problem.B.Dense() - problem.N.Dense().transpose(),
      (P.asDiagonal() * problem.B.Dense() - problem.N.Dense().transpose()).transpose(),
      -problem.M.Dense() - problem.M.Dense().transpose();
  const Vector unit = energy.diagonal().cwiseAbs().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Matrix normal = unit.asDiagonal() * energy * unit.asDiagonal();
  EXPECT_LE(Eigen::SelfAdjointEigenSolver<Matrix>(normal).eigenvalues().maxCoeff(), 1e-9);
}

TEST(CircuitProblemTest, RefusesWhatHasNoAnswer) {
  const Element drive = Source("V1", 1, 0, ConstantWave{1}), load = Capacitor("C1", 1, 0, 1e-6);
  EXPECT_THAT(MessageOf(CircuitOf({"0", "a"}, {drive, load, Source("V2", 1, 0, ConstantWave{2})}, 1)),
              AllOf(HasSubstr("V1 and V2"), HasSubstr("loop of voltage sources")));
  EXPECT_THAT(MessageOf(CircuitOf({"0", "a", "b", "c"}, {drive, load, Resistor("R1", 2, 3, 1)}, 1)),
              AllOf(HasSubstr("nodes b and c"), HasSubstr("ground")));
  EXPECT_THAT(MessageOf(CircuitOf({"0", "a", "b"}, {drive, load, Source("I1", 0, 2, ConstantWave{1})}, 1)),
              AllOf(HasSubstr("node b"), HasSubstr("I1")));
  EXPECT_THAT(MessageOf(CircuitOf({"0", "a", "b"}, {drive, Capacitor("C1", 1, 2, 1), Capacitor("C2", 2, 0, 1)}, 1)),
              AllOf(HasSubstr("operating point"), HasSubstr("node b"), HasSubstr("C1 and C2")));
  EXPECT_THAT(MessageOf(CircuitOf({"0", "a"}, {drive, Inductor("L1", 1, 0, 1)}, 1)),
              AllOf(HasSubstr("V1 and L1"), HasSubstr("UIC")));
  // Any current may flow around L1 and the diode.
  EXPECT_THAT(MessageOf(CircuitOf({"0", "a", "b"},
                                  {drive, Resistor("R1", 1, 2, 1), Inductor("L1", 2, 0, 1), Diode("D1", 0, 2, {})}, 1)),
              AllOf(HasSubstr("does not determine"), HasSubstr("L1")));
  EXPECT_THAT(MessageOf(CircuitOf({"0", "a"}, {drive, load, Diode("D1", 1, 0, {})}, 1)),
              AllOf(HasSubstr("no operating point"), HasSubstr("D1")));
}

// b may be anywhere between c and 6 V, c between 0 and b. Equal conductances across D1, D2 and D3 divide the 6 V in
// three; with C2 connected by a resistor to 1.5 V, they divide the rest in two.
TEST(CircuitProblemTest, BlockingDiodesDivideVoltagesAsEqualConductances) {
  const std::vector<Element> chain = {Source("V1", 1, 0, ConstantWave{6}),
                                      Diode("D1", 2, 1, {.forward = 0.7, .on_resistance = 0.1}),
                                      Diode("D2", 3, 2, {.forward = 0.7, .on_resistance = 0.1}),
                                      Diode("D3", 0, 3, {.forward = 0.7, .on_resistance = 0.1}),
                                      Capacitor("C1", 2, 0, 1e-6),
                                      Capacitor("C2", 3, 0, 1e-6)};
  const auto thirds = MakeCircuitProblem(CircuitOf({"0", "a", "b", "c"}, chain, 1));
  ASSERT_TRUE(thirds.ok()) << thirds.status();
  ASSERT_THAT(thirds->state_names, ElementsAre("v_C1", "v_C2"));
  EXPECT_NEAR(thirds->problem.x0[0], 4, 1e-9);
  EXPECT_NEAR(thirds->problem.x0[1], 2, 1e-9);
  EXPECT_THAT(thirds->notes, ::testing::Contains(AllOf(HasSubstr("voltage of C1"), HasSubstr("tiny conductance"))));

  std::vector<Element> held = chain;
  held.push_back(Source("V2", 4, 0, ConstantWave{1.5}));
  held.push_back(Resistor("R1", 4, 3, 1e3));
  const auto halves = MakeCircuitProblem(CircuitOf({"0", "a", "b", "c", "d"}, held, 1));
  ASSERT_TRUE(halves.ok()) << halves.status();
  EXPECT_NEAR(halves->problem.x0[0], 3.75, 1e-9);
  EXPECT_NEAR(halves->problem.x0[1], 1.5, 1e-9);

  // The least sum of squares would have 5 V across the first diode, which conducts above 0.7 V: so b is at 9.3 V.
  const std::vector<Element> pushed = {
      Source("V1", 1, 0, ConstantWave{10}), Diode("D1", 1, 2, {.forward = 0.7, .on_resistance = 0.1}),
      Diode("D2", 0, 2, {.forward = 0.7, .on_resistance = 0.1}), Capacitor("C1", 2, 0, 1e-6)};
  const auto edge = MakeCircuitProblem(CircuitOf({"0", "a", "b"}, pushed, 1));
  ASSERT_TRUE(edge.ok()) << edge.status();
  EXPECT_NEAR(edge->problem.x0[0], 9.3, 1e-9);
}

// Diodes, an open switch, resistors and capacitors at random between six nodes: as with 1 Gohm across each diode and
// switch, but for the currents of these. Where rounding hides the minimizer, which is rare, the circuit is refused.
TEST(CircuitProblemTest, BlockingDiodesAreTheLimitOfOffResistances) {
  std::mt19937 random(7);
  const auto node = [&random] { return static_cast<Index>(std::uniform_int_distribution<int>(0, 5)(random)); };
  int open = 0, compared = 0, refused = 0;
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<Element> elements = {Source("V1", 1, 0, ConstantWave{10}), Source("V2", 2, 0, ConstantWave{-3})};
    const auto add = [&](ElementKind kind, int count, double value) {
      for (int k = 0; k < count; ++k) {
        const Index plus = node(), minus = node();
        if (plus == minus || std::max(plus, minus) + std::min(plus, minus) == 1) continue;
        Element element = Part(kind, "", plus, minus, value);
        element.name = "N" + std::to_string(elements.size());
        element.diode = {.forward = 0.7, .on_resistance = 1};
        element.switching = {.threshold = 1, .on_resistance = 1};
        element.controls = {{.factor = 1, .plus = 2, .minus = 0}};
        elements.push_back(element);
      }
    };
    add(ElementKind::kDiode, 7, 0);
    add(ElementKind::kSwitch, 1, 0);
    add(ElementKind::kResistor, 2, 100);
    for (const Index k : {3, 4, 5}) {
      elements.push_back(Capacitor("", k, 0, 1e-6));
      elements.back().name = "C" + std::to_string(k);
    }
    const std::vector<std::string> nodes = {"0", "a", "b", "c", "d", "e"};
    const auto limit = MakeCircuitProblem(CircuitOf(nodes, elements, 1));
    for (Element& element : elements) element.diode.off_resistance = element.switching.off_resistance = 1e9;
    const auto leaky = MakeCircuitProblem(CircuitOf(nodes, elements, 1));
    if (!leaky.ok()) continue;  // a node at capacitors alone, a source across diodes
    ++compared;
    if (!limit.ok()) {
      EXPECT_THAT(std::string(limit.status().message()), HasSubstr("could not decide")) << trial;
      ++refused;
      continue;
    }
    const bool is_open = std::any_of(limit->notes.begin(), limit->notes.end(), [](const std::string& note) {
      return note.find("tiny conductance") != std::string::npos;
    });
    open += is_open ? 1 : 0;
    EXPECT_LE((limit->problem.x0 - leaky->problem.x0).cwiseAbs().maxCoeff(), 1e-5) << trial;
  }
  EXPECT_GT(open, 30);
  EXPECT_GT(compared, open);
  EXPECT_LE(refused, compared / 50);
}

TEST(CircuitProblemTest, SaysWhichPotentialsBlockingDiodesLeaveOpen) {
  const Element drive = Source("V1", 1, 0, SineWave{.amplitude = 5, .frequency = 50});
  DiodeModel leaky;
  leaky.off_resistance = 1e6;
  const auto notes = [](std::vector<std::string> nodes, std::vector<Element> elements) {
    const auto made = MakeCircuitProblem(CircuitOf(std::move(nodes), std::move(elements), 1e-2));
    EXPECT_TRUE(made.ok()) << made.status();
    return made.ok() ? made->notes : std::vector<std::string>();
  };
  // Two diodes in series; one of them with a leak; one between a source and a resistor.
  EXPECT_THAT(
      notes({"0", "a", "b", "c"}, {drive, Diode("D1", 1, 2, {}), Diode("D2", 2, 3, {}), Resistor("R1", 3, 0, 1)}),
      ElementsAre(HasSubstr("all diodes and switches at b block, the potential of this part is not determined")));
  EXPECT_THAT(
      notes({"0", "a", "b", "c"}, {drive, Diode("D1", 1, 2, leaky), Diode("D2", 2, 3, {}), Resistor("R1", 3, 0, 1)}),
      ElementsAre());
  EXPECT_THAT(notes({"0", "a", "b"}, {drive, Diode("D1", 1, 2, {}), Resistor("R1", 2, 0, 1)}), ElementsAre());
  // A bridge whose load has no path to ground, unless a source drives a current into it.
  const std::vector<Element> bridge = {drive,
                                       Diode("D1", 1, 2, {}),
                                       Diode("D2", 0, 2, {}),
                                       Diode("D3", 3, 1, {}),
                                       Diode("D4", 3, 0, {}),
                                       Resistor("R1", 2, 3, 100)};
  EXPECT_THAT(notes({"0", "a", "p", "n"}, bridge), ElementsAre(HasSubstr("at p and n block")));
  std::vector<Element> driven = bridge;
  driven.push_back(Source("I1", 0, 2, ConstantWave{1}));
  EXPECT_THAT(notes({"0", "a", "p", "n"}, driven), ElementsAre());
}

TEST(CircuitProblemTest, ASwitchKeepsTheMatricesAndItsGateIsInG) {
  Element closing = Part(ElementKind::kSwitch, "S1", 1, 2, 0);
  closing.switching = {.threshold = 0.5, .on_resistance = 1};
  closing.controls = {{.plus = 3}};
  Circuit circuit = CircuitOf(
      {"0", "in", "out", "g"},
      {Source("V1", 1, 0, ConstantWave{10}), closing, Capacitor("C1", 2, 0, 1e-3), Resistor("R1", 2, 0, 1e3),
       Source("Vg", 3, 0, PulseWave{.low = 0, .high = 1, .delay = 1e-3, .rise = 2e-6, .fall = 2e-6, .width = 1})},
      2e-3);
  const auto made = MakeCircuitProblem(circuit);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_THAT(made->pair_names, ElementsAre("S1_forward", "S1_backward"));
  const Solution solution = SolveForEnd(made->problem);
  // Closed from the middle of the ramp on: τ = C (1 || 1000).
  const double to = 10 * 1000.0 / 1001, rate = 1e3 * (1 + 1e-3);
  EXPECT_NEAR(solution.x(0, 0), to * (1 - std::exp(-rate * (1e-3 - 1e-6))), 2e-6);
}

TEST(CircuitProblemTest, NumbersThatOverflowAreRefused) {
  const Circuit circuit =
      CircuitOf({"0", "a", "b"},
                {Source("V1", 1, 0, ConstantWave{1e300}), Resistor("R1", 1, 2, 1e-5), Capacitor("C1", 2, 0, 1e-9)}, 1);
  EXPECT_THAT(MessageOf(circuit), HasSubstr("overflow"));
}

// A thermostat: a switch charges a capacitor until it is 0.1 V above 5 V, and again when it is 0.1 V below.
TEST(CircuitProblemTest, ASwitchThatTheCircuitControlsFollowsItsHysteresis) {
  Element closing = Part(ElementKind::kSwitch, "S1", 1, 2, 0);
  closing.switching = {.threshold = 0, .hysteresis = 0.1, .on_resistance = 1};
  closing.controls = {{.plus = 3, .minus = 2}};
  Circuit circuit = CircuitOf({"0", "in", "out", "ref"},
                              {Source("V1", 1, 0, ConstantWave{10}), closing, Source("V2", 3, 0, ConstantWave{5}),
                               Capacitor("C1", 2, 0, 1e-3), Resistor("R1", 2, 0, 4)},
                              20e-3);
  circuit.uses_initial_conditions = true;
  const auto made = MakeCircuitProblem(circuit);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->problem.rule, SolutionRule::kHistory);
  // Exactly: towards 8 V with 0.8 ms while it is closed, towards 0 with 4 ms while it is open.
  double t = 0, v = 0;
  bool closed = true;
  for (;;) {
    const double to = closed ? 8 : 0, rate = closed ? 1 / 0.8e-3 : 1 / 4e-3, level = closed ? 5.1 : 4.9;
    const double next = t + std::log((v - to) / (level - to)) / rate;
    if (next > circuit.horizon) {
      v = to + (v - to) * std::exp(-rate * (circuit.horizon - t));
      break;
    }
    t = next;
    v = level;
    closed = !closed;
  }
  const Solution solution = SolveForEnd(made->problem);
  EXPECT_NEAR(solution.x(0, 0), v, 1e-5);
}

// Of a comparator with feedback to its input the period is 2 R C ln((1 + b)/(1 - b)).
TEST(CircuitProblemTest, AComparatorWithFeedbackOscillates) {
  Element comparator = Part(ElementKind::kControlledVoltage, "B1", 1, 0, 0);
  comparator.controls = {{.plus = 2, .minus = 3}};
  comparator.transfer = PiecewiseLinear{.x = {0, 0}, .y = {-5, 5}};
  Circuit circuit = CircuitOf({"0", "out", "p", "n"},
                              {comparator, Resistor("R1", 1, 2, 1e4), Resistor("R2", 2, 0, 1e4),
                               Resistor("R3", 1, 3, 1e4), Capacitor("C1", 3, 0, 1e-8)},
                              1e-3);
  circuit.uses_initial_conditions = true;
  EXPECT_THAT(MessageOf(circuit), AllOf(HasSubstr("several solutions at 0"), HasSubstr("B1"), HasSubstr(".ic")));
  circuit.node_voltages = {{1, 5}};
  const auto made = MakeCircuitProblem(circuit);
  ASSERT_TRUE(made.ok()) << made.status();
  const double tau = 1e-4, first = tau * std::log(2.0), half = tau * std::log(3.0);
  const int halves = static_cast<int>((circuit.horizon - first) / half);
  const double left = circuit.horizon - first - halves * half;
  const double sign = halves % 2 == 0 ? -1 : 1;  // of the output
  const double v = sign * 5 * (1 - 1.5 * std::exp(-left / tau));
  const Solution solution = SolveForEnd(made->problem);
  EXPECT_NEAR(solution.x(0, 0), v, 1e-5);
  Options stepping;
  stepping.method = Method::kTimeStepping;
  stepping.step = 1e-6;
  const Solution refused = testing::SolveWith(made->problem, stepping);
  EXPECT_EQ(refused.termination, Termination::kUnsupported);
  EXPECT_THAT(refused.message, HasSubstr("history"));
}

// Six oscillators and a rectifier of eight diodes: 20 pairs, of which two at a time depend on each other.
TEST(CircuitProblemTest, TheFirstBranchIsThatOfTheGivenVoltagesForAnyNumberOfPairs) {
  constexpr Index kOscillators = 6;
  std::vector<std::string> nodes = {"0"};
  std::vector<Element> elements;
  std::vector<NodeVoltage> given;
  const auto add_node = [&](std::string name) {
    nodes.push_back(std::move(name));
    return static_cast<Index>(nodes.size()) - 1;
  };
  std::vector<std::string> names;  // `Part` takes pointers
  for (Index k = 0; k < kOscillators; ++k) {
    for (const char* what : {"B", "R1", "R2", "R3", "C"}) names.push_back(what + std::string("_") + std::to_string(k));
  }
  const auto name = [&](Index k, Index what) { return names[static_cast<std::size_t>(5 * k + what)].c_str(); };
  for (Index k = 0; k < kOscillators; ++k) {
    const Index out = add_node("out" + std::to_string(k)), p = add_node("p" + std::to_string(k)),
                n = add_node("n" + std::to_string(k));
    Element comparator = Part(ElementKind::kControlledVoltage, name(k, 0), out, 0, 0);
    comparator.controls = {{.plus = p, .minus = n}};
    comparator.transfer = PiecewiseLinear{.x = {0, 0}, .y = {-5, 5}};
    elements.push_back(comparator);
    elements.push_back(Resistor(name(k, 1), out, p, 1e4));
    elements.push_back(Resistor(name(k, 2), p, 0, 1e4));
    elements.push_back(Resistor(name(k, 3), out, n, 1e4));
    elements.push_back(Capacitor(name(k, 4), n, 0, 1e-8));
    given.push_back({out, k % 2 == 0 ? 5.0 : -5.0});
  }
  const Index source = add_node("source"), load = add_node("load");
  elements.push_back(Source("V1", source, 0, SineWave{.offset = 0, .amplitude = 10, .frequency = 1e3}));
  elements.push_back(Resistor("R", load, 0, 100));
  for (const char* diode : {"D1", "D2", "D3", "D4", "D5", "D6", "D7", "D8"}) {
    elements.push_back(Diode(diode, source, load, {.on_resistance = 1}));
  }
  Circuit circuit = CircuitOf(nodes, elements, 1e-4);
  circuit.uses_initial_conditions = true;
  circuit.node_voltages = given;
  const auto made = MakeCircuitProblem(circuit);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->problem.num_constraints(), 20);
  ASSERT_TRUE(made->problem.y0);
  const Solution solution = SolveForEnd(made->problem);
  ASSERT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
  // n goes towards the output until it passes half of it, after τ ln 2, and then back.
  const double tau = 1e-4, since = 1e-4 - tau * std::log(2.0);
  for (Index k = 0; k < kOscillators; ++k) {
    const double v = (k % 2 == 0 ? 1 : -1) * -5 * (1 - 1.5 * std::exp(-since / tau));
    EXPECT_NEAR(solution.x(k, 0), v, 1e-5) << k;
  }
  circuit.node_voltages.erase(circuit.node_voltages.begin() + 3);
  const std::string message = MessageOf(circuit);
  EXPECT_THAT(message, AllOf(HasSubstr("several solutions at 0, which differ in B_3:"), HasSubstr(".ic")));
}

// A switch with a snubber and an off-resistance, which its own output controls: the current of the open switch is
// exactly 0, whatever rounding does.
TEST(CircuitProblemTest, TheCurrentOfAnOpenSwitchDependsOnNoState) {
  Element closing = Part(ElementKind::kSwitch, "S1", 1, 2, 0);
  closing.switching = {.threshold = 0, .hysteresis = 0.05, .on_resistance = 0.02, .off_resistance = 1e6};
  closing.controls = {{.plus = 3, .minus = 4}};
  Circuit circuit = CircuitOf(
      {"0", "in", "sw", "ref", "out", "x"},
      {Source("V1", 1, 0, ConstantWave{12}), closing, Source("V2", 3, 0, ConstantWave{5}),
       Diode("D1", 0, 2, {.forward = 0.5, .on_resistance = 0.02, .off_resistance = 1e6}), Capacitor("C2", 2, 5, 1e-9),
       Resistor("R2", 5, 0, 50), Inductor("L1", 2, 4, 47e-6), Capacitor("C1", 4, 0, 1e-4), Resistor("R1", 4, 0, 5)},
      1e-3);
  circuit.uses_initial_conditions = true;
  const auto made = MakeCircuitProblem(circuit);
  ASSERT_TRUE(made.ok()) << made.status();
  const auto& names = made->pair_names;
  const auto forward = std::find(names.begin(), names.end(), "S1_forward") - names.begin();
  EXPECT_TRUE(made->problem.N.Dense().row(forward).isZero(0)) << made->problem.N.Dense().row(forward);
  const Solution solution = SolveForEnd(made->problem);
  EXPECT_EQ(solution.termination, Termination::kReachedEnd) << solution.message;
}

// The body diode of a transistor conducts while it is open. Its gate must not follow the circuit.
TEST(CircuitProblemTest, ATransistorIsASwitchWithABodyDiode) {
  Element transistor = Part(ElementKind::kSwitch, "M1", 2, 0, 0);
  transistor.switching = {.threshold = 2, .on_resistance = 1, .is_transistor = true};
  transistor.body_diode = DiodeModel{.forward = 0.7, .on_resistance = 0};
  transistor.controls = {{.plus = 3, .minus = 0}};
  const auto current = [&](double volts, double gate) {
    Circuit circuit = CircuitOf({"0", "in", "d", "g"},
                                {Source("V1", 1, 0, ConstantWave{volts}), Resistor("R1", 1, 2, 9), transistor,
                                 Source("Vg", 3, 0, ConstantWave{gate}), Capacitor("C1", 3, 0, 1e-9)},
                                1e-3);
    const auto made = MakeCircuitProblem(circuit);
    EXPECT_TRUE(made.ok()) << made.status();
    const Solution solution = SolveForEnd(made->problem);
    const auto& names = made->outputs.names;
    const auto row = std::find(names.begin(), names.end(), "i(M1)") - names.begin();
    Vector sources(made->outputs.y_factors.rows());
    auto evaluator =
        TimeFunctionEvaluator::Create(made->outputs.sources, sources.size(), TimeAxis{circuit.horizon, {}});
    EXPECT_TRUE(evaluator.ok());
    evaluator->Evaluate(TimeAxis{circuit.horizon, {}}.Nearest(1e-3), Side::kLeft, sources);
    return made->outputs.x_factors.row(row).dot(solution.x.col(0)) +
           made->outputs.y_factors.row(row).dot(solution.y.col(0)) + sources[row];
  };
  EXPECT_NEAR(current(10, 5), 1, 1e-9);
  EXPECT_NEAR(current(10, 1), 0, 1e-9);
  EXPECT_NEAR(current(-10, 1), -9.3 / 9, 1e-9);
  EXPECT_NEAR(current(-5, 5), -0.5, 1e-9);
  Circuit follower = CircuitOf({"0", "in", "s", "g"},
                               {Source("V1", 1, 0, ConstantWave{10}), Source("Vg", 3, 0, ConstantWave{5}), transistor,
                                Resistor("R1", 2, 0, 9), Capacitor("C1", 2, 0, 1e-6)},
                               1e-3);
  follower.elements[2].plus = 1;
  follower.elements[2].minus = 2;
  follower.elements[2].controls = {{.plus = 3, .minus = 2}};
  EXPECT_THAT(MessageOf(follower), AllOf(HasSubstr("M1: its gate voltage depends on C1"), HasSubstr("amplifier")));
}

// An amplifier with a gain of 1000 that saturates, with feedback: -10 times its input, but at most 5 V.
TEST(CircuitProblemTest, AnAmplifierSaturates) {
  Element amplifier = Part(ElementKind::kControlledVoltage, "E1", 3, 0, 0);
  amplifier.controls = {{.minus = 2}};
  amplifier.transfer = PiecewiseLinear{.x = {-5e-3, 5e-3}, .y = {-5, 5}};
  const auto output = [&](double volts) {
    const Circuit circuit =
        CircuitOf({"0", "in", "n", "out", "c"},
                  {Source("V1", 1, 0, ConstantWave{volts}), Resistor("R1", 1, 2, 1e3), Resistor("R2", 2, 3, 1e4),
                   amplifier, Resistor("R3", 3, 4, 1e3), Capacitor("C1", 4, 0, 1e-6)},
                  1e-3);
    const auto made = MakeCircuitProblem(circuit);
    EXPECT_TRUE(made.ok()) << made.status();
    return made.ok() ? made->problem.x0[0] : 0;
  };
  EXPECT_NEAR(output(0.2), -2 / (1 + 11.0 / 1000), 1e-9);
  EXPECT_NEAR(output(2), -5, 1e-9);
  EXPECT_NEAR(output(-2), 5, 1e-9);
}

// With a coupling of 1 a secondary with 100 ohm and four times the inductance is 25 ohm beside the primary.
TEST(CircuitProblemTest, ACouplingOfOneIsAnIdealTransformer) {
  Circuit circuit = CircuitOf({"0", "in", "a", "b"},
                              {Source("V1", 1, 0, ConstantWave{10}), Resistor("R0", 1, 2, 1),
                               Inductor("L1", 2, 0, 0.01), Inductor("L2", 3, 0, 0.04), Resistor("R1", 3, 0, 100)},
                              0.02);
  circuit.couplings = {{"K1", 2, 3, 1}};
  circuit.uses_initial_conditions = true;
  const auto made = MakeCircuitProblem(circuit);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_THAT(made->state_names, ElementsAre("i_L1"));
  const double rate = (25.0 / 26) / 0.01;
  const Solution solution = SolveForEnd(made->problem);
  EXPECT_NEAR(solution.x(0, 0), 10 * (1 - std::exp(-rate * circuit.horizon)), 1e-5);
}

}  // namespace
}  // namespace dlcs
