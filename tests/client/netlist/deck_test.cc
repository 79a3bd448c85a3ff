// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/deck.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "core/problem/formula.h"
#include "tests/support/paths.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::DoubleEq;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// The deck of these lines after a title.
absl::StatusOr<Deck> Read(const std::string& lines, const DeckOptions& options = {}, const std::string& folder = "") {
  return ReadDeck("title\n" + lines, "a.cir", folder, options);
}

Deck Good(const std::string& lines, const DeckOptions& options = {}) {
  auto deck = Read(lines, options);
  EXPECT_TRUE(deck.ok()) << deck.status();
  return deck.ok() ? *std::move(deck) : Deck();
}

std::string Fault(const std::string& lines) { return std::string(Read(lines).status().message()); }

const Element& Named(const Deck& deck, const std::string& name) {
  for (const Element& element : deck.circuit.elements) {
    if (element.name == name) return element;
  }
  ADD_FAILURE() << "no element " << name;
  return deck.circuit.elements.front();
}

constexpr const char* kRest = "C1 a 0 1u\n.tran 1u 1m\n";

TEST(DeckTest, ReadsElementsInEitherCaseWithCommentsAndContinuations) {
  const Deck deck = Good(
      "* a comment\n"
      "v1 IN 0 dc 10 ; another\n"
      "R1 in\n"
      "* between\n"
      "+  a {2*k} $ and another\n"
      "\n"
      ".PARAM k=5k\n"
      "C1 A 0 100n IC=2\n"
      "L1 a gnd L=1m ic = -1m\n"
      ".TRAN 1u 10m uic\n"
      ".end\n"
      "this is not read\n");
  EXPECT_EQ(deck.title, "title");
  EXPECT_THAT(deck.circuit.nodes, ElementsAre("0", "IN", "a"));
  EXPECT_EQ(Named(deck, "R1").value, 10e3);
  EXPECT_EQ(Named(deck, "R1").place, "a.cir:4");
  EXPECT_EQ(Named(deck, "C1").initial, 2);
  EXPECT_EQ(Named(deck, "L1").initial, -1e-3);
  EXPECT_EQ(Named(deck, "L1").minus, 0);
  EXPECT_EQ(deck.circuit.horizon, 0.01);
  EXPECT_TRUE(deck.circuit.uses_initial_conditions);
  EXPECT_EQ(std::get<ConstantWave>(Named(deck, "v1").source).value, 10);
}

TEST(DeckTest, ReadsSources) {
  const Deck deck = Good(
      "V1 a 0 PULSE(0 5 1u 10n 20n 4u 10u)\n"
      "V2 b 0 DC 1 AC 1 0 SIN(0 {A} 50 1m 0.5 90)\n"
      "V3 c 0 PWL 0 0 1u 1 2u 1\n"
      "I1 0 d EXP(0 1 1u 2u 3u 4u)\n"
      "I2 0 d SFFM(0 1 10k 5 1k)\n"
      "R1 d 0 1\nR2 c 0 1\nR3 b 0 1\n.param A=3\n" +
      std::string(kRest));
  EXPECT_EQ(std::get<PulseWave>(Named(deck, "V1").source).period, 10e-6);
  EXPECT_EQ(std::get<PulseWave>(Named(deck, "V1").source).fall, 20e-9);
  EXPECT_EQ(std::get<SineWave>(Named(deck, "V2").source).amplitude, 3);
  EXPECT_EQ(std::get<SineWave>(Named(deck, "V2").source).phase, 90);
  EXPECT_THAT(std::get<PiecewiseLinearWave>(Named(deck, "V3").source).times, ElementsAre(0, 1e-6, 2e-6));
  EXPECT_EQ(std::get<ExponentialWave>(Named(deck, "I1").source).fall, 4e-6);
  EXPECT_EQ(std::get<FrequencyModulatedWave>(Named(deck, "I2").source).carrier, 10e3);
}

TEST(DeckTest, TakesNoMagnitudeForAVoltageAndNoSecondValue) {
  const Deck deck = Good(
      "V1 a 0 AC {x}\nV2 b 0 5 AC {x} {x}\nV3 c 0 SIN(0 1 50) DC 2\nR1 a 0 1\nR2 b 0 1\nR3 c 0 1\n"
      ".param x=3\n" +
      std::string(kRest));
  EXPECT_EQ(std::get<ConstantWave>(Named(deck, "V1").source).value, 0);
  EXPECT_EQ(std::get<ConstantWave>(Named(deck, "V2").source).value, 5);
  EXPECT_EQ(std::get<SineWave>(Named(deck, "V3").source).amplitude, 1);
  const std::string rest = "R1 a 0 1\n" + std::string(kRest);
  EXPECT_THAT(Fault("V1 a 0 12 5\n" + rest), AllOf(HasSubstr("a.cir:2:11"), HasSubstr("5 is a second value")));
  EXPECT_THAT(Fault("V1 a 0 SIN(0 1 50) 3\n" + rest), HasSubstr("3 is a second value"));
  EXPECT_THAT(Fault("V1 a 0 1,5\n" + rest), HasSubstr("as in 1.5"));
}

TEST(DeckTest, NodesMayStandInParentheses) {
  const Deck deck = Good(
      "E1 (b 0) (a 0) 2\nG1 (c,0) (a,0) 3\nR1 (b 0) 1k\nV1 (a 0) SIN(0 1 50)\nB1 (d 0) V=V(a)*2\n"
      "X1 (b c) NET\n.subckt NET p q\nR1 p q 1\n.ends\nR2 c 0 1\nR3 d 0 1\n" +
      std::string(kRest));
  EXPECT_THAT(deck.circuit.nodes, ElementsAre("0", "b", "a", "c", "d"));
  EXPECT_EQ(Named(deck, "E1").plus, 1);
  EXPECT_EQ(Named(deck, "E1").controls[0].plus, 2);
  EXPECT_EQ(Named(deck, "X1.R1").minus, 3);
}

TEST(DeckTest, SaysWhatItTakesForNumbersThatSourcesDoNotGive) {
  const auto notes = [](const std::string& source, const std::string& tran) {
    return Good("V1 a 0 " + source + "\nR1 a 0 1\nC1 a 0 1u\n.tran " + tran + "\n").notes;
  };
  EXPECT_THAT(notes("SIN(0 1)", "1u 1m"), Contains(HasSubstr("1/TSTOP = 1000 Hz")));
  EXPECT_THAT(notes("SFFM(0 1 5k 1)", "1u 1m"), Contains(HasSubstr("FS of SFFM of V1")));
  EXPECT_THAT(notes("EXP(0 1 1u)", "1u 1m"), Contains(HasSubstr("TD2 = 2e-06")));
  EXPECT_THAT(notes("PULSE(0 1 0 0 0 5u 10u)", "1m"), Contains(HasSubstr("its edges are jumps")));
  EXPECT_THAT(notes("SIN(0 1 50)", "1u 1m"), ElementsAre());
  EXPECT_THAT(notes("5\nR2 a 0 1M", "1u 1m"), ElementsAre("a.cir:3:8: 1M is 0.001 ohm: m is milli, and mega is meg"));
  EXPECT_THAT(notes("5\nR2 a 0 1MEG\nR3 a 0 1m\nR4 a 0 {1M}", "1u 1m"), ElementsAre());
  const std::string rest = "R1 a 0 1\n" + std::string(kRest);
  EXPECT_THAT(Fault("V1 a 0 PULSE(-1 1 0 4u 5u 0 10u)\n" + rest), HasSubstr("for a triangle write a short time"));
  EXPECT_THAT(notes("PULSE(-1 1 0 {0.3/fs} {0.7/fs} 0 {1/fs})\n.param fs=7k", "1u 1m"),
              ElementsAre(AllOf(HasSubstr("PULSE of V1 is a triangle"), HasSubstr("ngspice takes TSTOP"))));
  EXPECT_THAT(Fault("V1 a 0 SIN(0 1 0)\n" + rest), HasSubstr("FREQ of SIN of V1 is 0"));
  EXPECT_THAT(Fault("V1 a 0 EXP(0 1 2u 1u 1u 1u)\n" + rest), HasSubstr("TD2 = 1e-06 is before TD1 = 2e-06"));
}

// At `t`, from all pieces.
double ValueAt(const Waveform& wave, double t) {
  auto formula = Formula::Parse(FormulaNear(wave, t));
  EXPECT_TRUE(formula.ok()) << formula.status();
  return formula.ok() ? formula->Evaluate(t) : 0;
}

TEST(DeckTest, ReadsWhatOneProgramAloneHas) {
  const Deck deck = Good(
      "I1 0 a SINE(0 2 1k 0.1m 0 180 2)\nV1 b 0 AM(1 2 100 20k 1u 0 0)\nV2 c 0 AM(1 2 3 100 20k 1u)\n"
      "E1 d 0 VCVS value={V(b)*2}\nE2 e 0 VCVS b 0 3\nG1 0 e VCCS POLY(1) b 0 0 4\nF1 0 e CCCS V1 5\n"
      "E3 vcvs 0 b 0 2\nE4 f 0 vcvs 0 2\nR1 a 0 1\nR2 e 0 1\n" +
      std::string(kRest));
  EXPECT_EQ(std::get<SineWave>(Named(deck, "I1").source).cycles, 2);
  const auto expect_wave = [&deck](const char* name, const AmplitudeModulatedWave& expected) {
    const auto found = std::get<AmplitudeModulatedWave>(Named(deck, name).source);
    EXPECT_EQ(found.offset, expected.offset);
    EXPECT_EQ(found.mean, expected.mean);
    EXPECT_EQ(found.depth, expected.depth);
    EXPECT_EQ(found.signal, expected.signal);
    EXPECT_EQ(found.carrier, expected.carrier);
    EXPECT_EQ(found.delay, expected.delay);
  };
  expect_wave("V1", {.offset = 0, .mean = 2, .depth = 1, .signal = 100, .carrier = 20e3, .delay = 1e-6});
  expect_wave("V2", {.offset = 1, .mean = 2, .depth = 3, .signal = 100, .carrier = 20e3, .delay = 1e-6});
  EXPECT_EQ(Named(deck, "E1").controls[0].factor, 2);
  EXPECT_EQ(Named(deck, "E2").controls[0].factor, 3);
  EXPECT_EQ(Named(deck, "G1").controls[0].factor, 4);
  EXPECT_EQ(Named(deck, "F1").controls[0].factor, 5);
  EXPECT_EQ(deck.circuit.nodes[AsSize(Named(deck, "E4").controls[0].plus)], "vcvs");  // a node may be called so
  EXPECT_THAT(deck.notes, AllOf(Contains(HasSubstr("SIN of I1 ends after 2 cycles")),
                                Contains(HasSubstr("AM of V1 has the order VA VO MF FC TD of ngspice 39")),
                                Contains(HasSubstr("AM of V2 has the order VO VMO VMA FM FC TD"))));
  // OrCAD writes R, C and .tran so, and ngspice reads = as a blank.
  const Deck other = Good(
      "V1 a 0 DC=0 AC=1 PULSE(0 1 0 1u 1u 1 2)\nV2 b 0 DC=5\nR_R1 a c  1k TC=0,0 \nC_C1 c 0  1u IC=0 TC=0,0\n"
      "R2 b d 1\nD1 d 0 DX IC=0.6\n.model DX D(RON=1)\n.csparam q=1\n.PROBE V(alias(*)) I(alias(*)) W(alias(*))\n.tran "
      "0 1m 0 1u SKIPBP\n");
  EXPECT_EQ(std::get<PulseWave>(Named(other, "V1").source).high, 1);
  EXPECT_EQ(std::get<ConstantWave>(Named(other, "V2").source).value, 5);
  EXPECT_EQ(Named(other, "R_R1").value, 1e3);
  EXPECT_EQ(Named(other, "C_C1").value, 1e-6);
  EXPECT_TRUE(other.circuit.uses_initial_conditions);
  EXPECT_TRUE(other.outputs.empty());  // all
  EXPECT_THAT(other.notes, AllOf(Contains(HasSubstr("R_R1: tc is ignored")), Contains(HasSubstr("D1: ic is ignored")),
                                 Contains(HasSubstr(".csparam is ignored"))));
  EXPECT_THAT(Fault("V1 a 0 1 DC=2\nR1 a 0 1\n" + std::string(kRest)), HasSubstr("dc=2 is not supported"));
  EXPECT_THAT(Fault("V1 a 0 AM(1 1 100 20k 0 0 30)\nR1 a 0 1\n" + std::string(kRest)), HasSubstr("phases of AM"));
}

TEST(DeckTest, StartupTurnsOnTheSourcesOutsideOfSubcircuits) {
  const Deck deck = Good(
      "V1 a 0 5\nV2 b 0 PULSE(1 3 4u 1u 1u 8u 20u)\nV3 c 0 PWL(0 1 10u 3 30u 7)\nX1 d NET\n.subckt NET p\n"
      "V1 p 0 5\n.ends\nR1 a 0 1\nR2 b 0 1\nR3 c 0 1\nR4 d 0 1\n.tran 0 50u startup\n");
  const Waveform &one = Named(deck, "V1").source, &two = Named(deck, "V2").source, &three = Named(deck, "V3").source;
  for (const Waveform* wave : {&one, &two, &three}) {
    EXPECT_EQ(StartValue(*wave), 0);
    EXPECT_EQ(FaultOf(*wave), "");
  }
  EXPECT_NEAR(ValueAt(one, 5e-6), 1.25, 1e-12);
  EXPECT_NEAR(ValueAt(one, 40e-6), 5, 1e-12);
  EXPECT_NEAR(ValueAt(two, 2e-6), 0.1, 1e-12);
  EXPECT_NEAR(ValueAt(two, 10e-6), 1.5, 1e-12);
  EXPECT_NEAR(ValueAt(two, 30e-6), 3, 1e-12);
  EXPECT_NEAR(ValueAt(three, 5e-6), 0.5, 1e-12);
  EXPECT_NEAR(ValueAt(three, 15e-6), 3, 1e-12);
  EXPECT_NEAR(ValueAt(three, 25e-6), 6, 1e-12);
  EXPECT_NEAR(ValueAt(three, 45e-6), 7, 1e-12);
  EXPECT_EQ(std::get<ConstantWave>(Named(deck, "X1.V1").source).value, 5);
  EXPECT_THAT(deck.notes, Contains(HasSubstr("startup: the sources outside of subcircuits rise from 0 within 20 us")));
}

TEST(DeckTest, ReadsResistorsWithAModel) {
  const std::string models =
      ".model RA R(RSH=10 DEFW=2u TC1=1m)\n.model RB RES(R=33)\n.model RC R(RSH=10)\n.model RD R(RSH=1 NARROW=1u)\n";
  const Deck deck =
      Good("R1 a 0 RA L=10u\nR2 a 0 RA L=11u W=5u m=2\nR3 a 0 RB\nR4 a 0 RC 2k\nR5 a 0 3k RC\nR6 a 0 RC R=7\n" +
           models + std::string(kRest));
  const std::vector<double> ohms = {50, 11, 33, 2e3, 3e3, 7};
  for (std::size_t k = 0; k < ohms.size(); ++k) {
    EXPECT_DOUBLE_EQ(Named(deck, "R" + std::to_string(k + 1)).value, ohms[k]);
  }
  EXPECT_THAT(deck.notes, Contains(HasSubstr(".model RA: tc1 is ignored")));
  const std::string rest = models + kRest;
  EXPECT_THAT(Fault("R1 a 0 RA L=1u\n.temp 50\n" + rest), HasSubstr("tc1 is not supported"));
  EXPECT_THAT(Fault("R1 a 0 RB 2k\n" + rest), HasSubstr("times R in PSpice"));
  EXPECT_THAT(Fault("R1 a 0 RC L=1u\n" + rest), HasSubstr("RSH with L and W"));
  EXPECT_THAT(Fault("R1 a 0 RD L=1u W=5u\n" + rest), HasSubstr("NARROW and SHORT"));
  EXPECT_THAT(Fault("R1 a 0 2k L=1u\n" + rest), HasSubstr("l=1u is not supported"));
  EXPECT_THAT(Fault("R1 a 0 DX\n.model DX D(RON=1)\n" + rest), HasSubstr("of type d; must be r or res"));
}

TEST(DeckTest, ReadsSourcesThatRepeat) {
  const Deck deck = Good(
      "V1 a 0 PULSE(0 5 0 10n 10n 4u 10u 3)\n"
      "V2 b 0 PWL(0 0 1u 1 2u 0) r=1u td=5u\n"
      "V3 c 0 PWL REPEAT FOREVER (0 0 1u 1 2u 0) ENDREPEAT\n"
      "V4 d 0 PWL(REPEAT FOR {n} (0 0 1u 1 2u 0) ENDREPEAT)\n"
      "V5 e 0 PWL(0 0 1u 1) r=-1\n"
      "R1 d 0 1\nR2 c 0 1\nR3 b 0 1\nR4 e 0 1\n.param n=2\n" +
      std::string(kRest));
  EXPECT_EQ(std::get<PulseWave>(Named(deck, "V1").source).cycles, 3);
  const auto line = [&deck](const char* name) { return std::get<PiecewiseLinearWave>(Named(deck, name).source); };
  EXPECT_THAT(line("V2").times, ElementsAre(DoubleEq(5e-6), DoubleEq(6e-6), DoubleEq(7e-6)));
  EXPECT_EQ(line("V2").repeats_from, 6e-6);
  EXPECT_EQ(line("V3").repeats_from, 0);
  EXPECT_THAT(line("V4").times, ElementsAre(0, 1e-6, 2e-6, 2e-6, 3e-6, 4e-6));
  EXPECT_EQ(line("V4").repeats_from, std::nullopt);
  EXPECT_EQ(line("V5").repeats_from, std::nullopt);
}

TEST(DeckTest, ReadsFunctionsOfTime) {
  const Deck deck = Good(
      "B1 a 0 V=5*sin(2*pi*50*time) + (time > 1m ? 2 : 1)\n"
      "B2 b 0 V={2}*V(a) + time\n"
      "B3 c 0 V=V(a) > 1k*time ? 5 : 0\n"
      "R1 b 0 1\nR2 c 0 1\n" +
      std::string(kRest));
  const auto& wave = std::get<FormulaWave>(Named(deck, "B1").source);
  auto formula = Formula::Parse(wave.text);
  ASSERT_TRUE(formula.ok()) << wave.text;
  EXPECT_NEAR(formula->Evaluate(0.5e-3), 5 * std::sin(100 * std::numbers::pi * 0.5e-3) + 1, 1e-12);
  EXPECT_NEAR(formula->Evaluate(2e-3), 5 * std::sin(100 * std::numbers::pi * 2e-3) + 2, 1e-12);
  // Where voltages are too, what depends on time is a source of its own.
  EXPECT_EQ(std::get<FormulaWave>(Named(deck, "B2#1").source).text, "t");
  EXPECT_EQ(Named(deck, "B2").controls.size(), 2u);
  EXPECT_EQ(Named(deck, "B3#2").controls.size(), 2u);
}

// Also where the source comes later, and inside of subcircuits and over them.
TEST(DeckTest, VoltagesOfDcSourcesAreFactors) {
  const Deck deck = Good(
      "X1 vcc mid out a 5v half\n"
      ".subckt half rail ref out in five\n"
      "B1 out 0 V={V(rail)*V(in)/V(ref)}\n"
      "B2 x 0 V={V(in) > V(ref) ? V(rail) : 0}\n"
      "B3 y 0 V={V(in)*sqrt(V(five, 0))*V(own)}\n"
      "V9 own 0 3\n"
      ".ends\n"
      "E1 b 0 POLY(2) vcc 0 a 0 1 2 3 4 5\n"
      "G1 b 0 VALUE={V(a)*V(vcc,mid)}\n"
      "B4 c 0 V=V(vcc)*V(mid)\n"
      "R1 b 0 1\n"
      "V1 vcc mid DC 8\n"
      "V2 mid 0 4\n"
      "V3 5v 0 9\n"
      "V4 a 0 SIN(0 1 1k)\n" +
      std::string(kRest));
  const auto only_control = [&](const std::string& name) {
    EXPECT_EQ(Named(deck, name).controls.size(), 1u) << name;
    return Named(deck, name).controls.front();
  };
  EXPECT_EQ(only_control("X1.B1").factor, 3);
  EXPECT_EQ(Named(deck, "X1.B2").controls.size(), 1u);
  EXPECT_EQ(only_control("X1.B2").factor, 12);  // times the comparator
  EXPECT_EQ(only_control("X1.B3").factor, 9);
  EXPECT_EQ(only_control("G1").factor, 8);
  EXPECT_EQ(only_control("B4").factor, 12);
  // 1 + 2 vcc + 3 a + 4 vcc² + 5 vcc a
  EXPECT_EQ(Named(deck, "E1").value, 1 + 4 * 144);
  EXPECT_EQ(Named(deck, "E1").controls[0].factor, 2);
  EXPECT_EQ(Named(deck, "E1").controls[1].factor, 3 + 5 * 12);
}

TEST(DeckTest, OnlyConstantsMultiplyVoltages) {
  const std::string rest = "V1 s 0 SIN(0 1 1k)\nV2 vcc s 5\nR9 a vcc 1\n" + std::string(kRest);
  for (const char* expression : {"V(a)*V(s)", "V(s)*V(a)", "V(a)*V(vcc)", "V(a)/V(vcc)"}) {
    EXPECT_THAT(Fault("B1 b 0 V={" + std::string(expression) + "}\n" + rest),
                AllOf(HasSubstr("a.cir:2"), HasSubstr("B1"), HasSubstr("it changes with time")))
        << expression;
  }
  EXPECT_THAT(Fault("E1 b 0 POLY(2) a 0 vcc 0 0 0 0 0 1\n" + rest), HasSubstr("voltages of DC sources"));
  EXPECT_THAT(Fault("E1 b 0 POLY(1) a 0 0 0 0 0 0 0 0 0 0 0 0 1\n" + rest), HasSubstr("not linear"));
  EXPECT_THAT(Fault("B1 b 0 V={V(a)*V(r)}\nR1 r vcc 1\n" + rest), HasSubstr("a voltage or current is not linear"));
  EXPECT_EQ(Named(Good("B1 b 0 V={V(a)*V(vcc,s)}\n" + rest), "B1").controls[0].factor, 5);
  // A source with a resistance of its own determines nothing.
  EXPECT_THAT(Fault("B1 b 0 V={V(a)*V(r)}\nV3 r 0 5 Rser=1\n" + rest), HasSubstr("not linear"));
  // From 0 within 20 us.
  EXPECT_THAT(Fault("V3 r 0 5\nR1 r a 1\nB1 b 0 V={V(a)*V(r)}\nC1 a 0 1u\n.tran 1u 1m startup\n"),
              HasSubstr("it changes with time"));
}

TEST(DeckTest, ProposesNodesWhereOneIsUnknown) {
  const std::string deck =
      ".subckt NET in out\nR1 in inner1 1\nR2 inner1 inner2 1\nR3 inner2 out 1\n.ends\nX2 supply a NET\n"
      "V1 supply 0 1\nR1 a 0 1\n" +
      std::string(kRest);
  EXPECT_THAT(Fault(deck + ".print tran V(suply)\n"), HasSubstr("no node \"suply\"; did you mean supply?"));
  EXPECT_THAT(Fault(deck + ".print tran V(x2.iner1)\n"), HasSubstr("did you mean X2.inner1?"));
  EXPECT_THAT(Fault(deck + ".print tran V(x2.out)\n"),
              HasSubstr("it is a port of a subcircuit, which is at the node a outside"));
  EXPECT_THAT(Fault(deck + ".print tran V(x2.zzzzzzzzzz)\n"), HasSubstr("the subcircuit has X2.inner1, X2.inner2"));
  EXPECT_TRUE(Fault(deck + ".print tran V(zzzzzzzzz)\n").ends_with("the deck has no node \"zzzzzzzzz\""));
}

TEST(DeckTest, MissingRampsAreTstepUnlessEdgesAreIdeal) {
  const std::string lines = std::string("V1 a 0 PULSE(0 1)\n") + kRest;
  const Deck spice = Good(lines);
  EXPECT_EQ(std::get<PulseWave>(Named(spice, "V1").source).rise, 1e-6);
  EXPECT_EQ(std::get<PulseWave>(Named(spice, "V1").source).width, 1e-3);
  EXPECT_THAT(spice.notes, Contains(HasSubstr("TR = TSTEP")));
  EXPECT_EQ(std::get<PulseWave>(Named(Good(lines, {.ideal_edges = true}), "V1").source).rise, 0);
}

TEST(DeckTest, ExpandsNestedSubcircuitsWithParameters) {
  const Deck deck = Good(
      ".subckt divider top bottom mid params: r=1k\n"
      "R1 top mid {r}\n"
      "X1 mid bottom lower r={2*r}\n"
      ".subckt lower a b r=7\n"
      ".param half={r/2}\n"
      "R2 a inner {half}\n"
      "R3 inner b {r}\n"
      ".ends lower\n"
      ".ends\n"
      "V1 in 0 1\n"
      "Xa in 0 a divider r=10\n"
      "Xb in 0 a divider\n" +
      std::string(kRest));
  EXPECT_EQ(Named(deck, "Xa.R1").value, 10);
  EXPECT_EQ(Named(deck, "Xa.X1.R2").value, 10);
  EXPECT_EQ(Named(deck, "Xa.X1.R3").value, 20);
  EXPECT_EQ(Named(deck, "Xb.X1.R3").value, 2000);
  EXPECT_THAT(deck.circuit.nodes, ElementsAre("0", "in", "a", "Xa.X1.inner", "Xb.X1.inner"));
}

TEST(DeckTest, ModelsBecomePiecewiseLinearDiodesByAStatedRule) {
  const std::string circuit = std::string("V1 in 0 1\nD1 in a DX\n") + kRest;
  const Deck linear = Good(circuit + ".model DX D(RON=0.1 ROFF=1meg VFWD=0.6 BV=5)\n");
  EXPECT_EQ(Named(linear, "D1").diode.forward, 0.6);
  EXPECT_EQ(Named(linear, "D1").diode.on_resistance, 0.1);
  EXPECT_EQ(Named(linear, "D1").diode.off_resistance, 1e6);
  EXPECT_EQ(Named(linear, "D1").diode.breakdown, 5);
  // The tangent of v = N V_T ln(i/IS) + RS i at 1 A.
  const Deck tangent = Good(circuit + ".model DX D(IS=1e-12 N=2 RS=0.05 CJO=10p)\n");
  const double slope = 2 * 1.380649e-23 * 300.15 / 1.602176634e-19;
  EXPECT_DOUBLE_EQ(Named(tangent, "D1").diode.forward, slope * (std::log(1e12) - 1));
  EXPECT_DOUBLE_EQ(Named(tangent, "D1").diode.on_resistance, 0.05 + slope);
  EXPECT_THAT(tangent.notes, AllOf(Contains(HasSubstr("cjo is ignored")), Contains(HasSubstr("tangent at 1 A"))));
  // Chords are exact at their points: 0.1, 1 and 10 A.
  const Deck chords = Good(circuit + ".model DX D(IS=1e-12 N=2 RS=0.05)\n", {.diode = DiodeRule::kPiecewise});
  const DiodeModel& diode = Named(chords, "D1").diode;
  ASSERT_EQ(diode.further.size(), 2);
  for (const double amperes : {0.1, 1.0, 10.0}) {
    const double volts = slope * std::log1p(amperes / 1e-12) + 0.05 * amperes;
    double sum = (volts - diode.forward) / diode.on_resistance;
    for (const auto& [forward, ohms] : diode.further) sum += std::max(0.0, volts - forward) / ohms;
    EXPECT_NEAR(sum, amperes, 1e-9 * amperes);
  }
  const Deck ideal = Good(circuit + ".model DX D(IS=1e-12 N=2 RS=0.05)\n", {.diode = DiodeRule::kIdeal});
  EXPECT_EQ(Named(ideal, "D1").diode.forward, 0);
  EXPECT_EQ(Named(ideal, "D1").diode.on_resistance, 0);
}

TEST(DeckTest, ReadsSwitchesCouplingsAndControls) {
  const Deck deck = Good(
      "V1 in 0 1\nVg g 0 PULSE(0 5 0 1n 1n 1u 2u)\n"
      "S1 in x g 0 SX ON\nW1 x a Vg WX\n.model SX SW(VT=2 VH=0.1 RON=1m ROFF=1G)\n.model WX CSW(IT=1m RON=2)\n"
      "L1 a 0 1m\nL2 b 0 4m\nL3 c 0 1m\nK1 L1 L2 L3 0.9\nR1 b 0 1\nR2 c 0 1\n"
      "E1 e 0 a b 2\nF1 0 e V1 3\nG1 e 0 a 0 1m\nH1 h 0 V1 5\nR3 h 0 1\n"
      "B1 k 0 V=2*V(a,b)-I(V1)+1\nR4 k 0 1\nB2 0 k I={V(a)/1k}\n" +
      std::string(kRest));
  EXPECT_TRUE(Named(deck, "S1").switching.starts_closed);
  EXPECT_EQ(Named(deck, "S1").switching.off_resistance, 1e9);
  EXPECT_EQ(Named(deck, "W1").switching.threshold, 1e-3);
  EXPECT_EQ(deck.circuit.couplings.size(), 3);
  EXPECT_EQ(Named(deck, "F1").controls.front().element, 0);
  EXPECT_EQ(Named(deck, "F1").controls.front().factor, 3);
  EXPECT_EQ(Named(deck, "H1").kind, ElementKind::kControlledVoltage);
  EXPECT_EQ(Named(deck, "B1").value, 1);
  ASSERT_EQ(Named(deck, "B1").controls.size(), 2);
  EXPECT_EQ(Named(deck, "B1").controls[0].factor, 2);   // V(a,b)
  EXPECT_EQ(Named(deck, "B1").controls[1].factor, -1);  // I(V1)
  EXPECT_EQ(Named(deck, "B2").kind, ElementKind::kControlledCurrent);
}

// The channel at 10 V of KP W/L = 20 with 2 V of threshold has 1/160 ohm.
TEST(DeckTest, TransistorsAreSwitchesByAStatedRule) {
  const Deck deck = Good(
      "V1 in 0 1\nV2 g 0 5\n"
      "M1 in g 0 NM M=2\nM2 in g 0 0 LP W=100u L=10u AD=1p\nM3 in g 0 PM\n"
      ".model NM VDMOS(VTO=2 KP=20 RD=5m RS=1m RB=10m IS=1e-12 BV=60 CGS=1n RON=99m Qg=3n)\n"
      ".model LP NMOS(LEVEL=1 VTO=1 KP=2)\n.model PM VDMOS(PCHAN VTO=-3 KP=1)\n" +
      std::string(kRest));
  const Element& power = Named(deck, "M1");
  EXPECT_EQ(power.kind, ElementKind::kSwitch);
  EXPECT_EQ(power.switching.threshold, 2);
  EXPECT_DOUBLE_EQ(power.switching.on_resistance, 0.099 / 2);  // what the model says
  ASSERT_TRUE(power.body_diode);
  const double slope = 1.380649e-23 * 300.15 / 1.602176634e-19;
  EXPECT_DOUBLE_EQ(power.body_diode->on_resistance, 0.005 + slope);
  EXPECT_DOUBLE_EQ(power.body_diode->forward, slope * (std::log(1 / 2e-12) - 1));
  EXPECT_EQ(power.body_diode->breakdown, 60);
  EXPECT_DOUBLE_EQ(Named(deck, "M2").switching.on_resistance, 1 / (2 * 10 * 9.0));
  const Element& p_channel = Named(deck, "M3");
  EXPECT_EQ(p_channel.switching.threshold, 3);
  EXPECT_EQ(p_channel.controls[0].factor, -1);
  EXPECT_TRUE(p_channel.body_points_to_minus);
  EXPECT_THAT(deck.notes,
              AllOf(Contains(HasSubstr(".model NM: cgs, qg are ignored")),
                    Contains(HasSubstr(".model LP: a switch, closed where the gate is more than 1 V above")),
                    Contains(HasSubstr("ad is ignored"))));
}

TEST(DeckTest, ReadsTablesPolynomialsAndPiecewiseLinearExpressions) {
  const Deck deck = Good(
      "V1 a 0 1\n"
      "E1 b 0 TABLE {2*V(a)} = (-1,-5) (1,5)\n"
      "E2 c 0 a b TABLE=(-1,-5,1,5)\n"
      "G1 0 d POLY(2) a 0 b 0 1 2 3\n"
      "F1 0 d POLY(1) V1 4\n"
      "E3 e 0 (a,0) 5\n"
      "E4 f 0 VALUE {V(a)-1}\n"
      "B1 g 0 V=limit(3*V(a), -1, 1) + 2*I(R1)\n"
      "R1 d 0 1\n" +
      std::string(kRest));
  EXPECT_EQ(Named(deck, "E1").controls[0].factor, 2);
  EXPECT_THAT(Named(deck, "E1").transfer->y, ElementsAre(-5, 5));
  EXPECT_THAT(Named(deck, "E2").transfer->x, ElementsAre(-1, 1));
  EXPECT_EQ(Named(deck, "G1").value, 1);
  EXPECT_EQ(Named(deck, "G1").controls[1].factor, 3);
  EXPECT_EQ(Named(deck, "F1").controls[0].factor, 4);
  EXPECT_EQ(Named(deck, "E3").controls[0].factor, 5);
  EXPECT_EQ(Named(deck, "E4").value, -1);
  EXPECT_THAT(Named(deck, "B1#1").transfer->x, ElementsAre(-1, 1));
  EXPECT_EQ(Named(deck, "B1#1").controls[0].factor, 3);
  EXPECT_EQ(Named(deck, "B1").controls.size(), 2);
}

TEST(DeckTest, ReadsResistancesOfPartsAndIgnoresTheirRatings) {
  const Deck deck =
      Good("V1 a 0 1 Rser=0.1\nC2 a 0 47u Rser=10m V=25 mfg=X\nL1 a b 33u Rpar=1k Ipk=3\nR1 b 0 1 tol=1\n" +
           std::string(kRest));
  EXPECT_EQ(Named(deck, "C2#rser").value, 0.01);
  EXPECT_EQ(Named(deck, "C2").plus, Named(deck, "C2#rser").minus);
  EXPECT_EQ(Named(deck, "L1#rpar").value, 1e3);
  EXPECT_EQ(Named(deck, "V1#rser").value, 0.1);
  EXPECT_THAT(deck.notes, Contains(HasSubstr("ipk is ignored")));
}

// As LTspice writes the inductors of its data base.
TEST(DeckTest, ResistancesInParallelAreAcrossThoseInSeriesToo) {
  const Deck deck = Good("V1 a 0 1\nL1 a b 33u Rser=20m Rpar=1k Cpar=3p\nR1 b 0 1\n" + std::string(kRest));
  const Element &part = Named(deck, "L1"), &series = Named(deck, "L1#rser");
  EXPECT_EQ(part.plus, series.minus);
  for (const char* name : {"L1#rpar", "L1#cpar"}) {
    EXPECT_EQ(Named(deck, name).plus, series.plus) << name;
    EXPECT_EQ(Named(deck, name).minus, part.minus) << name;
  }
}

// Two of each kind in parallel, with what is in them; C2 is a resistance, an inductance and a capacitance in series.
TEST(DeckTest, ReadsInductancesAndNumbersOfParts) {
  const Deck deck = Good(
      "V1 a 0 DC PWL(0 0 +1u 1)\nC2 a 0 47u Rser=10m Lser=2n m=2\nL1 a b 4m m=2 Cpar=3p\nR1 b 0 1k ac=5 tc=0.1 m=2\n"
      "D1 b 0 DX m=2\n.model DX D(RON=1)\n" +
      std::string(kRest));
  EXPECT_EQ(std::get<PiecewiseLinearWave>(Named(deck, "V1").source).times.back(), 1e-6);
  EXPECT_EQ(Named(deck, "C2").value, 94e-6);
  EXPECT_EQ(Named(deck, "C2#rser").value, 5e-3);
  EXPECT_EQ(Named(deck, "C2#lser").kind, ElementKind::kInductor);
  EXPECT_EQ(Named(deck, "C2#lser").value, 1e-9);
  EXPECT_EQ(Named(deck, "C2#lser").plus, Named(deck, "C2#rser").minus);
  EXPECT_EQ(Named(deck, "C2").plus, Named(deck, "C2#lser").minus);
  EXPECT_EQ(Named(deck, "L1").value, 2e-3);
  EXPECT_EQ(Named(deck, "L1#cpar").value, 6e-12);
  EXPECT_EQ(Named(deck, "R1").value, 500);
  EXPECT_EQ(Named(deck, "D1").diode.on_resistance, 0.5);
  EXPECT_THAT(deck.notes, AllOf(Contains(HasSubstr("R1: ac is ignored")), Contains(HasSubstr("R1: tc is ignored"))));
}

TEST(DeckTest, ASwitchThatChangesSmoothlyIsOneInTheMiddle) {
  const Deck deck = Good(
      "V1 a 0 1\nVg g 0 1\nS1 a b g 0 SV\nS2 b 0 g 0 SN ON\nS3 b 0 g 0 SL\nW1 a 0 Vg WI\nS4 b 0 g 0 SR OFF\n"
      ".model SV VSWITCH(RON=2 VON=4 VOFF=1)\n.model SN VSWITCH(VON=1 VOFF=4 ROFF=1G)\n"
      ".model SL SW(VT=3 VH=-0.5)\n.model WI ISWITCH(ION=3m IOFF=1m)\n.model SR SW(RON=1meg ROFF=1 VT=2 VH=0.5)\n" +
      std::string(kRest));
  const SwitchModel& one = Named(deck, "S1").switching;
  EXPECT_EQ(one.threshold, 2.5);
  EXPECT_EQ(one.hysteresis, 0);
  EXPECT_EQ(one.on_resistance, 2);
  EXPECT_EQ(one.off_resistance, 1e6);
  EXPECT_EQ(Named(deck, "S2").controls[0].factor, -1);
  EXPECT_EQ(Named(deck, "S2").switching.threshold, -2.5);
  EXPECT_EQ(Named(deck, "S2").switching.off_resistance, 1e9);
  EXPECT_FALSE(Named(deck, "S2").switching.starts_closed);  // ON is where its control is high
  EXPECT_EQ(Named(deck, "S3").switching.threshold, 3);
  EXPECT_EQ(Named(deck, "S3").switching.hysteresis, 0);
  EXPECT_EQ(Named(deck, "W1").switching.threshold, 2e-3);
  EXPECT_EQ(Named(deck, "W1").switching.on_resistance, 1);
  const Element& inverted = Named(deck, "S4");
  EXPECT_EQ(inverted.controls[0].factor, -1);
  EXPECT_EQ(inverted.switching.on_resistance, 1);
  EXPECT_EQ(inverted.switching.off_resistance, 1e6);
  EXPECT_EQ(inverted.switching.hysteresis, 0.5);
  EXPECT_TRUE(inverted.switching.starts_closed);
  EXPECT_THAT(deck.notes, AllOf(Contains(HasSubstr(".model SV: a resistance that changes smoothly within 1.5 of 2.5")),
                                Contains(HasSubstr(".model SN: closed below 2.5")),
                                Contains(HasSubstr(".model SR: closed below 2, open above"))));
}

TEST(DeckTest, ReadsWhatOtherProgramsWrite) {
  const Deck deck = Good(
      ".subckt NET (p q)\nR1 p m 1\nC1 m q 1u\n.ic V(m)={u} V(p)=3\n.param u=2\n.ends\nX1 (a b) NET\nR2 b 0 1\n"
      ".model DX D(\n+ RON=1\n)\nD1 b 0 DX\n.probe alli\n.probe p(R2)\n.save @r2[p]\n.save V(*) I(*)\n" +
      std::string(kRest));
  ASSERT_EQ(deck.circuit.node_voltages.size(), 2);
  EXPECT_EQ(deck.circuit.nodes[AsSize(deck.circuit.node_voltages[0].node)], "X1.m");
  EXPECT_EQ(deck.circuit.node_voltages[0].volts, 2);
  EXPECT_EQ(deck.circuit.nodes[AsSize(deck.circuit.node_voltages[1].node)], "a");
  EXPECT_THAT(deck.notes,
              AllOf(Contains(HasSubstr("p(R2): a power is not a curve")), Contains(HasSubstr("a ) alone"))));
  EXPECT_TRUE(deck.outputs.empty());  // all
  // A parameter that the subcircuit does not declare, the path of a library with blanks, two models in one.
  const Deck of_ltspice = Good(
      "XX1 a 0 NET params: N1=5 m=2\n.subckt NET p q\nL1 p q {N1*N1*m} Rser=1u\n.ends\nV1 a 0 1\nD1 a 0 DX\n"
      ".model DX D(VFWD=0.7 RS=1m)\n.lib C:\\Program Files\\LTC\\LTspiceXVII\\lib\\cmp\\standard.dio\n" +
      std::string(kRest));
  EXPECT_EQ(Named(of_ltspice, "XX1.L1").value, 50);
  EXPECT_EQ(Named(of_ltspice, "D1").diode.on_resistance, 1);
  EXPECT_THAT(of_ltspice.notes, AllOf(Contains(HasSubstr("standard.dio is a library of another program")),
                                      Contains(HasSubstr("IS, N and RS are ignored"))));
  EXPECT_THAT(Fault("R1 a 0 1\n.print tran p(R1)\n" + std::string(kRest)), HasSubstr("a power is not a curve"));
}

TEST(DeckTest, StepsAreTheCombinationsOfTheirValues) {
  const Deck deck = Good(
      ".step param R 1 2 0.5\n.step dec param C 1u 100u 1\n.step param k list 7 5\n.param R=3\n"
      "R1 a 0 {R}\nC2 a 0 {C}\nV1 a 0 {k}\n" +
      std::string(kRest));
  ASSERT_EQ(deck.steps.size(), 3);
  EXPECT_THAT(deck.steps[0].values, ElementsAre(1, 1.5, 2));
  EXPECT_EQ(deck.steps[1].values.size(), 3);
  EXPECT_DOUBLE_EQ(deck.steps[1].values[2], 100e-6);
  EXPECT_EQ(Named(deck, "C2").value, 1e-6);
  const auto points = PointsOf(deck.steps);
  ASSERT_TRUE(points.ok());
  ASSERT_EQ(points->size(), 18);
  EXPECT_EQ((*points)[1].label, "R=1.5, C=1e-06, k=7");
  EXPECT_EQ(Named(Good("R1 a 0 {R}\n.param R=3\n" + std::string(kRest), {.parameters = {{"r", 8}}}), "R1").value, 8);
}

// The expressions of a model are evaluated in the scope of its definition.
TEST(DeckTest, ModelsAreReadWhereTheyAreDefined) {
  const Deck deck = Good(
      ".param r=5\n.model DX D(RON={r})\nX1 a 0 NET r=7\n.subckt NET p q r=1\nD1 p q DX\nR1 p q {r}\n.ends\n"
      "V1 a 0 1\n" +
      std::string(kRest));
  EXPECT_EQ(Named(deck, "X1.D1").diode.on_resistance, 5);
  EXPECT_EQ(Named(deck, "X1.R1").value, 7);
}

TEST(DeckTest, NotesWhatItLeavesOut) {
  const Deck deck = Good(
      "V1 a 0 1\n.options gmin=1e-6\n.control\nrun\nplot v(a)\n.endc\n.ac dec 10 1 1k\n"
      ".meas ac x max vdb(a)\n.print ac vdb(a)\n.print tran v(a) i(V1)\n" +
      std::string(kRest));
  EXPECT_THAT(deck.notes, AllOf(Contains(HasSubstr(".options is ignored")), Contains(HasSubstr(".control block")),
                                Contains(HasSubstr(".ac is ignored")), Contains(HasSubstr(".print ac is ignored")),
                                Contains(HasSubstr(".meas ac is ignored"))));
  ASSERT_EQ(deck.outputs.size(), 2);
  EXPECT_EQ(deck.outputs[1].factors[0].factors.at("i(v1)"), 1);
}

TEST(DeckTest, TakesTheTolerancesThatItWrites) {
  const std::string circuit = "V1 a 0 1\n" + std::string(kRest);
  const Deck none = Good(".options gmin=1e-12 noacct\n" + circuit);
  EXPECT_FALSE(none.tolerances.relative || none.tolerances.of_currents || none.tolerances.of_voltages);
  // The last value counts.
  const Deck deck = Good(".param small=1u\n.options RELTOL=1e-7 ABSTOL = 1p gmin=1e-12 noacct\n" + circuit +
                         ".opt vntol={small} abstol=2p\n");
  EXPECT_EQ(deck.tolerances.relative, 1e-7);
  EXPECT_EQ(deck.tolerances.of_currents, 2e-12);
  EXPECT_EQ(deck.tolerances.of_voltages, 1e-6);
  EXPECT_THAT(
      deck.notes,
      AllOf(
          Contains("a.cir:3:10: reltol is --tolerance 1e-07, unless the command line gives its own"),
          Contains("a.cir:3:22: abstol is --absolute-tolerance 1e-12 A of inductors and of outputs, unless the command "
                   "line gives its own"),
          Contains(HasSubstr("vntol is --absolute-tolerance 1e-06 V of capacitors and of outputs")),
          Contains("a.cir:3: gmin, noacct of .options is ignored")));
  EXPECT_THAT(Fault(".options reltol=1\n" + circuit),
              HasSubstr("a.cir:2:17: reltol is 1; must be at least 1e-13 and below 1"));
  EXPECT_THAT(Fault(".options reltol=0\n" + circuit), HasSubstr("reltol is 0; must be at least 1e-13"));
  EXPECT_THAT(Fault(".options vntol=-1u\n" + circuit), HasSubstr("vntol is -1e-06; must be finite and at least 0"));
  EXPECT_THAT(Fault(".options abstol gmin=1\n" + circuit),
              HasSubstr("a.cir:2:10: abstol has no value; it is written abstol=VALUE"));
}

TEST(DeckTest, TakesTheTranOfAControlBlockWhereThereIsNoOther) {
  const std::string circuit = "V1 a 0 1\nR1 a b 1\nC1 b 0 1u\n";
  const Deck deck = Good(circuit + ".control\n  tran 10n 4000u uic\nrun\n.endc\n");
  EXPECT_EQ(deck.circuit.horizon, 4e-3);
  EXPECT_TRUE(deck.circuit.uses_initial_conditions);
  EXPECT_THAT(deck.notes, Contains(HasSubstr("a.cir:6: there is no .tran, and that of the .control block is taken")));
  EXPECT_EQ(Good(circuit + ".control\ntran 1u 2m\n.endc\n.tran 1u 1m\n").circuit.horizon, 1e-3);
  EXPECT_THAT(Fault(circuit + ".control\ntran 1u 2m\nalter r1=2\ntran 1u 3m\n.endc\n"),
              AllOf(HasSubstr("a.cir:8"), HasSubstr("the .control block has several")));
}

// The answer would be that of another circuit.
TEST(DeckTest, RefusesControlBlocksThatChangeTheCircuitBeforeItIsRun) {
  const std::string circuit = "V1 a 0 1\nR1 a b 1\nC1 b 0 1u\n";
  const std::string tran = ".tran 1u 1m\n";
  for (const char* command :
       {"alter R1 = 10", "alter @v1[dc]=5", "alterparam r=2", "altermod DX rs=1", "source b.cir"}) {
    const std::string name = std::string(command).substr(0, std::string(command).find(' '));
    for (const std::string run : {"tran 1u 1m", "run"}) {
      EXPECT_THAT(Fault(circuit + ".control\n " + command + "\n" + run + "\n.endc\n" + tran),
                  AllOf(HasSubstr("a.cir:6:2: " + name), HasSubstr("before it is run")));
      const Deck deck = Good(circuit + ".control\n" + run + "\n" + command + "\n.endc\n" + tran);
      EXPECT_THAT(deck.notes, Contains(HasSubstr("a.cir:7: " + name + " is ignored")));
    }
  }
  EXPECT_THAT(Fault(circuit + ".control\nset x = 1; alter R1 = 10; run\n.endc\n" + tran),
              HasSubstr("a.cir:6:12: alter"));
  EXPECT_THAT(Fault(circuit + ".control\nalter R1 = 10\n.endc\n" + tran), HasSubstr("a.cir:6:1: alter"));
  EXPECT_EQ(Good(circuit + ".control\nset x = 1; tran 1u 2m\n.endc\n").circuit.horizon, 2e-3);
}

TEST(DeckTest, ATitleThatLooksLikeAnElementIsNoted) {
  const auto deck = ReadDeck("V1 a 0 1\nR1 a 0 1\nC1 a 0 1u\n.tran 1u 1m\n", "a.cir", "", {});
  ASSERT_TRUE(deck.ok()) << deck.status();
  EXPECT_THAT(deck->notes, Contains(HasSubstr("line 1 of a deck is its title")));
  const Deck late = Good("V1 a 0 1\nR1 a b 1\nC1 b 0 1u\n.tran 1u 1m 0.5m\n");
  EXPECT_THAT(late.notes, Contains(HasSubstr("TSTART = 0.0005 of .tran is ignored: results begin at 0")));
}

TEST(DeckTest, ReadsTheMicroOfLtspice) {
  const Deck deck = Good("V1 a 0 1\nR1 a b 1\nC1 b 0 47\xb5\n.tran 1u 1m\n");
  EXPECT_EQ(Named(deck, "C1").value, 47e-6);
}

TEST(DeckTest, RefusesWithPlaceNameAndReason) {
  const std::string rest = kRest;
  EXPECT_THAT(Fault("M1 a b 0 0 NM\n" + rest), AllOf(HasSubstr("a.cir:2:12: M1"), HasSubstr("no .model NM")));
  EXPECT_THAT(Fault("M1 a b 0 c NM\n.model NM NMOS(VTO=2)\n" + rest),
              AllOf(HasSubstr("the bulk c is not at the source 0"), HasSubstr("a switch S with diodes D")));
  EXPECT_THAT(Fault("M1 a b 0 0 NM W=1u\n.model NM NMOS(VTO=2)\n" + rest), HasSubstr("W and L must be given together"));
  EXPECT_THAT(Fault("M1 a b 0 0 NM\n.model NM NMOS(LEVEL=8 VTH0=1)\n" + rest), HasSubstr("LEVEL=8 is not supported"));
  EXPECT_THAT(Fault("M1 a b 0 NM\n.model NM VDMOS(VTO=12)\n" + rest), HasSubstr("a threshold of 12 V"));
  EXPECT_THAT(Fault("M1 a b 0 NM\n.model NM VDMOS(VTO=2 ZAP=1)\n" + rest), HasSubstr("zap is not supported"));
  EXPECT_THAT(Fault("Q1 a b 0 X\n" + rest), AllOf(HasSubstr("Q1"), HasSubstr("only MOSFETs"), HasSubstr("VFWD")));
  EXPECT_THAT(Fault("T1 a 0 b 0 Z0=50\n" + rest), HasSubstr("transmission lines"));
  EXPECT_THAT(Fault("?1 a 0 1\n" + rest), HasSubstr("not known"));
  EXPECT_THAT(Fault("R1 a 0\n" + rest), AllOf(HasSubstr("a.cir:2: R1"), HasSubstr("RNAME NODE NODE VALUE")));
  EXPECT_THAT(Fault("R1 a 0 1k 2k\n" + rest), AllOf(HasSubstr("a.cir:2:11"), HasSubstr("\"2k\"")));
  EXPECT_THAT(Fault("R1 a 0 1,5k\n" + rest), HasSubstr("as in 1.5k"));
  EXPECT_THAT(Fault("R1 a 0 10 k\n" + rest), HasSubstr("as in 10k"));
  EXPECT_THAT(Fault("V1 a 0 5 V\n" + rest), HasSubstr("the function V is not supported"));
  EXPECT_THAT(Fault("V1 a 0 5 V\n" + rest), HasSubstr("as in 5V"));
  EXPECT_THAT(Fault("B1 a 0 V=sqr(V(b))\n" + rest), HasSubstr("sqr of a voltage or current is not linear"));
  EXPECT_THAT(Fault("B1 a 0 V=V(b)*time\n" + rest), HasSubstr("a function of time is not supported here"));
  EXPECT_THAT(Fault("B1 a 0 V=V(b) > 1 ? time : 0\n" + rest), HasSubstr("between functions of time"));
  EXPECT_THAT(Fault("B1 a 0 V=1/time\n" + rest), HasSubstr("not finite"));
  EXPECT_THAT(Fault("V1 a 0 PWL(0 0 1u 1) r=1u\n" + rest), HasSubstr("before its last time"));
  EXPECT_THAT(Fault("V1 a 0 PWL REPEAT (0 0 1u 1) ENDREPEAT\n" + rest), HasSubstr("REPEAT FOREVER (...) ENDREPEAT"));
  EXPECT_THAT(Fault("R1 a 0 {Rload}\n" + rest),
              HasSubstr("at column 1 of \"Rload\": \"Rload\" is not a parameter; define it with .param Rload=VALUE"));
  EXPECT_THAT(Fault("R1 a 0 {2*3\n" + rest), AllOf(HasSubstr("a.cir:2:8"), HasSubstr("this { is not closed")));
  EXPECT_THAT(Fault("R1 a 0 '2*3 IC=1\n" + rest), AllOf(HasSubstr("a.cir:2:8"), HasSubstr("this ' is not closed")));
  EXPECT_THAT(Fault("R1 a 0 1\n.tran 1m 1u\n"), HasSubstr("TSTEP = 0.001 is longer than TSTOP = 1e-06"));
  EXPECT_THAT(Fault("R1 a 0 1k tc1=0.1\n.temp 50\n" + rest), HasSubstr("tc1=0.1 is not supported"));
  EXPECT_THAT(Fault("R1 a 0 1k m=0\n" + rest), HasSubstr("m=0; must be above 0"));
  EXPECT_THAT(Fault("R1 a 0 0\n" + rest), HasSubstr("must be above 0"));
  EXPECT_THAT(Fault("R1 a 0 4k7\n" + rest),
              AllOf(HasSubstr("a.cir:2:8"), HasSubstr("\"4k7\" is not a number; write 4.7k")));
  EXPECT_THAT(Fault("R1 a 0 2R2\n" + rest), HasSubstr("write 2.2"));
  EXPECT_THAT(Fault("R1 a 0 k4k7\n" + rest), Not(HasSubstr("write")));
  EXPECT_THAT(Fault("R1 a 0 r\n.param r=1\n" + rest), HasSubstr("{r}"));
  EXPECT_THAT(Fault("R1 a 0 {1/0}\n" + rest), HasSubstr("not finite"));
  EXPECT_THAT(Fault("R1 a 0 1\nr1 a 0 2\n" + rest), AllOf(HasSubstr("a.cir:3:1"), HasSubstr("first at a.cir:2")));
  EXPECT_THAT(Fault("D1 a 0 NIX\n" + rest), HasSubstr("there is no .model NIX"));
  EXPECT_THAT(Fault("D1 a 0 SX\n.model SX SW(VT=1)\n" + rest), HasSubstr("of type sw"));
  EXPECT_THAT(Fault("D1 a 0 DX\n.model DX D(ZAP=1)\n" + rest), HasSubstr("zap is not supported"));
  EXPECT_THAT(Fault("D1 a 0 DX\n.model DX D(VFW=1)\n" + rest), HasSubstr("vfw is not supported; did you mean vfwd?"));
  EXPECT_THAT(Fault(".modle DX D\n" + rest), HasSubstr(".modle is not supported; did you mean .model?"));
  EXPECT_THAT(Fault("X1 a 0 NIX\n" + rest), HasSubstr("there is no .subckt NIX"));
  EXPECT_THAT(Fault("X1 a NET\n.subckt NET a b\nR1 a b 1\n.ends\n" + rest),
              HasSubstr("X1 has 1 node, but .subckt NET needs 2, in this order: a b"));
  EXPECT_THAT(Fault("X1 a b 0 NET\n.subckt NET a\nR1 a 0 1\n.ends\n" + rest),
              HasSubstr("X1 has 3 nodes, but .subckt NET needs 1, in this order: a"));
  EXPECT_THAT(Fault("X1 a 0 NET q=1\n.subckt NET a b\nR1 a b 1\n.ends\n" + rest), HasSubstr("no parameter q"));
  EXPECT_THAT(Fault("X1 a 0 NET\n.subckt NET a b\nX2 a b NET\n.ends\n" + rest), HasSubstr("contain itself"));
  EXPECT_THAT(Fault(".subckt NET a b\nR1 a b 1\n" + rest), HasSubstr("is an .ends missing?"));
  EXPECT_THAT(Fault(rest + ".subckt NET a b\nR1 a b 1\n"), HasSubstr(".subckt NET has no .ends"));
  EXPECT_THAT(Fault(".ends\n" + rest), HasSubstr(".ends without .subckt"));
  EXPECT_THAT(Fault(".magic\n" + rest), HasSubstr(".magic is not supported"));
  EXPECT_THAT(Fault(".step param r 1 2 0\nR1 a 0 1\n" + rest), HasSubstr("do not lead from 1 to 2"));
  EXPECT_THAT(Fault(".step temp 1 2 1\nR1 a 0 1\n" + rest), HasSubstr(".step param NAME"));
  EXPECT_THAT(Fault(".step param r 1 2 1\n.step param R 1 2 1\nR1 a 0 1\n" + rest), HasSubstr("stepped twice"));
  EXPECT_THAT(Fault("R1 a 0 1\nL2 a 0 1u lser=1n\n" + rest), HasSubstr("write it as an element"));
  EXPECT_THAT(Fault("R1 a 0 1\nC1 a 0 1u\n"), HasSubstr("a.cir: the deck has no .tran"));
  EXPECT_THAT(Fault("R1 a 0 1\n.tran 1u 0\n"), HasSubstr("TSTOP"));
  EXPECT_THAT(Fault(".tran 1u 1m\n.tran 1u 2m\nR1 a 0 1\n"), HasSubstr("a second .tran"));
  EXPECT_THAT(Fault("V1 a 0 PULSE(0 1 0 -1u)\n" + rest), HasSubstr("at least 0"));
  EXPECT_THAT(Fault("V1 a 0 PULSE(0 1 0 1u\n" + rest), HasSubstr("\")\" is missing"));
  EXPECT_THAT(Fault("V1 a 0 WAVE(1)\n" + rest), HasSubstr("function WAVE is not supported"));
  EXPECT_THAT(Fault("V1 a 0 PWL(0 0 1)\n" + rest), HasSubstr("pairs"));
  EXPECT_THAT(Fault("V1 a 0 PWL REPEAT FOREVER (0 0 1 1) r=0\n" + rest), HasSubstr("by REPEAT or by r="));
  EXPECT_THAT(Fault("V1 a 0 PWL(0 0 1u 0 +1u 1)\n" + rest), AllOf(HasSubstr("+1u"), HasSubstr("LTspice")));
  EXPECT_THAT(Fault("V1 a 0 DC nix\n" + rest), HasSubstr("\"nix\" is not a number"));
  EXPECT_THAT(Fault("F1 a 0 R1 2\nR1 a 0 1\n" + rest), HasSubstr("is not a voltage source"));
  EXPECT_THAT(Fault("K1 L1 L2 0.5\nL1 a 0 1\n" + rest), HasSubstr("\"L2\" is not an inductor"));
  EXPECT_THAT(Fault("K1 L1 L2 1.1\nL1 a 0 1\nL2 a 0 1\n" + rest), HasSubstr("at most 1"));
  EXPECT_THAT(Fault("E1 a 0 POLY(1) b 0 1 2 3\n" + rest), HasSubstr("powers or products"));
  EXPECT_THAT(Fault("E1 a 0 LAPLACE {V(a)} = {1/s}\n" + rest), HasSubstr("laplace is not supported"));
  EXPECT_THAT(Fault("E1 a 0 b 0 Laplace=1/(1+s)\n" + rest), HasSubstr("laplace is not supported"));
  EXPECT_THAT(Fault("B1 a 0 V=idt(V(b))\n" + rest), HasSubstr("the current of a capacitor is a derivative"));
  EXPECT_THAT(Fault("E1 a 0 value=V(b)*2\n" + rest), HasSubstr("ENAME NODE NODE VALUE={...}"));
  EXPECT_THAT(Fault("D1 a 0 DX\n.model DX D(VFWD=0.5 RON)\n" + rest),
              AllOf(HasSubstr("a.cir:3:22"), HasSubstr("\"RON\" is not followed by =")));
  EXPECT_THAT(Fault("D1 a 0 DX\n.model DX D(RON=1 RON=2)\n" + rest), HasSubstr("RON is given twice"));
  EXPECT_THAT(Fault("R1 a 0 1e400\n" + rest), Not(HasSubstr("write")));
  EXPECT_THAT(Fault("V1 a 0 AM(1 1)\n" + rest), Not(HasSubstr("0AM")));
  EXPECT_THAT(Fault("B1 a 0 V={V(a)**2}\n" + rest), HasSubstr("not linear"));
  EXPECT_THAT(Fault("+ R1 a 0 1\n" + rest), HasSubstr("+ continues a line"));
  EXPECT_THAT(Fault(".ic V(nix)=1\nR1 a 0 1\n" + rest), HasSubstr("\"nix\" is not a node"));
  EXPECT_THAT(Fault(".param a=1 a=2\nR1 a 0 1\n" + rest), HasSubstr("defined twice"));
  EXPECT_THAT(Fault(".control\nrun\n"), HasSubstr(".control without .endc"));
  EXPECT_THAT(Fault(""), HasSubstr("no .tran"));
}

TEST(DeckTest, ReadsThePointsOfSourcesFromFilesBelowItsFolder) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(::testing::TempDir()) / "deck_points";
  fs::create_directories(folder);
  std::ofstream(folder / "wave.txt") << "0 0\r\n1m,1\n\n2m\t3\n";
  const auto read = [&folder](const std::string& line) {
    return Read(line + "\nR1 a 0 1\n" + kRest, {}, folder.string());
  };
  for (const char* line :
       {"V1 a 0 PWL file=wave.txt", "V1 a 0 PWL FILE = \"wave.txt\"", "V1 a 0 PWL(file='wave.txt')",
        "V1 a 0\n+ pwl file=wave.txt\n+ td=0", "V1 a 0 PWL REPEAT FOREVER (file=wave.txt) ENDREPEAT"}) {
    const auto deck = read(line);
    ASSERT_TRUE(deck.ok()) << deck.status();
    const auto& wave = std::get<PiecewiseLinearWave>(Named(*deck, "V1").source);
    EXPECT_EQ(wave.times, (std::vector<double>{0, 1e-3, 2e-3})) << line;
    EXPECT_EQ(wave.values, (std::vector<double>{0, 1, 3})) << line;
  }
  const auto fault = [&read](const std::string& line) { return std::string(read(line).status().message()); };
  EXPECT_THAT(fault("V1 a 0 PWL file=nix.txt"), AllOf(HasSubstr("a.cir:2:17"), HasSubstr("reads nix.txt")));
  EXPECT_THAT(fault("V1 a 0 PWL file=/etc/passwd"), HasSubstr("relative"));
  EXPECT_THAT(fault("V1 a 0 PWL file=\"wave.txt\" zap=1"), AllOf(HasSubstr("a.cir:2:32"), HasSubstr("zap=1")));
  EXPECT_THAT(Fault("V1 a 0 PWL file=wave.txt\n" + std::string(kRest)), HasSubstr("standard input"));
}

TEST(DeckTest, IncludesFilesBelowItsFolderOnly) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(::testing::TempDir()) / "deck_includes";
  fs::create_directories(folder / "parts");
  const auto write = [&folder](const std::string& name, const std::string& text) {
    std::ofstream(folder / name) << text;
  };
  write("parts/r.inc", "R1 a 0 1\n.include more.inc\n");
  write("parts/more.inc", "R2 a 0 2\n");
  write("cycle.inc", ".include \"cycle.inc\"\n");
  write("lib.lib", ".lib one\nR3 a 0 3\n.endl\n.lib two\nR4 a 0 4\n.endl\n");
  const auto read = [&folder](const std::string& line) { return Read(line + "\n" + kRest, {}, folder.string()); };
  const auto good = read(".include parts/r.inc\n.lib 'lib.lib' two");
  ASSERT_TRUE(good.ok()) << good.status();
  EXPECT_EQ(Named(*good, "R2").place, "parts/more.inc:1");
  EXPECT_EQ(Named(*good, "R4").value, 4);
  EXPECT_EQ(good->circuit.elements.size(), 4);
  const auto fault = [&read](const std::string& line) { return std::string(read(line).status().message()); };
  EXPECT_THAT(fault(".include cycle.inc"), AllOf(HasSubstr("cycle.inc:1"), HasSubstr("a cycle")));
  EXPECT_THAT(fault(".include /etc/passwd"), HasSubstr("relative"));
  EXPECT_THAT(fault(".include ../../etc/passwd"), HasSubstr("not below the folder"));
  EXPECT_THAT(fault(".include nix.inc"), AllOf(HasSubstr("a.cir:2"), HasSubstr("nix.inc")));
  EXPECT_THAT(fault(".lib lib.lib three"), HasSubstr("no section"));
  EXPECT_THAT(Fault(".include r.inc\n"), HasSubstr("standard input"));
}

}  // namespace
}  // namespace dlcs::client
