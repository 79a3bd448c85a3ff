// SPDX-License-Identifier: Apache-2.0
// Decks, solved by the program: closed forms, balance of power, the certificate.
#include "client/netlist/netlist.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "client/netlist/deck_lines.h"
#include "tests/client/cli/program.h"
#include "tests/client/netlist/deck_file.h"
#include "tests/support/paths.h"

namespace dlcs::client {
namespace {

using dlcs::testing::ProjectPath;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

nlohmann::json Solved(const std::string& lines, const std::string& options) {
  const ProgramOutcome outcome = RunDlcs("solve " + WriteDeck(lines) + " --format json --quiet " + options);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  const auto result = nlohmann::json::parse(outcome.out, nullptr, false);
  return result.is_object() ? result : nlohmann::json::object();
}

std::string Refused(const std::string& lines) {
  const ProgramOutcome outcome = RunDlcs("solve " + WriteDeck(lines) + " --quiet");
  EXPECT_EQ(outcome.code, 2) << outcome.out;
  return outcome.err;
}

double Last(const nlohmann::json& result, const std::string& output) {
  return result["outputs"][output].back().get<double>();
}

// KiCad calls a net that nobody named after a pin of it, Net-(C1-+). It is read wherever a node may stand, and a
// parenthesis behind a minus sign still opens an expression.
TEST(NetlistTest, TakesNetsOfKiCadWithParentheses) {
  const auto values = [](const std::string& n) {
    const auto result =
        Solved("V1 /in 0 10\nR1 /in " + n + " 1k\nC1 " + n + " 0 1u\n.ic V(" + n + ")=2\n" + "B1 b 0 V=3-(V(" + n +
                   ")-V(/in,+5V))\nR2 b 0 1k\nE1 e 0 " + n + " 0 0.5\nR3 e 0 1k\n" +
                   "V2 +5V 0 5\n.subckt half a b\nR1 a b 1k\n.ends\nX1 e " + n + " half\n" + ".tran 1u 2m\n.print V(" +
                   n + ") V(" + n + ",/in) V(b) V(e) V(+5V)\n" + ".meas tran mean AVG V(" + n + ") FROM=0 TO=1m\n",
               "--tolerance 1e-10 --at 0.5m,2m");
    std::map<std::string, std::vector<double>> outputs;
    for (const auto& [name, numbers] : result["outputs"].items()) {
      const std::size_t at = Lower(name).find(Lower(n));
      outputs[at == std::string::npos ? name : Lower(name).replace(at, n.size(), "<net>")] =
          numbers.get<std::vector<double>>();
    }
    return outputs;
  };
  const auto plain = values("Net_C1");
  EXPECT_EQ(plain.size(), 5u);
  for (const char* net : {"Net-(C1-+)", "Net-(U1-Pad3)", "unconnected-(U1-Pad5)", "/amp/Net-(R1-Pad1)_2"}) {
    EXPECT_EQ(values(net), plain) << net;
  }
}

TEST(NetlistTest, AResistorAndACapacitorChargeExponentially) {
  const auto result =
      Solved("V1 in 0 10\nR1 in out 1k\nC1 out 0 1u IC=0\n.tran 1u 2m uic\n", "--tolerance 1e-10 --at 2e-3");
  EXPECT_NEAR(Last(result, "v(out)"), 10 * (1 - std::exp(-2.0)), 1e-8);
  EXPECT_NEAR(Last(result, "i(R1)"), 0.01 * std::exp(-2.0), 1e-11);
  EXPECT_NEAR(Last(result, "i(V1)"), -0.01 * std::exp(-2.0), 1e-11);
}

// The inductor in series with the diode rests without current, but for rounding: not with a reverse one.
TEST(NetlistTest, AnInductorInSeriesWithADiodeThatBlocksStartsWithoutCurrent) {
  const auto result = Solved(
      "V1 vcc 0 100\nL1 vcc d 1m\nD1 d f DM\nL2 f vcc 100n\nL3 d d1 50n\nS1 d1 0 g 0 SM\nR1 d1 sn 10\nC1 sn 0 2.2n\n"
      "C2 d1 0 200p\nV2 g 0 PULSE(0 10 1u 10n 10n 20u 40u)\n.model SM SW(RON=0.05 ROFF=10meg VT=5 VH=1)\n"
      ".model DM D(IS=1e-12 RS=20m)\n.tran 2n 90u\n",
      "--at 2e-5");
  // L1 has 100 V for 19 us, less the drop across the switch.
  EXPECT_NEAR(Last(result, "i(L1)"), 1.9, 0.01);
}

// The sources feed themselves: a winding of the wrong sense.
TEST(NetlistTest, WhatIsNotSolvedIsNotMeasured) {
  const ProgramOutcome outcome = RunDlcs(
      "solve " + WriteDeck("V1 in 0 100\nL1 in p 500u\nE1 sx 0 in p 0.1\nF1 p in V2 0.1\nV2 sx s 0\nS1 p 0 g 0 SW\n"
                           "V3 g 0 PULSE(0 1 0 20n 20n 4u 10u)\nD1 p c DX\nC1 c 0 22n IC=100\nR1 c in 5k\nD2 s out DX\n"
                           "C2 out 0 100u IC=5\nR2 out 0 1\n.model SW SW(RON=0.1 ROFF=1e5 VT=0.5)\n"
                           ".model DX D(IS=1e-9 RS=5m)\n.tran 20n 2m uic\n.meas tran mean AVG V(out)\n"));
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.out,
              AllOf(HasSubstr("stopped before it was measured"), Not(HasSubstr("ask for no output times"))));
}

// A choice between numbers by one comparison is a comparator, in whatever form it is written.
TEST(NetlistTest, AChoiceByAComparisonFollowsItsVoltage) {
  for (const char* value : {"if(V(a)>0.5, 5, 0)", "V(a)>0.5 ? 5 : 0", "(5*(V(a)>0.5))", "limit(10*(V(a)>0.5), 0, 5)"}) {
    const auto result = Solved(fmt::format("V1 a 0 SIN(0 1 1k)\nB1 o 0 V={{{}}}\nR1 o 0 1k\n.tran 1u 1m\n"
                                           ".meas tran mean AVG V(o)\n",
                                           value),
                               "--at 2.5e-4,7.5e-4");
    EXPECT_NEAR(result["outputs"]["v(o)"][0].get<double>(), 5, 1e-9) << value;
    EXPECT_NEAR(Last(result, "v(o)"), 0, 1e-9) << value;
  }
}

// A capacitor at 126 V that sources of 1 V do not explain: an inductor charged it. 252 A flow when the switch closes.
constexpr const char* kBoosted =
    "V1 a 0 1\nL1 a b 1m\nS1 b 0 g 0 SX\nC1 b 0 100p\nRb b 0 10meg\nVg g 0 PULSE(1 0 40u 1n 1n 2.5u)\n"
    ".model SX SW(RON=0.5 VT=0.5)\n.tran 0.1u 50u uic\n.print v(b) i(S1)\n.meas tran most MAX i(S1)\n";

TEST(NetlistTest, ASwitchThatInductorsDriveBeyondItsLimitIsSolvedOnceMore) {
  const std::string deck = WriteDeck(kBoosted);
  const ProgramOutcome once = RunDlcs("solve " + deck + " --tolerance 1e-7 --at 5e-5 --format csv");
  EXPECT_EQ(once.code, 0) << once.err;
  EXPECT_THAT(once.err, HasSubstr("solved once more, with 100 times that current"));
  EXPECT_EQ(once.out.find("t,"), once.out.rfind("t,"));  // one answer
  // What the problem file has is solved as it is.
  const std::string file = ::testing::TempDir() + "boosted.json";
  EXPECT_EQ(RunDlcs("netlist " + deck + " --output " + file + " --quiet").code, 0);
  const ProgramOutcome as_it_is = RunDlcs("solve " + file + " --tolerance 1e-7 --at 5e-5 --format csv");
  EXPECT_EQ(as_it_is.code, 1);
  EXPECT_THAT(as_it_is.err, HasSubstr("i(S1) reaches its limit 8 at"));
  EXPECT_EQ(RunDlcs("netlist " + deck + " --current-limit 1000 --output " + file + " --quiet").code, 0);
  const ProgramOutcome raised = RunDlcs("solve " + file + " --tolerance 1e-7 --at 5e-5 --format csv");
  EXPECT_EQ(raised.code, 0) << raised.err;
  std::remove(file.c_str());
}

// A relaxation oscillator: 100 uA charge the capacitor, which the switch then discharges with 5 A, a number that no
// source explains.
TEST(NetlistTest, ASwitchThatACapacitorDrivesBeyondItsLimitIsSolvedWithHigherOnes) {
  const auto result = Solved(
      "I1 0 1 100u\nC1 1 0 1n\nS1 1 0 1 0 SX\n.model SX SW(VT=2.5 VH=2.475 RON=1 ROFF=10meg)\n.tran 1u 200u uic\n"
      ".meas tran rise WHEN V(1)=3 RISE=1\n.meas tran period TRIG V(1)=3 RISE=1 TARG V(1)=3 RISE=2\n"
      ".meas tran most MAX V(1)\n",
      "--tolerance 1e-8");
  std::map<std::string, double> measured;
  for (const auto& one : result["summary"]["measurements"]) measured[one["name"]] = one["value"].get<double>();
  // To 1000 V with 10 ms, from 0.025 V or 0; down with 1 ns, to 0.1 mV.
  const auto charging = [](double from, double to) { return 0.01 * std::log((1000 - from) / (1000 - to)); };
  EXPECT_NEAR(measured["rise"], charging(0, 3), 1e-12);
  EXPECT_NEAR(measured["period"], charging(0.025, 4.975) + 1e-9 * std::log((4.975 - 1e-4) / (0.025 - 1e-4)), 1e-12);
  EXPECT_NEAR(measured["most"], 4.975, 1e-6);
}

TEST(NetlistTest, AClosedSwitchHasItsOnResistanceAndADiodeToo) {
  const auto result = Solved(
      "V1 a 0 2\nVg g 0 PULSE(0 1 0.5m 1u 1u 1m 2m)\nR1 a b 10k\nS1 b 0 g 0 SX\n.model SX SW(RON=1k ROFF=10k VT=0.5)\n"
      "R2 a c 1k\nD2 c 0 DX\n.model DX D(VFWD=0.5 RON=250 ROFF=1k)\nR3 a d 1k\nD3 0 d DX\n.tran 1u 1m\n",
      "--tolerance 1e-10 --at 0.2e-3,1e-3");
  EXPECT_NEAR(result["outputs"]["v(b)"][0].get<double>(), 1, 1e-9);
  EXPECT_NEAR(Last(result, "v(b)"), 2.0 / 11, 1e-9);
  EXPECT_NEAR(Last(result, "v(c)"), 0.7, 1e-9);  // 1.3 mA = 0.5 V/1 kohm + 0.2 V/250 ohm
  EXPECT_NEAR(Last(result, "v(d)"), 1, 1e-9);
}

// The gate rests at 0 V, which is the threshold where .model says nothing: open, by sources and by comparators.
TEST(NetlistTest, ASwitchIsOpenAtItsThreshold) {
  const auto result = Solved(
      "V1 a 0 10\nVs s 0 PULSE(0 1 0.2m 1u 1u 0.2m 1)\nVt t 0 PULSE(-1 1 0 50u 50u 1n 0.1m)\n"
      "B1 g 0 V = V(s) > V(t) ? 1 : 0\nR1 a b 1k\nS1 b c g 0 SX\nRc c 0 1k\nB2 u 0 V = V(c) > 1 ? 1 : 0\nR2 a d 1k\n"
      "S2 d 0 u 0 SX\nR3 a e 1k\nS3 e 0 s 0 SX\n.model SX SW(RON=1)\n.tran 1u 1m\n",
      "--tolerance 1e-8 --at 0.3e-3,0.501e-3,0.551e-3");
  const auto at = [&result](const char* output, int k) { return result["outputs"][output][k].get<double>(); };
  EXPECT_NEAR(at("v(c)", 0), 10 * 1000.0 / 2001, 1e-7);
  EXPECT_NEAR(at("v(d)", 0), 10 / 1001.0, 1e-7);
  EXPECT_NEAR(at("v(e)", 0), 10 / 1001.0, 1e-7);
  EXPECT_NEAR(at("v(c)", 1), 10 * 1000.0 / 2001, 1e-7);  // the carrier is low
  EXPECT_NEAR(at("v(c)", 2), 0, 1e-7);                   // and high
  EXPECT_NEAR(at("v(d)", 2), 10, 1e-6);
  EXPECT_NEAR(at("v(e)", 2), 10, 1e-6);
}

TEST(NetlistTest, SourcesRepeatAndFollowFormulasOfTime) {
  // The same triangle in four ways.
  const auto result = Solved(
      "V2 b 0 PWL(0 0 1u 1 2u 0) r=0\nV3 c 0 PWL REPEAT FOREVER (0 0 1u 1 2u 0) ENDREPEAT\n"
      "V4 d 0 PWL REPEAT FOR 10 (0 0 1u 1 2u 0) ENDREPEAT\nB5 e 0 V=1-abs(2*(time/2u - floor(time/2u)) - 1)\n"
      "R2 b rb 1k\nC2 rb 0 1n\nR3 c rc 1k\nC3 rc 0 1n\nR4 d rd 1k\nC4 rd 0 1n\n"
      "R5 e re 1k\nC5 re 0 1n\n.tran 0.1u 11.3u uic\n",
      "--tolerance 1e-9 --at 11.3e-6");
  for (const char* node : {"v(rb)", "v(rc)", "v(re)"}) {
    EXPECT_NEAR(Last(result, node), Last(result, "v(rd)"), 1e-8) << node;
  }
  const auto ended =
      Solved("V1 a 0 PULSE(0 1 0 0.9u 0.9u 0.2u 2u 3)\nR1 a 0 1\nL1 a b 1u\nR2 b 0 1\n.tran 0.1u 20u uic\n",
             "--tolerance 1e-9 --at 6e-6,20e-6");
  EXPECT_EQ(Last(ended, "v(a)"), 0);
  EXPECT_NEAR(Last(ended, "i(L1)"), ended["outputs"]["i(L1)"][0].get<double>() * std::exp(-14.0), 1e-9);
}

TEST(NetlistTest, AnOffResistanceBesideAnInductorIsAFastStateAndNoObstacle) {
  // A buck converter in discontinuous conduction, and a rectifier whose diode begins to conduct at the leak.
  const auto buck = Solved(
      "Vin in 0 24\nVg g 0 PULSE(0 5 0 10n 10n 9.99u 20u)\nS1 in sw g 0 SX\nSD1 0 sw 0 sw SD\nL1 sw out 47u\n"
      "C1 out 0 100u\nR1 out 0 10\n.model SX SW(RON=0.01 ROFF=1meg VT=2.5 VH=0.5)\n"
      ".model SD SW(RON=0.01 ROFF=1meg VT=0)\n.tran 0.1u 20m\n.print v(out)\n",
      "--tolerance 1e-8 --at 0.02");
  EXPECT_EQ(buck["summary"]["method"], "METHOD_EVENT_DRIVEN");
  EXPECT_EQ(buck["summary"]["cost"]["coupled_steps"], 0);
  const auto leaky = Solved(
      "V1 in 0 SIN(0 325 50)\nD1 in x DX\nS1 x out g 0 SG\nR1 out z 10\nL1 z 0 10m\nDf 0 out DX\n"
      "Vg g 0 PULSE(0 1 2.5m 10u 10u 100u 20m)\n.model SG SW(VT=0.5 RON=10m ROFF=10meg)\n"
      ".model DX D(VFWD=0.7 RON=10m)\n.tran 10u 60m uic\n.print i(L1)\n",
      "--tolerance 1e-6 --at 0.06");
  EXPECT_EQ(leaky["summary"]["method"], "METHOD_EVENT_DRIVEN");
}

TEST(NetlistTest, AThyristorOfSwitchesFiresInEveryPeriod) {
  // W1 keeps what S1 began until its own current has gone.
  const auto result = Solved(
      "V1 in 0 SIN(0 325 50)\n.subckt SCR a k g\nD1 a x DX\nVm x y 0\nW1 y k Vm WL\nS1 y k g k SG\n"
      ".model WL CSW(It=0.02 Ih=0.01 Ron=10m Roff=10Meg)\n.model SG SW(Vt=1 Ron=10m Roff=10Meg)\n"
      ".model DX D(Vfwd=0.7 Ron=10m)\n.ends\nX1 in out gt SCR\nRg gt out 1k\n"
      "Ig out gt PULSE(0 10m 2.5m 10u 10u 100u 20m)\nRl out z 10\nLl z 0 10m\nDfw 0 out DF\n"
      ".model DF D(Vfwd=0.7 Ron=10m)\n.tran 10u 60m uic\n.print i(Ll)\n"
      ".meas tran first MAX i(Ll) FROM=0 TO=20m\n.meas tran third MAX i(Ll) FROM=40m TO=60m\n",
      "--tolerance 1e-6 --at 0.06");
  const auto& measured = result["summary"]["measurements"];
  ASSERT_EQ(measured.size(), 2u);
  EXPECT_GT(measured[0]["value"].get<double>(), 25);
  EXPECT_NEAR(measured[0]["value"].get<double>(), measured[1]["value"].get<double>(), 1e-4);
}

// A phase that does not conduct leaves two algebraic rows that differ in its current alone.
TEST(NetlistTest, AThreePhaseRectifierBehindInductancesHasNoCoupledSteps) {
  const auto result = Solved(
      "Va a1 0 SIN(0 325 50 0 0 0)\nVb b1 0 SIN(0 325 50 0 0 -120)\nVc c1 0 SIN(0 325 50 0 0 -240)\nLa a1 a 1m\n"
      "Lb b1 b 1m\nLc c1 c 1m\nD1 a p D\nD3 b p D\nD5 c p D\nD4 n a D\nD6 n b D\nD2 n c D\nR1 p q 10\nL1 q n 20m\n"
      "Rn n 0 1Meg\n.model D D(VFWD=0.03 RON=11m)\n.tran 10u 80m uic\n"
      ".meas tran mean AVG i(L1) FROM=60m TO=80m\n.meas tran volts AVG v(p,n) FROM=60m TO=80m\n",
      "--at 0.08");
  EXPECT_EQ(result["summary"]["verdict"]["kind"], "VERDICT_KIND_SOLVED");
  EXPECT_EQ(result["summary"]["method"], "METHOD_EVENT_DRIVEN");
  EXPECT_EQ(result["summary"]["cost"]["coupled_steps"], 0);
  const double amperes = result["summary"]["measurements"][0]["value"],
               volts = result["summary"]["measurements"][1]["value"];
  EXPECT_NEAR(volts, 10 * amperes, 0.01 * volts);
  // With a direct current each of six commutations a period takes L I from the integral of the voltage.
  const double pi = std::numbers::pi;
  EXPECT_NEAR(volts, 3 * std::sqrt(3) * 325 / pi - 6 * 50 * 1e-3 * amperes - 2 * (0.03 + 0.011 * amperes), 0.5);
}

// Both take the same current, however stiff the rest is: 10 kohm beside 20 mohm, and a switch whose model has 200 kV.
TEST(NetlistTest, EqualDiodesInParallelShareACurrentBesideAHighResistance) {
  const auto result = Solved(
      "V1 n1 0 SIN(2 8 3k 0 0 30)\nVg g 0 PULSE(0 1 20u 1u 1u 80u 190u)\nC1 n2 0 0.1284u\nR1 n3 n1 381.3\n"
      "L1 n4 n2 764u\nC2 n5 n1 2.726u\nD1 0 n4 DX\nR2 0 n2 238.8\nD2 n1 n5 DX\nD3 0 n4 DX\nL2 n3 n4 65.7u\n"
      "S1 n5 n4 g 0 SX\nRk2 n2 0 10k\nRk3 n3 0 100k\nRk4 n4 0 10k\nRk5 n5 0 10k\nK1 L1 L2 0.94\n"
      ".model DX D(VFWD=0.01 RON=0.02)\n.model SX SW(RON=1 ROFF=1Meg VT=0.5)\n.tran 10u 2m uic\n"
      ".print i(D1) i(D3)\n",
      "--at 0.000222,0.000227,0.002");
  EXPECT_EQ(result["summary"]["verdict"]["kind"], "VERDICT_KIND_SOLVED");
  EXPECT_EQ(result["summary"]["cost"]["coupled_steps"], 0);
  for (const std::size_t k : {0u, 1u}) {
    const double current = result["outputs"]["i(D1)"][k];
    EXPECT_GT(current, 1e-3);
    EXPECT_NEAR(current, result["outputs"]["i(D3)"][k].get<double>(), 1e-6 * current);
  }
}

// At 308 us the voltage across S2, which is open, changes its sign. That is no reason for Sc to open: its control is in
// the middle of the hysteresis then.
TEST(NetlistTest, ASwitchKeepsItsStateInTheHysteresisWhateverElseTurns) {
  const std::string circuit =
      "V1 n1 0 PULSE(-5 10 0 5u 5u 300u 700u)\nVg g 0 PULSE(0 1 20u 1u 1u 80u 190u)\nD1 n2 0 DX\nS1 n3 n2 g 0 SX\n"
      "S2 n3 n1 g 0 SX\nL1 0 n3 0.007501\nR1 n3 n1 8.927\nRk2 n2 0 100k\nRk3 n3 0 100k\nRc0 n3 c0 1k\nCc0 c0 0 10n\n"
      "Bc o0 0 V = V(c0) > -1.86 ? 4 : -2\nRo0 o0 n2 330\nRc1 n2 c1 1k\nCc1 c1 0 10n\nSc n3 0 c1 0 SH\n"
      ".model SH SW(RON=1 ROFF=1Meg VT=1.06 VH=0.375)\n.model DX D(VFWD=0.7 RON=0.1)\n"
      ".model SX SW(RON=0.1 ROFF=1Meg VT=0.5)\n.tran 10u 2m uic\n.print v(c1) v(n3) i(Sc)\n";
  for (const char* options : {"", "--tolerance 1e-6 ", "--tolerance 1e-8 "}) {
    const auto result = Solved(circuit, std::string(options) + "--at 3.09e-4,3.5e-4");
    for (const std::size_t k : {0u, 1u}) {
      EXPECT_GT(result["outputs"]["v(c1)"][k], 0.7) << options;
      EXPECT_NEAR(result["outputs"]["i(Sc)"][k].get<double>(), result["outputs"]["v(n3)"][k].get<double>(), 1e-5);
    }
  }
}

// Open switches of 1 Mohm beside closed ones of 1 ohm: voltages are what is left of terms 1e12 times their size. The
// on-resistances are 1 or 0.1 ohm in parallel with the off-resistance: with others the same terms cancel elsewhere.
TEST(NetlistTest, PassesHysteresisWhereLargeTermsCancel) {
  const std::string switches =
      "V1 n1 0 PULSE(-5 10 0 5u 5u 300u 700u)\nVg g 0 PULSE(0 1 20u 1u 1u 80u 190u)\nS1 n2 n1 g 0 SX\n"
      "L1 n3 n2 0.0004331\nS2 0 n3 g 0 SX\nRk2 n2 0 10k\nRk3 n3 0 10k\nRc0 n3 c0 1k\nSc0 n2 0 c0 0 SH0\n"
      ".model SH0 SW(RON={1/(1+1u)} ROFF=1Meg VT=-1.64 VH=0.71)\nRc1 n3 c1 1k\nBc1 o1 0 V = limit(33.2*V(c1),-3,3)\n"
      "Ro1 o1 n2 330\n.model SX SW(RON={1/(1+1u)} ROFF=1Meg VT=0.5)\n.tran 10u 2m uic\n.print v(n2) v(n3)\n";
  const auto by_switches = Solved(switches, "--at 5e-4,1e-3,1.5e-3,1.9e-3");
  // By ngspice with steps of 20 ns.
  constexpr double kSwitches[] = {-2.81319, 4.83517, 1.10788e-5, -2.81319};
  const std::string capacitors =
      "V1 n1 0 SIN(0 10 1k)\nVg g 0 PULSE(0 1 20u 1u 1u 80u 190u)\nC1 n3 n2 7.587e-06\nS1 n3 n1 g 0 SX\n"
      "Rk2 n2 0 100k\nRk3 n3 0 100k\nRc0 n3 c0 1k\nCc0 c0 0 10n\nRc1 n3 c1 1k\nCc1 c1 0 10n\n"
      "Sc1 n2 0 c1 0 SH1\n.model SH1 SW(RON={1/(1+1u)} ROFF=1Meg VT=-1.8 VH=0.833)\n"
      ".model SX SW(RON={1/(1+1u)} ROFF=1Meg VT=0.5)\n.tran 10u 2m uic\n.print v(n2) v(n3)\n";
  const auto by_capacitors = Solved(capacitors, "--at 5e-4,1e-3,1.5e-3,1.9e-3");
  constexpr double kCapacitors[] = {2.104881, -1.49707, 5.000244, -8.68589};
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(by_switches["outputs"]["v(n2)"][k].get<double>(), kSwitches[k], 5e-4);
    EXPECT_NEAR(by_capacitors["outputs"]["v(n3)"][k].get<double>(), kCapacitors[k], 5e-3);
  }
  const std::string circuits[] = {
      "V1 n1 0 SIN(2 8 3k 0 0 30)\nVg g 0 PULSE(0 1 20u 1u 1u 80u 190u)\nD1 n2 0 DX\nC1 n3 n1 5.019e-06\n"
      "S1 n1 n2 g 0 SX\nC2 n2 n3 4.103e-07\nC3 n3 n1 5.586e-06\nCc0 c0 0 100n\nSc0 n3 0 c0 0 SH0\n"
      ".model SH0 SW(RON={1/(1+1u)} ROFF=1Meg VT=0.0987 VH=0.374)\n.model DX D(VFWD=0.7 RON=0.02)\n"
      ".model SX SW(RON={0.1/(1+0.1u)} ROFF=1Meg VT=0.5)\n.tran 10u 2m uic\n.print v(n2) v(n3)\n",
      "V1 n1 0 SIN(0 10 1k)\nVg g 0 PULSE(0 1 20u 1u 1u 80u 190u)\nD2 n4 0 DX\nD3 n2 n4 DX\nD5 0 n3 DX\n"
      "S1 n1 n3 g 0 SX\nL4 n3 n2 0.0002967\nRk4 n4 0 10k\nRc0 n4 c0 1k\nSc0 n3 0 c0 0 SH0\n"
      ".model SH0 SW(RON={1/(1+1u)} ROFF=1Meg VT=-0.375 VH=0.278)\nRc1 n3 c1 1k\nCc1 c1 0 100n\n"
      ".model DX D(VFWD=0.5 RON=0.02)\n.model SX SW(RON={0.1/(1+0.1u)} ROFF=1Meg VT=0.5)\n.tran 10u 2m uic\n"
      ".print v(n2) v(n3)\n",
      "V1 n1 0 SIN(0 10 1k)\nVg g 0 PULSE(0 1 20u 1u 1u 80u 190u)\nD1 n2 0 DX\nD2 n3 n2 DX\nS1 n4 n1 g 0 SX\n"
      "D3 n5 n4 DX\nC1 n4 n3 3.787e-08\nR1 n5 n4 365.2\nR2 n4 n2 678.1\nS2 n3 n5 g 0 SX\nR3 n2 n4 10.83\n"
      "D4 n2 n3 DX\nC2 0 n4 3.959e-08\nR4 n2 n1 3.806\nD5 n5 n4 DX\nD6 n3 n5 DX\nC3 n2 n4 3.634e-06\n"
      "L1 n2 0 0.0001574\nRk2 n2 0 10k\nRk3 n3 0 10k\nRk4 n4 0 100k\nRk5 n5 0 10k\nRc0 n3 c0 1k\nCc0 c0 0 10n\n"
      "Sc0 n2 0 c0 0 SH0\n.model SH0 SW(RON={1/(1+1u)} ROFF=1Meg VT=0.5 VH=0.494)\nRc1 n4 c1 1k\nCc1 c1 0 100n\n"
      "Bc1 o1 0 V = limit(48.6*V(c1),-3,3)\nRo1 o1 n2 330\n.model DX D(VFWD=0.01 RON=0.02)\n"
      ".model SX SW(RON={0.1/(1+0.1u)} ROFF=1Meg VT=0.5)\n.tran 10u 2m uic\n.print v(n2) v(n3) v(n4) v(n5)\n",
      "V1 n1 0 PULSE(-5 10 0 5u 5u 300u 700u)\nVg g 0 PULSE(0 1 20u 1u 1u 80u 190u)\nL1 n2 0 0.001412\n"
      "D1 n3 n1 DX\nS1 n4 n3 g 0 SX\nD2 n3 n2 DX\nL2 n3 0 5.036e-05\nC1 n4 n2 3.537e-08\nS2 n2 n1 g 0 SX\n"
      "Rk2 n2 0 10k\nRk3 n3 0 100k\nRk4 n4 0 100k\nK1 L1 L2 0.89\nRc0 n3 c0 1k\nCc0 c0 0 10n\n"
      "Bc0 o0 0 V = V(c0) > -0.984 ? 4 : -2\nRo0 o0 n2 330\n.model DX D(VFWD=0.5 RON=0.1)\n"
      ".model SX SW(RON={1/(1+1u)} ROFF=1Meg VT=0.5)\n.tran 10u 2m uic\n.print v(n2) v(n3) v(n4)\n",
      "V1 n1 0 PULSE(-5 10 0 5u 5u 300u 700u)\nVg g 0 PULSE(0 1 20u 1u 1u 80u 190u)\nD1 n2 n1 DX\n"
      "S1 n3 n2 g 0 SX\nR1 n4 n3 75.82\nL1 n3 n2 0.009207\nC1 n2 n3 2.606e-06\nS2 n2 n3 g 0 SX\n"
      "R2 n3 n4 823.7\nS3 n1 n3 g 0 SX\nS4 n1 n3 g 0 SX\nD2 0 n3 DX\nRk2 n2 0 100k\nRk3 n3 0 100k\n"
      "Rk4 n4 0 100k\nRc0 n2 c0 1k\nCc0 c0 0 100n\nSc0 n3 0 c0 0 SH0\n"
      ".model SH0 SW(RON={1/(1+1u)} ROFF=1Meg VT=0.108 VH=0.453)\n.model DX D(VFWD=0.5 RON=0.02)\n"
      ".model SX SW(RON={0.1/(1+0.1u)} ROFF=1Meg VT=0.5)\n.tran 10u 2m uic\n.print v(n2) v(n3) v(n4)\n",
      "V1 n1 0 SIN(2 8 3k 0 0 30)\nVg g 0 PULSE(0 1 20u 1u 1u 80u 190u)\nS1 n2 0 g 0 SX\nL1 n3 n1 0.001001\n"
      "R1 n4 n1 136.6\nR2 n5 0 253.8\nD1 n2 n1 DX\nD2 n1 n5 DX\nC1 n5 n3 5.52e-08\nR3 n3 n2 2.234\nD3 0 n2 DX\n"
      "D4 n1 n4 DX\nR4 n4 n1 5.797\nS2 0 n3 g 0 SX\nRk2 n2 0 100k\nRk3 n3 0 100k\nRk4 n4 0 100k\nRk5 n5 0 10k\n"
      "E1 e 0 n5 0 -2.33\nRe e n2 470\nRc0 n5 c0 1k\nCc0 c0 0 100n\nBc0 o0 0 V = limit(21*V(c0),-3,3)\n"
      "Ro0 o0 n4 330\nRc1 n4 c1 1k\nCc1 c1 0 10n\nSc1 n3 0 c1 0 SH1\n"
      ".model SH1 SW(RON={1/(1+1u)} ROFF=1Meg VT=-0.834 VH=0.572)\n.model DX D(VFWD=0.7 RON=0.02)\n"
      ".model SX SW(RON={0.1/(1+0.1u)} ROFF=1Meg VT=0.5)\n.tran 10u 2m uic\n.print v(n2) v(n3) v(n4) v(n5)\n",
      "V1 n1 0 SIN(2 8 3k 0 0 30)\nVg g 0 PULSE(0 1 20u 1u 1u 80u 190u)\nR1 n2 n1 10.37\nR2 n1 n2 190.9\n"
      "S1 n2 0 g 0 SX\nL1 0 n2 0.001007\nRk2 n2 0 10k\nRc0 n1 c0 1k\nCc0 c0 0 10n\nSc0 n2 0 c0 0 SH0\n"
      ".model SH0 SW(RON={1/(1+1u)} ROFF=1Meg VT=0.184 VH=0.119)\n.model DX D(VFWD=0.5 RON=1)\n"
      ".model SX SW(RON={0.1/(1+0.1u)} ROFF=1Meg VT=0.5)\n.tran 10u 2m uic\n.print v(n2)\n"};
  for (const std::string& circuit : circuits) {
    const auto coarse = Solved(circuit, "--tolerance 1e-5 --at 1e-3,2e-3");
    // Pairs with steep characteristics leave 3e-7 V of the voltages unknown.
    const auto fine = Solved(circuit, "--tolerance 1e-8 --absolute-tolerance 1e-6 --at 1e-3,2e-3");
    for (const auto& [name, values] : fine["outputs"].items()) {
      for (std::size_t k = 0; k < 2; ++k) {
        EXPECT_NEAR(coarse["outputs"][name][k].get<double>(), values[k].get<double>(), 1e-4) << name << "\n" << circuit;
      }
    }
  }
}

// "v_C1=1e-06" of absolute tolerances, sorted by name.
std::vector<std::string> AbsoluteIn(const v1::SolveOptions& options) {
  std::vector<std::string> given;
  for (const v1::ComponentTolerance& one : options.absolute_tolerances()) {
    given.push_back(fmt::format("{}={}", one.name(), one.tolerance()));
  }
  std::ranges::sort(given);
  return given;
}

TEST(NetlistTest, TolerancesOfADeckAreThoseOfItsVoltagesAndCurrents) {
  const auto read = [](const std::string& options, const std::string& print) {
    return ReadNetlist("title\nV1 in 0 10\nR1 in a 1k\nC1 a 0 1u\nL1 a b 1m\nD1 b c D\nR2 c 0 10\n" + options + print +
                           ".model D D\n.tran 1u 1m uic\n",
                       "a.cir", "", {});
  };
  const std::string print = ".print v(a) v(a,b) i(L1) {2*v(a)} {v(a)-v(b)} {v(a)+1e3*i(L1)} {i(R1)-i(R2)}\n";
  const auto netlist = read(".options reltol=1e-8 abstol=1p vntol=1u\n", print);
  ASSERT_TRUE(netlist.ok()) << netlist.status();
  EXPECT_EQ(netlist->tolerances.error_tolerance(), 1e-8);
  const std::vector<std::string> of_deck = {"i(L1)=1e-12", "i_L1=1e-12",          "v(a)=1e-06",       "v(a,b)=1e-06",
                                            "v_C1=1e-06",  "{i(R1)-i(R2)}=1e-12", "{v(a)-v(b)}=1e-06"};
  EXPECT_EQ(AbsoluteIn(netlist->tolerances), of_deck);
  const auto with = [&](const v1::SolveOptions& options) {
    return WithTolerances(options, netlist->tolerances, netlist->problem);
  };
  EXPECT_EQ(with({}).error_tolerance(), 1e-8);
  EXPECT_EQ(AbsoluteIn(with({})), of_deck);
  v1::SolveOptions own;
  own.set_error_tolerance(1e-4);
  v1::ComponentTolerance& voltage = *own.add_absolute_tolerances();
  voltage.set_name("x1");  // of v_C1
  voltage.set_tolerance(0.5);
  EXPECT_EQ(with(own).error_tolerance(), 1e-4);
  EXPECT_THAT(AbsoluteIn(with(own)),
              AllOf(Contains("x1=0.5"), Contains("i_L1=1e-12"), Not(Contains(HasSubstr("v_C1")))));
  // A number is for all components, and steps are an own accuracy.
  own.set_absolute_tolerance(1e-3);
  own.clear_error_tolerance();
  own.set_steps(100);
  EXPECT_THAT(AbsoluteIn(with(own)), ElementsAre("x1=0.5"));
  EXPECT_EQ(with(own).error_tolerance(), 0);

  const auto vntol_alone = read(".options vntol=1u\n", print);
  ASSERT_TRUE(vntol_alone.ok()) << vntol_alone.status();
  EXPECT_EQ(vntol_alone->tolerances.error_tolerance(), 0);
  EXPECT_THAT(AbsoluteIn(vntol_alone->tolerances), Not(Contains(HasSubstr("i(L1)"))));
  const auto none = read("", print);
  ASSERT_TRUE(none.ok()) << none.status();
  EXPECT_EQ(none->tolerances.ByteSizeLong(), 0u);
}

// 1 mH and 1 uF ring 1,000 times: of 1e-12 of their voltage and current, rounding leaves nothing.
TEST(NetlistTest, SolvesWithTheTolerancesOfTheDeck) {
  const auto outcome = [](const std::string& deck, const std::string& command) {
    return RunDlcs("solve " + WriteDeck(deck + "L1 a 0 1m\nC1 a 0 1u IC=5\n.tran 1u 0.2 uic\n.print v(a) i(L1)\n") +
                   " --at 0.2 " + command);
  };
  const std::string reltol = ".options reltol=1e-12\n", both = ".options vntol=1n abstol=1p\n";
  const ProgramOutcome missed = outcome(reltol, "");
  EXPECT_EQ(missed.code, 1);
  EXPECT_THAT(missed.out, HasSubstr("because of rounding"));
  const ProgramOutcome solved = outcome(reltol + both, "");
  EXPECT_EQ(solved.code, 0) << solved.err;
  EXPECT_THAT(solved.out, HasSubstr("SOLVED within an error of 1e-12"));
  EXPECT_THAT(solved.err, HasSubstr("vntol is --absolute-tolerance 1e-09 V"));
  // Each is of its own unit, and what the command line gives takes the place of it.
  EXPECT_EQ(outcome(reltol + ".options vntol=1n\n", "").code, 1);
  EXPECT_EQ(outcome(reltol + both, "--absolute-tolerance 'v(a)=1e-15'").code, 1);
  EXPECT_EQ(outcome(reltol, "--absolute-tolerance 1e-9").code, 0);
  EXPECT_THAT(outcome(reltol, "--tolerance 1e-9").out, HasSubstr("SOLVED within an error of 1e-09"));
  EXPECT_THAT(outcome("", "").out, HasSubstr("SOLVED within an error of 1e-06 (the default)"));
  EXPECT_THAT(outcome(reltol, "--steps 100000 --method exponential-integrator").out,
              HasSubstr("reached T, estimated error"));
}

TEST(NetlistTest, SaysWhatSlides) {
  // The switch would keep the capacitor at its threshold, which 10 V over 1 kohm reach after RC ln(10/7).
  const std::string circuit = "V1 in 0 10\nR1 in a 1k\nC1 a 0 1u\nS1 a b a 0 SX\nR2 b 0 100\n.tran 10u 5m uic\n";
  const ProgramOutcome slides =
      RunDlcs("solve " + WriteDeck(circuit + ".model SX SW(RON=1 VT=3)\n") + " --at 5e-3 --format json");
  EXPECT_EQ(slides.code, 0) << slides.err;
  EXPECT_THAT(slides.err, HasSubstr("S1 slides from t = 0.000356675 on, for 0.00464 s in all"));
  const auto verdict = nlohmann::json::parse(slides.out)["summary"]["verdict"];
  EXPECT_EQ(verdict["kind"], "VERDICT_KIND_ERROR_ESTIMATED");
  EXPECT_THAT(verdict["text"].get<std::string>(), HasSubstr("reached T: S1 slides"));
  EXPECT_EQ(verdict["concerns"].size(), 1u);

  const auto switches = Solved(circuit + ".model SX SW(RON=1 VT=3 VH=0.5)\n", "--at 5e-3");
  EXPECT_EQ(switches["summary"]["verdict"]["kind"], "VERDICT_KIND_SOLVED");

  // W opens S as soon as it closes, and by that opens itself: its hysteresis is passed at once.
  const std::string loop =
      "V1 a 0 12\nVm a b 0\nS1 b c g 0 SG\nL1 c d 100u\nR1 d 0 0.5\nD1 0 c DX\nW1 g 0 Vm WT\nRg vg g 1k\nV2 vg 0 5\n"
      ".model SG SW(Ron=10m Roff=1Meg Vt=2.5)\n.model WT CSW(It=5 Ih=4.5 Ron=1 Roff=1Meg)\n"
      ".model DX D(Vfwd=0.5 Ron=10m)\n.tran 1u 500u uic\n";
  const ProgramOutcome passed = RunDlcs("solve " + WriteDeck(loop) + " --at 5e-4 --format json");
  EXPECT_EQ(passed.code, 1);
  EXPECT_THAT(passed.err, HasSubstr("W1 slides from t = 0.000101391 on"));
  EXPECT_THAT(passed.err, HasSubstr("Its hysteresis does not allow that"));

  // A comparator too, but no amplifier, which is between its limits all the time.
  const std::string rest = "R1 o a 1k\nC1 a 0 1u\n.tran 10u 5m uic\n";
  const auto comparator = Solved("B1 o 0 V = V(a) > 1 ? -5 : 5\n" + rest, "--at 5e-3");
  EXPECT_THAT(comparator["summary"]["verdict"]["concerns"][0].get<std::string>(),
              HasSubstr("B1 slides from t = 0.000223144 on"));
  const auto amplifier = Solved("B1 o 0 V = limit(1e3*(1 - V(a)), -5, 5)\n" + rest, "--at 5e-3");
  EXPECT_EQ(amplifier["summary"]["verdict"]["kind"], "VERDICT_KIND_SOLVED");
}

// Four diodes that switch 160 times take more than the work of a default solve, but no more than many times of it.
TEST(NetlistTest, ManySwitchingsEndByDefaultToo) {
  const auto result = Solved(
      "V1 in 0 SIN(0 100 10k)\nRs in a 10\nC1 a n1 100n\nD1 0 n1 DM\nD2 n1 n2 DM\nC2 0 n2 100n\nC3 n1 n3 100n\n"
      "D3 n2 n3 DM\nD4 n3 n4 DM\nC4 n2 n4 100n\nRl n4 0 100k\n.model DM D(VFWD=0.6 RON=0.5)\n.tran 1u 6m uic\n"
      ".print v(n4)\n",
      "--at 6e-3");
  EXPECT_EQ(result["summary"]["verdict"]["kind"], "VERDICT_KIND_SOLVED");
  EXPECT_EQ(result["summary"]["accuracy"]["tolerance"], 1e-6);
  EXPECT_GT(result["summary"]["switchings"], 400);
}

TEST(NetlistTest, ASeriesCircuitRings) {
  // 1 mH, 1 uF, 2 ohm from rest on 5 V: v = 5 (1 - e^{-at} (cos wt + a/w sin wt)).
  const auto result =
      Solved("V1 in 0 5\nR1 in a 2\nL1 a out 1m\nC1 out 0 1u\n.tran 1u 1m uic\n", "--tolerance 1e-10 --at 1e-3");
  const double a = 1000, w = std::sqrt(1e9 - a * a), t = 1e-3;
  EXPECT_NEAR(Last(result, "v(out)"), 5 * (1 - std::exp(-a * t) * (std::cos(w * t) + a / w * std::sin(w * t))), 1e-7);
}

// The deck of the issue of two diodes that share a current: in parallel each takes half of it, in series both take it.
TEST(NetlistTest, DiodesInParallelAndInSeries) {
  const std::string model = ".model DX D(RON=1 VFWD=0.5 ROFF=1e12)\n.tran 1u 1m\n";
  const auto parallel =
      Solved("V1 in 0 11.5\nD1 in m DX\nD2 in m DX\nR1 m out 0.5\nR2 out 0 10\nC1 out 0 1u\n" + model, "--at 1e-3");
  EXPECT_NEAR(Last(parallel, "i(D1)"), 0.5, 1e-6);
  EXPECT_NEAR(Last(parallel, "i(D2)"), 0.5, 1e-6);
  const auto series = Solved("V1 in 0 13\nD1 in m DX\nD2 m out DX\nR2 out 0 10\nC1 out 0 1u\n" + model, "--at 1e-3");
  EXPECT_NEAR(Last(series, "i(D1)"), 1, 1e-6);
  EXPECT_NEAR(Last(series, "v(m)"), 11.5, 1e-6);
}

TEST(NetlistTest, AnInductorBehindADiodeStopsAtTheZeroOfItsCurrent) {
  // L i' = V sin wt - R i from 0 until i = 0 again.
  const auto result = Solved(
      "V1 in 0 SIN(0 325 50)\nD1 in a DX\nL1 a b 0.1\nR1 b 0 10\n.model DX D(RON=0 VFWD=0 ROFF=1e15)\n"
      ".tran 1u 20m uic\n",
      "--tolerance 1e-9");
  const auto& switchings = result["summary"]["switching_times"];
  double last = 0;
  for (const auto& switching : switchings) {
    if (switching["kind"] == "SWITCHING_KIND_SWITCH" || switching["time"].get<double>() > 0.01)
      last = switching["time"];
  }
  EXPECT_NEAR(last, 0.01472069085, 1e-9);  // as in the user's guide
}

TEST(NetlistTest, CoupledInductorsConserveFlux) {
  // Secondary open: v2 = k √(L2/L1) v1.
  const auto result =
      Solved("I1 0 a PWL(0 0 1m 1)\nR0 a 0 1meg\nL1 a 0 1m\nL2 b 0 4m\nK1 L1 L2 0.5\nR2 b 0 1meg\n.tran 1u 1m\n",
             "--tolerance 1e-8 --at 5e-4");
  EXPECT_NEAR(Last(result, "v(b)") / Last(result, "v(a)"), 1, 1e-5);
  EXPECT_NEAR(Last(result, "v(a)"), 1, 1e-5);
}

// Σ v i over all elements is 0: outputs of nodes and currents, the solution and Kirchhoff's laws fit together.
class PowerBalance : public ::testing::TestWithParam<const char*> {};

TEST_P(PowerBalance, IsZero) {
  const std::string path = ProjectPath(fmt::format("deploy/examples/circuits/{}.cir", GetParam()));
  std::ifstream file(path);
  std::string deck, line;
  std::vector<std::array<std::string, 3>> elements;
  while (std::getline(file, line)) {
    if (line.starts_with(".print")) continue;  // all outputs
    deck += line + "\n";
    char name[64], plus[64], minus[64];
    if (elements.size() < 100 && deck.find('\n') + 1 < deck.size() &&
        std::string_view("RLCVIEDS").find(line[0]) != std::string_view::npos &&
        std::sscanf(line.c_str(), "%63s %63s %63s", name, plus, minus) == 3) {
      elements.push_back({name, plus, minus});
    }
  }
  const std::string copy = fmt::format("{}balance-{}.cir", ::testing::TempDir(), GetParam());
  std::ofstream(copy) << deck;
  const ProgramOutcome outcome = RunDlcs("solve " + copy + " --format json --quiet");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto result = nlohmann::json::parse(outcome.out);
  const auto& outputs = result["outputs"];
  const auto volts = [&outputs](const std::string& node, std::size_t k) {
    return node == "0" ? 0.0 : outputs.at("v(" + node + ")")[k].get<double>();
  };
  const std::size_t times = result["trajectory"]["times"].size();
  ASSERT_GT(times, 5);
  for (std::size_t k = 0; k < times; ++k) {
    double sum = 0, size = 0.1;
    for (const auto& [name, plus, minus] : elements) {
      const double power = (volts(plus, k) - volts(minus, k)) * outputs.at("i(" + name + ")")[k].get<double>();
      sum += power;
      size += std::abs(power);
    }
    EXPECT_NEAR(sum, 0, 1e-9 * size) << "at t = " << result["trajectory"]["times"][k];
  }
  const auto& certificate = result["summary"]["certificate"];
  EXPECT_LE(certificate["node_residual"].get<double>(), 1e-9 * certificate["lcp_scale"].get<double>());
  EXPECT_EQ(result["summary"]["verdict"]["kind"], "VERDICT_KIND_SOLVED");
  EXPECT_EQ(result["summary"]["cost"]["coupled_steps"], 0);
}

INSTANTIATE_TEST_SUITE_P(Decks, PowerBalance,
                         ::testing::Values("rlc", "half-wave", "bridge", "three-phase", "doubler", "clamp", "buck",
                                           "boost", "buck-boost", "cuk", "sepic", "flyback", "half-bridge", "forward",
                                           "llc", "snubber", "oscillator", "hysteretic-buck"),
                         [](const auto& deck) {
                           std::string name = deck.param;
                           std::erase(name, '-');
                           return name;
                         });

TEST(NetlistTest, TheProblemFileHasTheSameSolutionAndOutputs) {
  const std::string path = ProjectPath("deploy/examples/circuits/buck.cir");
  const ProgramOutcome file = RunDlcs("netlist " + path);
  ASSERT_EQ(file.code, 0) << file.err;
  EXPECT_THAT(file.err, HasSubstr("a diode with a forward voltage of 0.5 V and 0.01 ohm"));
  const auto problem = nlohmann::json::parse(file.out);
  EXPECT_EQ(problem["states"], nlohmann::json({"i_L1", "v_C1"}));
  EXPECT_EQ(problem["pairs"], nlohmann::json({"S1_forward", "S1_backward", "D1"}));
  const std::string json = ::testing::TempDir() + "buck.json";
  std::ofstream(json) << file.out;
  const std::string options = " --at 1e-4,2e-4,4e-4 --format csv --quiet";
  const ProgramOutcome one = RunDlcs("solve " + path + options), other = RunDlcs("solve " + json + options);
  EXPECT_EQ(one.code, 0);
  EXPECT_EQ(one.out, other.out);
  EXPECT_THAT(one.out, ::testing::StartsWith("t,v(out),i(L1),v(sw)\n0.0001,"));
  EXPECT_EQ(RunDlcs("solve - " + options, "cat " + path + " | ").out, one.out);
}

TEST(NetlistTest, OutputsAreColumnsOfTheTable) {
  const std::string path = ProjectPath("deploy/examples/circuits/half-wave.cir");
  const ProgramOutcome table = RunDlcs("solve " + path + " --at 0.01,0.02 --quiet");
  EXPECT_THAT(table.out, AllOf(HasSubstr("v(out)"), HasSubstr("i(D1)"), Not(HasSubstr("w(D1)"))));
  EXPECT_THAT(table.out, HasSubstr("switch                D1"));
  EXPECT_EQ(RunDlcs("analyze " + path).code, 0);
}

// The coil's 10 A go through 1 kilohm when S1 opens: far more than 10 V could drive, and more than the switch allows.
TEST(NetlistTest, ASwitchAtTheLimitOfItsCurrentIsNoSuccess) {
  const std::string file = ::testing::TempDir() + "at-its-limit.json";
  const std::string deck = WriteDeck(
      "V1 p 0 10\nL1 p a 1m IC=0\nS1 a 0 g 0 SA\nS2 a 0 p 0 SB\nC1 a 0 1u\nVg g 0 PULSE(5 0 1m 0 0 1)\n"
      ".model SA SW(RON=1m VT=2)\n.model SB SW(RON=1k VT=2)\n.tran 0 1.05m uic\n.print v(a)\n");
  EXPECT_EQ(RunDlcs("netlist " + deck + " --quiet --output " + file).code, 0);
  const ProgramOutcome outcome = RunDlcs("solve " + file);
  std::remove(file.c_str());
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.out,
              AllOf(HasSubstr("reached T: i(S2) reaches its limit 0.03 at t = "), Not(HasSubstr("  i(S2)"))));
}

TEST(NetlistTest, ATableHasAllItsRows) {
  const ProgramOutcome outcome = RunDlcs("solve " + ProjectPath("deploy/examples/circuits/buck.cir") + " --quiet");
  for (const char* time :
       {"4e-05", "8e-05", "0.00012", "0.00016", "0.0002", "0.00024", "0.00028", "0.00032", "0.00036"}) {
    EXPECT_THAT(outcome.out, HasSubstr(std::string(time) + " "));
  }
}

// 1 and 2 kilohm have their own matrices, 5 and 10 V share them.
TEST(NetlistTest, AStepIsAnEnsembleOfItsPoints) {
  const std::string deck = WriteDeck(
      "V1 in 0 {v}\nR1 in out {R}\nC1 out 0 1u IC=0\n.param R=1k\n.step param v list 5 10\n"
      ".step param R 1k 2k 1k\n.tran 1u 2m uic\n.print v(out)\n");
  const ProgramOutcome outcome = RunDlcs("ensemble " + deck + " --format csv --at 2e-3 --tolerance 1e-10 --quiet");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, ::testing::StartsWith("member,label,t,v(out)\n"));
  for (const double volts : {5.0, 10.0}) {
    for (const double kiloohms : {1.0, 2.0}) {
      const std::string label = fmt::format("\"v={:g}, R={:g}\",0.002,", volts, 1000 * kiloohms);
      const std::size_t at = outcome.out.find(label);
      ASSERT_NE(at, std::string::npos) << outcome.out;
      EXPECT_NEAR(std::stod(outcome.out.substr(at + label.size())), volts * (1 - std::exp(-2 / kiloohms)), 1e-8);
    }
  }
  const ProgramOutcome table = RunDlcs("ensemble " + deck + " --quiet");
  EXPECT_THAT(table.out, AllOf(HasSubstr("4 solved"), HasSubstr("v(out)"), HasSubstr("v=10, R=2000")));
  const ProgramOutcome solve = RunDlcs("solve " + deck + " --quiet");
  EXPECT_EQ(solve.code, 2);
  EXPECT_THAT(solve.err, HasSubstr("dlcs ensemble"));
  EXPECT_THAT(RunDlcs("ensemble " + ProjectPath("deploy/examples/rectifier.json")).err,
              HasSubstr("MEMBERS is missing"));
}

double MeasuredIn(const nlohmann::json& result, const std::string& name) {
  for (const auto& one : result["summary"]["measurements"]) {
    if (one["name"] == name) return one["value"].get<double>();
  }
  return std::nan("");
}

// Off-resistances beside inductors are states of 1e-10 s, and leak some 1e-5 A.
TEST(NetlistTest, OffResistancesChangeWhatTheyLeakAlone) {
  const auto boost = [](const std::string& off) {
    return Solved(
        "Vin in 0 12\nL1 in sw 100u IC=0\nS1 sw 0 g 0 SW1\nD1 sw out DM\nC1 out 0 47u IC=12\nR1 out 0 28.8\n"
        "Vg g 0 PULSE(0 1 0 10n 10n 5u 10u)\n.model SW1 SW(VT=0.5 VH=0.1 RON=10m " +
            off + ")\n.model DM D(VFWD=0.7 RON=0.05 " + off +
            ")\n.tran 0.1u 2m uic\n.print v(out)\n"
            ".meas tran mean AVG V(out) FROM=1.9m\n",
        "");
  };
  const auto leaks = boost("ROFF=1meg"), ideal = boost("");
  EXPECT_EQ(leaks["summary"]["cost"]["coupled_steps"], 0);
  EXPECT_EQ(leaks["summary"]["verdict"]["kind"], "VERDICT_KIND_SOLVED");
  EXPECT_NEAR(MeasuredIn(leaks, "mean") / MeasuredIn(ideal, "mean"), 1, 1e-4);
}

// Sine-triangle modulation of 0.8 makes a fundamental of 0.8 · 400 V, and a ripple that adds little to the root.
TEST(NetlistTest, AnInverterWithOffResistancesMakesItsFundamental) {
  const auto result = Solved(
      ".param m=0.8 fs=5k\nVdc p 0 400\nVsin s 0 SIN(0 {m} 50)\n"
      "Vtri t 0 PULSE(-1 1 0 {0.5/fs} {0.5/fs} 1n {1/fs})\n"
      "S1 p a s t SW1\nS2 a 0 t s SW1\nS3 p b t s SW1\nS4 b 0 s t SW1\nD1 a p DD\nD2 0 a DD\nD3 b p DD\nD4 0 b DD\n"
      "L1 a c 5m\nR1 c b 10\n.model SW1 SW(Ron=10m Roff=1Meg Vt=0 Vh=10m)\n"
      ".model DD D(Ron=10m Roff=1Meg Vfwd=0)\n.tran 0 40m 0 1u\n.save I(L1)\n.four 50 I(L1)\n"
      ".meas tran irms RMS I(L1) FROM=20m TO=40m\n",
      "");
  EXPECT_EQ(result["summary"]["verdict"]["kind"], "VERDICT_KIND_SOLVED");
  const double ohms = std::hypot(10, 2 * std::numbers::pi * 50 * 5e-3);
  EXPECT_NEAR(MeasuredIn(result, "irms"), 0.8 * 400 / std::sqrt(2.0) / ohms, 0.1);
}

// A discharge switch with a hysteresis of 3 and 6 V, as a timer has it.
TEST(NetlistTest, ATimerOscillatesWithItsPeriod) {
  const auto result = Solved(
      "V1 vcc 0 9\nR1 vcc n 10k\nR2 n c 10k\nC1 c 0 10n\nS1 n 0 c 0 SH off\n.model SH SW(Ron=10 Vt=4.5 Vh=1.5)\n"
      ".ic V(c)=0\n.tran 0 2m 0 1u uic\n.meas tran per TRIG V(c)=4.5 RISE=2 TARG V(c)=4.5 RISE=3\n"
      ".meas tran f PARAM 1/per\n",
      "--tolerance 1e-9");
  const double low = 9 * 10 / 10010.0, ohms = 1e4 + 10 * 1e4 / 10010.0;
  const double period = 2e-4 * std::numbers::ln2 + ohms * 1e-8 * std::log((6 - low) / (3 - low));
  EXPECT_NEAR(MeasuredIn(result, "per"), period, 1e-12);
  EXPECT_NEAR(MeasuredIn(result, "f") * period, 1, 1e-8);
}

// With a stray inductance in series the magnetizing current follows from a diode unless the secondary is the port.
TEST(NetlistTest, AnIdealTransformerBehindAStrayInductanceIsTheLimitOfCoupledCoils) {
  const auto flyback = [](const char* coupling) {
    return Solved(fmt::format("Vin in 0 DC 48\nL1 in d 200u\nL2 0 s 50u\nK1 L1 L2 {}\nLlk d d2 2u\nS1 d2 0 g 0 SW\n"
                              "D2 d2 cl DX\nCcl cl in 10n\nRcl cl in 5k\nD1 s out DX\nC1 out 0 220u IC=12\n"
                              "R1 out 0 10\nVg g 0 PULSE(0 5 0 10ns 10ns 3us 10us)\n"
                              ".model SW SW(RON=0.05 ROFF=1MEG VT=2.5)\n.model DX D(RON=0.02 VFWD=0.7 ROFF=10MEG)\n"
                              ".tran 10n 45u UIC\n.print tran v(out)\n",
                              coupling),
                  "--tolerance 1e-7 --at 45e-6");
  };
  EXPECT_NEAR(Last(flyback("1"), "v(out)"), Last(flyback("0.999999999"), "v(out)"), 1e-6);
}

// Saturated at 5 V; between the folds its determinant is positive, and beyond them negative. Half a period is R C ln 3.
TEST(NetlistTest, AnAmplifierWithPositiveFeedbackStartsSaturated) {
  const auto result = Solved(
      "E1 out 0 TABLE {V(p,n)} = (-1u,-5) (1u,5)\nR1 out p 10k\nR2 p 0 10k\nR3 out n 10k\nC1 n 0 10n IC=0\n"
      ".ic V(out)=5\n.tran 1u 1m uic\n.meas tran half TRIG V(out) VAL=0 FALL=1 TARG V(out) VAL=0 RISE=1\n",
      "--tolerance 1e-9");
  EXPECT_NEAR(MeasuredIn(result, "half"), 1e-4 * std::log(3.0), 1e-9);
}

// A buck converter with a PI amplifier of the gain 1e4, a triangle and a comparator. Cz carries no mean current, and
// Rfb none then, so that the mean of v(out)/2 is Vref - mean v(comp0)/1e4; L1 carries what the load and the divider
// take.
std::string PwmLoop(const char* z_ohms) {
  return fmt::format(
      ".param fs=100k Vref=2.5\nVin vin 0 24\nS1 vin sw pwm 0 SWI\nD1 0 sw DI\nL1 sw out 47u rser=10m ic=0\n"
      "C1 out x 220u ic=0\nResr x 0 20m\nRload out 0 5\nRd1 out fb 10k\nRd2 fb 0 10k\nVref ref 0 {{Vref}}\n"
      "Rz comp0 z {}\nCz z fb2 10n ic=0\nRfb fb fb2 1k\nE1 comp0 0 VALUE={{limit(1e4*V(ref,fb2),0.1,2.9)}}\n"
      "Vtri tri 0 PULSE(0 3 0 {{0.5/fs}} {{0.5/fs}} 0 {{1/fs}})\nB1 pwm 0 V={{if(V(comp0)>V(tri),5,0)}}\n"
      ".model SWI SW(Ron=20m Roff=1Meg Vt=2.5 Vh=0.2)\n.model DI D(Ron=10m Vfwd=0.4 Roff=1Meg)\n"
      ".tran 1u 10m uic\n.print tran v(out) i(L1) v(comp0)\n.meas tran vss avg v(out) from=4m to=5m\n"
      ".meas tran late avg v(out) from=4m\n.meas tran dip min v(out) from=4.999m\n",
      z_ohms);
}

TEST(NetlistTest, ALoopIsStableOrNotByItsGain) {
  const ProgramOutcome outcome = RunDlcs("solve " + WriteDeck(PwmLoop("10k")) + " --format json --periodic 1e-5");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("unstable: disturbances grow by 1.7 % a period"));
  const auto unstable = nlohmann::json::parse(outcome.out);
  EXPECT_THAT(unstable["summary"]["verdict"]["text"].get<std::string>(),
              ::testing::StartsWith("unstable: disturbances grow by 1.7 % a period"));
  EXPECT_NEAR(unstable["summary"]["periodic"]["growth"].get<double>(), 0.0173, 5e-5);
  const auto stable = Solved(PwmLoop("20k"), "--periodic 1e-5");
  EXPECT_EQ(stable["summary"]["periodic"]["stability"], "STABILITY_STABLE");
  for (const auto& result : {unstable, stable}) {
    const auto means = result["summary"]["periodic"]["mean_outputs"].get<std::vector<double>>();
    ASSERT_EQ(means.size(), 3u);
    EXPECT_NEAR(means[0], 2 * (2.5 - means[2] / 1e4), 1e-6);
    EXPECT_NEAR(means[1], means[0] * (1 / 5.0 + 1 / 20e3), 1e-6);
    EXPECT_NEAR(MeasuredIn(result, "vss"), means[0], 1e-9);
    EXPECT_NEAR(MeasuredIn(result, "late"), means[0], 1e-9);
    EXPECT_LT(MeasuredIn(result, "dip"), means[0]);
    EXPECT_EQ(result["summary"]["measurements"][0]["note"], "over 100 equal periods");
    EXPECT_EQ(result["summary"]["measurements"][1]["note"], "over one period");
  }
}

// Windows of a transient of 1,000 periods, in its periodic steady state.
TEST(NetlistTest, WindowsOfATransientAreThoseOfThePeriod) {
  const auto result = Solved(
      "V1 in 0 PULSE(0 1 0 1n 1n 4.999u 10u)\nR1 in out 1k\nC1 out 0 1u\n.tran 1u 10m\n.print tran v(out)\n"
      ".meas tran mean AVG V(out) FROM=4m\n.meas tran part AVG V(in) FROM=4.002m TO=4.006m\n"
      ".meas tran around AVG V(in) FROM=4.008m TO=4.012m\n.meas tran more INTEG V(in) FROM=4.005m TO=4.035m\n"
      ".meas tran at FIND V(in) AT=4.007m\n.meas tran up WHEN V(in)=0.5 RISE=401\n"
      ".meas tran high TRIG V(in) VAL=0.5 RISE=401 TARG V(in) VAL=0.5 FALL=401\n",
      "--periodic 1e-5 --tolerance 1e-9");
  EXPECT_NEAR(MeasuredIn(result, "mean"), 0.5, 1e-9);
  EXPECT_NEAR(MeasuredIn(result, "part"), 0.75, 2e-4);
  EXPECT_NEAR(MeasuredIn(result, "around"), 0.5, 2e-4);
  EXPECT_NEAR(MeasuredIn(result, "more"), 1.5e-5, 1e-12);
  EXPECT_NEAR(MeasuredIn(result, "at"), 0, 1e-12);
  EXPECT_NEAR(MeasuredIn(result, "up"), 4e-3 + 0.5e-9, 1e-15);
  EXPECT_NEAR(MeasuredIn(result, "high"), 5e-6, 1e-15);
  const auto table = RunDlcs("solve " +
                             WriteDeck("V1 in 0 SIN(0 1 1k)\nR1 in out 1k\nC1 out 0 1u\n.tran 1u 10m\n"
                                       ".meas tran mean RMS V(in) FROM=4.5m\n") +
                             " --periodic 1e-3");
  EXPECT_THAT(table.out, HasSubstr("mean  0.707107 (over one period)"));
}

// It is the whole period, not the half after which the capacitor has its voltage again.
TEST(NetlistTest, TheOscillationOfAComparatorIsFoundWithItsWholePeriod) {
  const auto result = Solved(
      "B1 out 0 V = V(p,n) > 0 ? 5 : -5\nR1 out p 10k\nR2 p 0 10k\nR3 out n 10k\nC1 n 0 10n IC=0\n.ic V(out)=5\n"
      ".tran 1u 1m uic\n.meas tran mean AVG V(out)\n.meas tran late AVG V(out) FROM=0.5m TO=0.9m\n"
      ".meas tran short AVG V(out) FROM=0.5m TO=0.51m\n.meas tran at FIND V(out) AT=0.5m\n"
      ".meas tran per TRIG V(n) VAL=1 RISE=3 TARG V(n) VAL=1 RISE=4\n.meas tran low FIND V(out) WHEN V(n)=1 FALL=2\n",
      "--periodic auto --tolerance 1e-9");
  const double period = 2e-4 * std::log(3.0);
  EXPECT_NEAR(result["summary"]["periodic"]["period"].get<double>(), period, 1e-12);
  EXPECT_NEAR(MeasuredIn(result, "mean"), 0, 1e-7);
  EXPECT_NEAR(MeasuredIn(result, "late"), 0, 1e-7);
  EXPECT_NEAR(MeasuredIn(result, "per"), period, 1e-12);
  EXPECT_NEAR(MeasuredIn(result, "low"), -5, 1e-9);
  const auto measured = result["summary"]["measurements"];
  EXPECT_FALSE(measured[2].contains("value"));
  EXPECT_THAT(measured[2]["reason"].get<std::string>(), HasSubstr("shorter than the period"));
  EXPECT_THAT(measured[3]["reason"].get<std::string>(), HasSubstr("a time means nothing in the period"));
}

// Three inverters in a ring: V(b) is in the middle of its range where V(a) jumps, between two steps.
TEST(NetlistTest, ARingOfInvertersHasThePeriodOfItsTransient) {
  const std::string ring =
      "B1 a 0 V=V(f)>2.5 ? 0 : 5\nR1 a b 1k\nC1 b 0 1n IC=0\nB2 c 0 V=V(b)>2.5 ? 0 : 5\nR2 c d 1k\nC2 d 0 1n IC=1\n"
      "B3 e 0 V=V(d)>2.5 ? 0 : 5\nR3 e f 1k\nC3 f 0 1n IC=2\n.tran 0.1u 50u uic\n";
  const auto oscillation = Solved(ring, "--periodic auto --tolerance 1e-9");
  const auto transient =
      Solved(ring + ".meas tran per TRIG V(a)=2.5 RISE=15 TARG V(a)=2.5 RISE=16\n", "--tolerance 1e-9");
  EXPECT_NEAR(oscillation["summary"]["periodic"]["period"].get<double>(), MeasuredIn(transient, "per"), 1e-13);
}

// The snubber rings twenty times in a period and comes near to its values each time; the converter does once.
TEST(NetlistTest, AHystereticConverterHasThePeriodOfItsTransient) {
  const auto deck = [](const char* measurement) {
    return fmt::format(
        "V1 in 0 12\nV2 ref 0 5\nS1 in sw ref out SWH\nD1 0 sw DX\nC2 sw x 1n\nR2 x 0 50\nL1 sw out 47u\n"
        "C1 out 0 100u\nR1 out 0 5\n.model SWH SW(RON=0.02 ROFF=1MEG VT=0 VH=0.05)\n"
        ".model DX D(RON=0.02 VFWD=0.5 ROFF=1MEG)\n.tran 1u 1m uic\n.print tran v(out) i(L1)\n{}",
        measurement);
  };
  const auto transient =
      Solved(deck(".meas tran per TRIG V(out)=5.06 RISE=8 TARG V(out)=5.06 RISE=9\n"), "--tolerance 1e-9");
  const auto periodic = Solved(deck(""), "--periodic auto --tolerance 1e-9")["summary"]["periodic"];
  EXPECT_NEAR(periodic["period"].get<double>(), MeasuredIn(transient, "per"), 1e-12);
  EXPECT_EQ(periodic["stability"], "STABILITY_STABLE");
}

// A comparator sets V(s), so that .ic only chooses between its two states; one that it cannot have is refused.
TEST(NetlistTest, AnInitialVoltageChoosesTheStateOfAComparatorAtRest) {
  const auto deck = [](const char* volts) {
    return fmt::format(
        "V1 in 0 SIN(0 4 500)\nB2 s 0 V=V(p)>V(in) ? 5 : -5\nR5 s p 10k\nR6 p 0 10k\nC6 p 0 1p\n"
        ".ic V(s)={}\n.tran 1u 1m\n.print tran v(s)\n",
        volts);
  };
  EXPECT_NEAR(Last(Solved(deck("5"), "--at 0"), "v(s)"), 5, 1e-9);
  EXPECT_NEAR(Last(Solved(deck("-5"), "--at 0"), "v(s)"), -5, 1e-9);
  EXPECT_THAT(Refused(deck("3")), AllOf(HasSubstr(".ic V(s) = 3 cannot be held"), HasSubstr("B2")));
}

// A glow lamp: it ignites at 6 V and goes out at 2 V, so it is no diode. Between them C1 charges by 10 V over 1 kohm.
TEST(NetlistTest, ASwitchThatItsOwnVoltageIgnitesOscillates) {
  const auto result = Solved(
      "V1 in 0 10\nR1 in a 1k\nC1 a 0 1u IC=0\nS1 a 0 a 0 SL\n.model SL SW(RON=10 VT=4 VH=2)\n.tran 1u 5m uic\n"
      ".meas tran up TRIG V(a)=3 RISE=2 TARG V(a)=5 RISE=2\n",
      "--tolerance 1e-9");
  EXPECT_NEAR(MeasuredIn(result, "up"), 1e-3 * std::log(7.0 / 5), 1e-9);
}

// Open, the lamp would be at 1000 V and ignite; closed, at 0.1 mV and go out. With a source of 3 V it rests at 3 V.
TEST(NetlistTest, SaysThatACircuitWhichRestsInNeitherStateStartsBetween) {
  const auto notes = [](const std::string& drive) {
    const auto netlist = ReadNetlist("title\nS1 a 0 a 0 SL\nC1 a 0 1n\n" + drive +
                                         "\n.model SL SW(VT=2.5 VH=2.475 RON=1 ROFF=10MEG)\n.tran 1u 200u\n.end\n",
                                     "a.cir", "", {});
    EXPECT_TRUE(netlist.ok()) << netlist.status();
    return netlist.ok() ? netlist->notes : std::vector<std::string>();
  };
  const std::string text = "S1 (a.cir:2) starts between open and closed";
  EXPECT_THAT(notes("I1 0 a 100u"), Contains(HasSubstr(text)));
  EXPECT_THAT(notes("V1 in 0 3\nR1 in a 1"), Not(Contains(HasSubstr(text))));
}

// Hysteretic current control of a full bridge: a comparator with feedback drives four switches, 22 pairs. The current
// stays within half the band, 0.35 A, of its reference.
TEST(NetlistTest, AComparatorWithHysteresisControlsTheCurrentOfABridge) {
  const auto result = Solved(
      "Vdc p 0 100\nVref r 0 SIN(0 5 200)\nH1 m 0 VS 1\nBq g 0 V = V(r,m)+0.14*V(g)-0.35 > 0 ? 5 : 0\n"
      "Eq q 0 VALUE {5-V(g)}\nS1 p a g 0 SWG\nS2 a 0 q 0 SWG\nS3 p b q 0 SWG\nS4 b 0 g 0 SWG\n"
      "D1 a p DX\nD2 0 a DX\nD3 b p DX\nD4 0 b DX\nVS a c 0\nL1 c d 2m\nR1 d b 5\n"
      ".model SWG SW(RON=0.02 ROFF=1MEG VT=2.5)\n.model DX D(RON=0.02 VFWD=0.5 ROFF=1MEG)\n.tran 1u 5m uic\n"
      ".ic V(g)=0\n.print tran i(L1)\n.meas tran off MAX V(r,m) FROM=0.5m\n.meas tran below MIN V(r,m) FROM=0.5m\n",
      "--tolerance 1e-7");
  EXPECT_EQ(result["summary"]["verdict"]["kind"], "VERDICT_KIND_SOLVED");
  EXPECT_NEAR(MeasuredIn(result, "off"), 0.35, 1e-5);
  EXPECT_NEAR(MeasuredIn(result, "below"), -0.35, 1e-5);
}

// Four switches with a hysteresis of their own on the current turn at once: from 2 A to -2 A it takes
// L/R ln((V/R + 2)/(V/R - 2)).
TEST(NetlistTest, SwitchesWithTheirOwnHysteresisTurnTogether) {
  const auto result = Solved(
      "Vdc p 0 100\nS1 p a 0 ctl SH ON\nS2 a 0 ctl 0 SH\nS3 p b ctl 0 SH\nS4 b 0 0 ctl SH ON\nL1 a m 1m\nR1 m c 1\n"
      "Vs c b 0\nHc ctl 0 Vs 1\n.model SH SW(RON=0.01 VT=0 VH=2)\n.tran 1u 1m uic\n"
      ".meas tran per TRIG I(L1) VAL=0 FALL=1 TARG I(L1) VAL=0 FALL=10\n",
      "--tolerance 1e-9");
  EXPECT_EQ(result["summary"]["verdict"]["kind"], "VERDICT_KIND_SOLVED");
  const double ohms = 1.02, settled = 100 / ohms;
  EXPECT_NEAR(MeasuredIn(result, "per"), 9 * 2e-3 / ohms * std::log((settled + 2) / (settled - 2)), 1e-12);
}

// A switch that starts within its hysteresis stays open until its control leaves it, A (1 - cos wt) = VH: also where
// the system is so slow that the first step looks far ahead.
TEST(NetlistTest, ASwitchKeepsItsStateFromTheStartOn) {
  const auto result = Solved(
      "I1 0 c SIN(0 1m 1k)\nC1 c 0 10n IC=0\nR2 c 0 1e12\nV1 vcc 0 5\nR1 vcc out 1k\nS1 out 0 c 0 SH\n"
      ".model SH SW(RON=1 VT=0 VH=0.05)\n.tran 1u 1m uic\n.meas tran closes WHEN V(out)=2.5 FALL=1\n",
      "--tolerance 1e-9");
  const double w = 2 * std::numbers::pi * 1e3;
  EXPECT_NEAR(MeasuredIn(result, "closes"), std::acos(1 - 0.05 * 1e-8 * w / 1e-3) / w, 1e-11);
}

// The gates of one deck are found beforehand, those of the other one are comparators in the problem. The current of the
// open switch is that of its off-resistance, and its sign must not be rounding where the current of L1 crosses zero.
TEST(NetlistTest, GatesInTheProblemAreThoseFoundBeforehand) {
  const auto amplifier = [](const char* modulator) {
    return Solved(fmt::format("Vp p 0 30\nVm m 0 -30\nS1 p x g 0 SA\nS2 x m 0 g SA\nL1 x o 22u\nC1 o 0 680n\nR1 o 0 8\n"
                              "Va a 0 SIN(0 0.7 5k)\nVt t 0 PULSE(-1 1 0 2.5u 2.5u 0.1n 5.0002u)\n{}\n"
                              ".model SA SW(RON=0.1 ROFF=1meg VT=0)\n.tran 1u 100u\n",
                              modulator),
                  "--tolerance 1e-9 --at 1e-4");
  };
  const auto in_problem = amplifier("B1 g 0 V=V(a) > V(t) ? 1 : -1"), beforehand = amplifier("E1 g 0 a t 1");
  EXPECT_NEAR(Last(in_problem, "v(o)"), Last(beforehand, "v(o)"), 1e-7);
  EXPECT_NEAR(Last(in_problem, "i(L1)"), Last(beforehand, "i(L1)"), 1e-7);
}

// The resistance that decks put between a floating part and ground: 1e6 times the sum of the currents of three
// inductors is a voltage that turns diodes on, and their rounding must not hide it.
TEST(NetlistTest, AHighResistanceToGroundChangesNothing) {
  const auto rectifier = [](const char* star, const char* negative, const char* resistance) {
    return Solved(fmt::format("Va a1 {0} SIN(0 325 50)\nVb b1 {0} SIN(0 325 50 0 0 -120)\n"
                              "Vc c1 {0} SIN(0 325 50 0 0 -240)\nLa a1 a 1m\nLb b1 b 1m\nLc c1 c 1m\n"
                              "D1 a p DX\nD2 b p DX\nD3 c p DX\nD4 {1} a DX\nD5 {1} b DX\nD6 {1} c DX\n"
                              "C1 p {1} 500u\nR1 p {1} 50\n{2}.model DX D(RON=0.01 VFWD=0.8)\n.tran 10u 40m\n"
                              ".print tran v(p,{1})\n",
                              star, negative, resistance),
                  "--at 0.04");
  };
  const auto star = rectifier("s", "0", "Rs s 0 1meg\n"), load = rectifier("0", "n", "Rn n 0 1meg\n"),
             none = rectifier("0", "n", "");
  EXPECT_EQ(star["summary"]["verdict"]["kind"], "VERDICT_KIND_SOLVED");
  EXPECT_EQ(load["summary"]["verdict"]["kind"], "VERDICT_KIND_SOLVED");
  EXPECT_NEAR(Last(star, "v(p,0)") / Last(none, "v(p,n)"), 1, 1e-5);
  EXPECT_NEAR(Last(load, "v(p,n)") / Last(none, "v(p,n)"), 1, 1e-5);
}

// Both switches are open at the start, and what the symmetry of the windings makes zero is rounding.
TEST(NetlistTest, APushPullConverterStarts) {
  const auto result = Solved(
      "Vdc ct 0 24\nLp1 a ct 50u\nLp2 ct b 50u\nLs1 s1 0 200u\nLs2 0 s2 200u\nK1 Lp1 Lp2 Ls1 Ls2 0.999\n"
      "S1 a 0 g1 0 SW1\nS2 b 0 g2 0 SW1\nD1 s1 r DX\nD2 s2 r DX\nLo r out 100u\nCo out 0 47u\nRo out 0 20\n"
      "Vg1 g1 0 PULSE(0 1 0 10n 10n 4u 10u)\nVg2 g2 0 PULSE(0 1 5u 10n 10n 4u 10u)\n"
      ".model SW1 SW(RON=10m ROFF=1k VT=0.5)\n.model DX D(RON=20m VFWD=0.03)\n.tran 100n 100u uic\n"
      ".meas tran most MAX v(out)\n",
      "");
  EXPECT_EQ(result["summary"]["verdict"]["kind"], "VERDICT_KIND_SOLVED");
  EXPECT_GT(MeasuredIn(result, "most"), 20);
  EXPECT_LT(MeasuredIn(result, "most"), 96);  // twice the voltage of the winding
}

TEST(NetlistTest, ReadsADeckOfLtspice) {
  const auto result = Solved(
      "V1 IN 0 24\nS1 N001 IN N002 0 MYSW\nV2 N002 0 PULSE(0 1 0 1n 1n 5u 10u) AC 1\nD1 0 N001 D1N\n"
      "L1 N001 OUT 47\xb5 Rser=10m\nC1 OUT 0 100\xb5 Rser=5m V=35 Irms=2\nR1 OUT 0 6 tol=1 ; load\n"
      "* comment\n.model MYSW SW(Ron=.01 Roff=1Meg\n+ Vt=.5 Vh=0) $ more\n.model D1N D(Ron=.1 Roff=1Meg Vfwd=.7)\n"
      ".tran 0 6m 0\n.meas TRAN Pout AVG V(out)*I(R1) FROM 5.9m TO 6m\n"
      ".meas TRAN Pin AVG -V(IN)*I(V1) FROM 5.9m TO 6m\n.meas TRAN eff PARAM Pout/Pin*100\n.backanno\n",
      "");
  EXPECT_EQ(result["summary"]["verdict"]["kind"], "VERDICT_KIND_SOLVED");
  EXPECT_GT(MeasuredIn(result, "eff"), 85);
  EXPECT_LT(MeasuredIn(result, "eff"), 100);
}

TEST(NetlistTest, SaysWhyACircuitHasNoSolution) {
  const std::string ideal = ".model DX D(RON=0 VFWD=0)\n.tran 1u 1m\n";
  EXPECT_THAT(Refused("V1 a 0 10\nD1 a 0 DX\nR1 a b 1k\nC1 b 0 1u\n" + ideal),
              AllOf(HasSubstr("no operating point"), HasSubstr("D1")));
  EXPECT_THAT(Refused("V1 a 0 SIN(0 1 50)\nD1 a b DX\nC1 b 0 1u\n.model DX D(RON=0 ROFF=1e999)\n.tran 1u 1m\n"),
              HasSubstr("1e999"));
  EXPECT_THAT(Refused("V1 a 0 1\nV2 a 0 1\nC1 a 0 1u\n.tran 1u 1m\n"), HasSubstr("form a loop of voltage sources"));
  EXPECT_THAT(Refused("V1 a 0 1\nR1 a 0 1\nS1 a 0 typo 0 SX\n.model SX SW(VT=1)\n.tran 1u 1m\n"),
              AllOf(HasSubstr("no element has the node typo"), HasSubstr("S1")));
  EXPECT_THAT(Refused("V1 a 0 1\nR1 b c 1\nC1 a 0 1u\n.tran 1u 1m\n"),
              AllOf(HasSubstr("nodes b and c"), HasSubstr("R1")));
  const auto untitled = ReadNetlist("V1 a 0 5\nR1 a b 1k\nC1 b 0 1u\n.tran 1u 1m\n", "a.cir", "", {});
  EXPECT_THAT(std::string(untitled.status().message()), HasSubstr("line 1 of a deck is its title"));
  for (const char* empty : {"", "\n \n"}) {
    EXPECT_EQ(std::string(ReadNetlist(empty, "a.cir", "", {}).status().message()), "a.cir: the file is empty");
  }
  EXPECT_THAT(std::string(ReadNetlist("{\"A\": [[-1]]}", "a.json", "", {}).status().message()),
              HasSubstr("holds JSON and no deck; dlcs solve reads problem files as they are"));
  const auto schematic = ReadNetlist("Version 4\nSHEET 1 880 680\nWIRE 0 0 0 1\n", "a.asc", "", {});
  EXPECT_THAT(std::string(schematic.status().message()), HasSubstr("a schematic of LTspice"));
  const ProgramOutcome interrupted =
      RunDlcs("solve " + WriteDeck("V1 a 0 12\nL1 a b 1m\nS1 b 0 g 0 SX\nVg g 0 PULSE(0 1 0 1n 1n 5u 10u)\n"
                                   ".model SX SW(RON=0.1 VT=0.5)\n.tran 1u 100u\n"));
  EXPECT_EQ(interrupted.code, 1);
  EXPECT_THAT(interrupted.err, AllOf(HasSubstr("S1"), HasSubstr("alone carries the current of L1")));
  const ProgramOutcome infeasible = RunDlcs(
      "solve " + WriteDeck("V1 a 0 SIN(0 10 1k)\nD1 a 0 DX\nR1 a b 1k\nC1 b 0 1u\n.model DX D(RON=0)\n.tran 1u 1m\n"));
  EXPECT_EQ(infeasible.code, 1);
  EXPECT_THAT(infeasible.err, HasSubstr("nothing limits the current in the loop of V1"));
  const ProgramOutcome blocked = RunDlcs(
      "solve " + WriteDeck("I1 0 a SIN(0 1 50)\nD1 a b DX\nR1 b 0 1\nC1 b 0 1u\n.model DX D(RON=0)\n.tran 1u 40m\n"));
  EXPECT_EQ(blocked.code, 1);
  EXPECT_THAT(blocked.err, HasSubstr("sources alone drive the current through I1"));
  EXPECT_THAT(Refused("V1 a a 1\nR1 a 0 1\nC1 a 0 1u\n.tran 1u 1m\n"), HasSubstr("both ends at one node"));
}

}  // namespace
}  // namespace dlcs::client
