// SPDX-License-Identifier: Apache-2.0
// What decks print and measure: closed forms, by the program; and what is refused.
#include "client/netlist/measurements.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "client/netlist/netlist.h"
#include "tests/client/cli/program.h"
#include "tests/client/netlist/deck_file.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// 1 ms = R C from 10 V.
constexpr const char* kCharger =
    "V1 in 0 10\nR1 in out 1k\nC1 out 0 1u IC=0\n.tran 1u 4m uic\n.param top=10 half={top/2}\n";

// The measurements of the deck by name, as in the summary.
nlohmann::json Measured(const std::string& lines, const std::string& options = "--tolerance 1e-10") {
  const ProgramOutcome outcome = RunDlcs("solve " + WriteDeck(lines) + " --format json --quiet " + options);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  nlohmann::json by_name = nlohmann::json::object();
  const auto result = nlohmann::json::parse(outcome.out, nullptr, false);
  for (const auto& one : result["summary"]["measurements"]) by_name[one["name"].get<std::string>()] = one;
  return by_name;
}

// As ngspice prints all of them.
TEST(MeasurementsTest, OfOneNameAreNumbered) {
  const auto m = Measured(std::string(kCharger) +
                          ".meas tran at FIND V(in) AT=1m\n.meas ac at FIND V(in) AT=1\n.meas tran At_2 MIN V(in,out)\n"
                          ".meas tran AT FIND I(V1) AT=1m\n.meas tran at FIND V(out) AT=1m\n"
                          ".meas tran twice PARAM='2*at_2'\n");
  EXPECT_EQ(m.size(), 5);
  EXPECT_NEAR(m["twice"]["value"].get<double>(), 20 * std::exp(-4.0), 1e-8);
  EXPECT_NEAR(m["at"]["value"].get<double>(), 10, 1e-8);
  EXPECT_NEAR(m["At_2"]["value"].get<double>(), 10 * std::exp(-4.0), 1e-8);
  EXPECT_NEAR(m["AT_3"]["value"].get<double>(), -0.01 * std::exp(-1.0), 1e-10);
  EXPECT_NEAR(m["at_4"]["value"].get<double>(), 10 * (1 - std::exp(-1.0)), 1e-8);
}

std::string MeasurementFault(const std::string& lines) {
  const auto netlist = ReadNetlist("title\n" + std::string(kCharger) + lines + ".end\n", "a.cir", "", {});
  return netlist.ok() ? "" : std::string(netlist.status().message());
}

TEST(MeasurementsTest, AreThoseOfTheExactSolution) {
  const auto m = Measured(
      std::string(kCharger) +
      ".meas tran mean AVG V(out)\n.measure tran late avg V(out) from=1m to = 3m\n.meas effective RMS I(R1)\n"
      ".meas tran charge INTEG I(C1)\n.meas tran energy INTEG {V(in,out)*I(R1)}\n.meas tran least MIN V(in,out)\n"
      ".meas tran most MAX V(out)\n.meas tran swing PP V(out) FROM=1m\n.meas tran now FIND I(R1) AT=1m\n"
      ".meas tran then FIND I(R1) WHEN V(out)=half\n.meas tran meet WHEN V(out)='V(in)-V(out)' RISE=1\n"
      ".meas tran rise TRIG V(out) VAL=1 RISE=1 TARG V(out) VAL='0.9*top' RISE=LAST\n"
      ".meas tran blank INTEG V(in,out) * I(R1)\n.meas tran bracket INTEG (V(in,out)*I(R1)) FROM {0} TO {4m}\n"
      ".meas tran when FIND time WHEN V(out)=half\n.meas largest max(V(out))\n"
      ".meas tran since TRIG AT=0.5m TARG V(out) VAL={half} CROSS=1\n.meas tran sum AVG par('2*V(out)-V(in)+1')\n");
  const double e = std::exp(-4.0);
  const auto value = [&m](const char* name) { return m[name]["value"].get<double>(); };
  EXPECT_NEAR(value("mean"), 10 * (1 - (1 - e) / 4), 1e-8);
  EXPECT_NEAR(value("late"), 10 * (1 - (std::exp(-1.0) - std::exp(-3.0)) / 2), 1e-8);
  EXPECT_NEAR(value("effective"), 0.01 * std::sqrt((1 - e * e) / 8), 1e-11);
  EXPECT_NEAR(value("charge"), 1e-5 * (1 - e), 1e-14);
  EXPECT_NEAR(value("energy"), 1e-4 * (1 - e * e) / 2, 1e-13);
  EXPECT_EQ(value("blank"), value("energy"));
  EXPECT_EQ(value("bracket"), value("energy"));
  EXPECT_NEAR(value("when"), 1e-3 * std::log(2.0), 1e-12);
  EXPECT_EQ(value("largest"), value("most"));
  EXPECT_NEAR(value("least"), 10 * e, 1e-8);
  EXPECT_NEAR(m["least"]["time"].get<double>(), 4e-3, 1e-15);
  EXPECT_NEAR(value("most"), 10 * (1 - e), 1e-8);
  EXPECT_NEAR(value("swing"), 10 * (std::exp(-1.0) - e), 1e-8);
  EXPECT_NEAR(value("now"), 0.01 * std::exp(-1.0), 1e-11);
  EXPECT_NEAR(value("then"), 0.005, 1e-11);
  EXPECT_NEAR(value("meet"), 1e-3 * std::numbers::ln2, 1e-12);
  EXPECT_NEAR(value("rise"), 1e-3 * std::log(9.0), 1e-12);
  EXPECT_NEAR(value("since"), 1e-3 * std::numbers::ln2 - 0.5e-3, 1e-12);
  EXPECT_NEAR(value("sum"), 2 * value("mean") - 9, 1e-8);
}

TEST(MeasurementsTest, SlopesAndArithmeticOfEarlierOnes) {
  const auto m = Measured(std::string(kCharger) +
                          ".meas tran Now FIND V(out) AT=1m\n.meas tran Slope DERIV V(out) AT=1m\n"
                          ".meas tran power DERIV V(out)*V(in,out) WHEN V(out)=half\n"
                          ".meas tran part PARAM='100*now/top + sqrt(4) - 1k*1m'\n"
                          ".meas tran tau PARAM ( top - NOW ) / Slope\n"
                          ".meas TRAN t1 TRIG V(out)=2 RISE=1 TARG V(out)=half RISE=1\n"
                          ".meas tran never WHEN V(out)=20\n.meas tran useless PARAM='never*2'\n");
  const auto value = [&m](const char* name) { return m[name]["value"].get<double>(); };
  EXPECT_NEAR(value("Slope"), 1e4 * std::exp(-1.0), 1e-4);
  EXPECT_NEAR(value("power"), 0, 1e-4);  // v (10 - v) is largest at 5 V
  EXPECT_NEAR(value("part"), 100 * (1 - std::exp(-1.0)) + 1, 1e-7);
  EXPECT_NEAR(value("tau"), 1e-3, 1e-10);
  EXPECT_NEAR(value("t1"), 1e-3 * (std::log(2.0) - std::log(1.25)), 1e-11);
  EXPECT_FALSE(m["useless"].contains("value"));
  EXPECT_THAT(m["useless"]["reason"].get<std::string>(), HasSubstr("never"));
}

TEST(MeasurementsTest, ArithmeticIsOfNumbersAlone) {
  EXPECT_THAT(MeasurementFault(".meas tran a PARAM='b+1'\n"),
              AllOf(HasSubstr("a.cir:7:"), HasSubstr("b is neither an earlier measurement nor a parameter")));
  EXPECT_THAT(MeasurementFault(".meas tran a PARAM='V(out)+1'\n"), HasSubstr("V(...) is a curve"));
  EXPECT_THAT(MeasurementFault(".meas tran a PARAM='2^3'\n"), HasSubstr("two meanings"));
  EXPECT_THAT(MeasurementFault(".meas tran a PARAM='gamma(2)'\n"), HasSubstr("function gamma is not supported"));
  EXPECT_THAT(RunDlcs("solve " + WriteDeck(std::string(kCharger) + ".meas tran a PARAM='2+'\n")).err,
              HasSubstr("measurements[0].formula"));
}

TEST(MeasurementsTest, DoNotDependOnTheTimesThatAreShown) {
  const std::string deck = std::string(kCharger) + ".meas tran mean AVG V(out)\n.meas tran t WHEN V(out)=7\n";
  const auto one = Measured(deck, "--tolerance 1e-9 --at 4e-3"),
             other = Measured(deck, "--tolerance 1e-9 --at 0:1e-6:4e-3");
  for (const char* name : {"mean", "t"}) {
    EXPECT_NEAR(one[name]["value"].get<double>() / other[name]["value"].get<double>(), 1, 1e-9);
  }
}

// A switch that chops 24 V: the edges of the gate are ends of polynomials.
TEST(MeasurementsTest, OfASwitchedCircuitAreExactAtItsEdges) {
  const auto m = Measured(
      "V1 in 0 24\nVg g 0 PULSE(0 5 0 0 0 5u 20u)\nS1 in a g 0 SX\nR1 a 0 1\nR2 a b 1meg\nC1 b 0 1p\n"
      ".model SX SW(RON=1 VT=2.5)\n.tran 0 200u uic\n.options x\n.meas tran duty AVG V(a)\n"
      ".meas tran up WHEN V(a)=6 RISE=3\n.meas tran down WHEN V(a)=6 FALL=3\n.meas tran power AVG -V(in)*I(V1)\n",
      "--tolerance 1e-8");
  EXPECT_NEAR(m["duty"]["value"].get<double>(), 12 / 4.0, 1e-5);
  EXPECT_NEAR(m["up"]["value"].get<double>(), 60e-6, 1e-12);  // it begins closed: rising for the third time
  EXPECT_NEAR(m["down"]["value"].get<double>(), 45e-6, 1e-12);
  EXPECT_NEAR(m["power"]["value"].get<double>(), 24 * 12 / 4.0, 1e-3);
}

TEST(MeasurementsTest, WhatDoesNotOccurIsReportedByName) {
  const std::string deck =
      WriteDeck(std::string(kCharger) + ".meas tran never WHEN V(out)=11 RISE=2\n.meas tran mean AVG V(out)\n");
  const ProgramOutcome table = RunDlcs("solve " + deck + " --quiet");
  EXPECT_EQ(table.code, 0);
  EXPECT_THAT(table.out,
              AllOf(HasSubstr("Measurements\n  never  none: v(out) crosses 11 upwards at no time.\n  mean   7.5"),
                    Not(HasSubstr("nan"))));
  const ProgramOutcome csv = RunDlcs("solve " + deck + " --format csv --at 1e-3");
  EXPECT_THAT(csv.err, AllOf(HasSubstr("dlcs: never: none: v(out) crosses 11"), HasSubstr("dlcs: mean = 7.5")));
  const ProgramOutcome json = RunDlcs("solve " + deck + " --format json --at 1e-3 --quiet");
  EXPECT_THAT(json.out,
              HasSubstr("{\"name\":\"never\",\"reason\":\"v(out) crosses 11 upwards at no time.\",\"note\":\"\"}"));
}

TEST(MeasurementsTest, RefusesOtherFormsWithPlaceNameAndReason) {
  EXPECT_EQ(MeasurementFault(""), "");
  EXPECT_THAT(MeasurementFault(".meas tran x SPEC V(out)\n"),
              AllOf(HasSubstr("a.cir:7:14: .meas x"), HasSubstr("\"SPEC\" is not supported")));
  EXPECT_THAT(MeasurementFault(".meas tran x MAX_AT V(out)\n"), HasSubstr("MAX shows the time too"));
  EXPECT_THAT(MeasurementFault(".meas tran x AVG V(nix)\n"),
              AllOf(HasSubstr("a.cir:7:18"), HasSubstr("no node \"nix\"")));
  EXPECT_THAT(MeasurementFault(".meas tran x AVG I(nix)\n"), HasSubstr("no element \"nix\""));
  EXPECT_THAT(MeasurementFault(".meas tran x AVG V(out)**2\n"), HasSubstr("not linear"));
  EXPECT_THAT(MeasurementFault(".meas tran x AVG V(out)*I(R1)+1\n"), HasSubstr("not linear"));
  EXPECT_THAT(MeasurementFault(".meas tran x AVG 3\n"), HasSubstr("neither a voltage nor a current"));
  EXPECT_THAT(MeasurementFault(".meas tran x AVG V(out) TO=5m\n"),
              AllOf(HasSubstr("a.cir:7:27"), HasSubstr("outside of 0 to TSTOP = 0.004")));
  EXPECT_THAT(MeasurementFault(".meas tran x AVG V(out) FROM=2m TO=1m\n"), HasSubstr("FROM=0.002 is not before 0.001"));
  EXPECT_THAT(MeasurementFault(".meas tran x AVG V(out) TRIG V(in) VAL=1\n"),
              HasSubstr("\"TRIG\" is not supported here"));
  EXPECT_THAT(MeasurementFault(".meas tran x FIND V(out)\n"), HasSubstr("FIND needs AT=time or WHEN"));
  EXPECT_THAT(MeasurementFault(".meas tran x WHEN V(out)\n"), HasSubstr("WHEN needs quantity=level"));
  EXPECT_THAT(MeasurementFault(".meas tran x WHEN V(out)=1 RISE=0\n"), HasSubstr("RISE=0; must be 1, 2, ... or LAST"));
  EXPECT_THAT(MeasurementFault(".meas tran x TRIG V(out) VAL=1 RISE=1\n"), HasSubstr("TRIG needs TARG"));
  EXPECT_THAT(MeasurementFault(".meas tran x TRIG V(out) RISE=1 TARG AT=1m\n"), HasSubstr("need VAL=level"));
  EXPECT_THAT(MeasurementFault(".meas tran x AVG V(out)\n.meas tran y PARAM='2*x'\n.meas tran X MAX V(out)\n"),
              AllOf(HasSubstr(".meas y"), HasSubstr("several measurements are called x")));
  EXPECT_THAT(MeasurementFault(".meas tran\n"), HasSubstr("needs a name"));
  EXPECT_THAT(MeasurementFault(".meas tran x\n"), HasSubstr("\"\" is not supported"));
}

TEST(PrintedTest, TakesVoltagesCurrentsAndExpressions) {
  const auto names = [](const std::string& lines) {
    const auto netlist = ReadNetlist("title\n" + std::string(kCharger) + lines + ".end\n", "a.cir", "", {});
    EXPECT_TRUE(netlist.ok()) << netlist.status();
    const v1::Outputs& outputs = netlist->problem.outputs();
    return std::vector<std::string>(outputs.names().begin(), outputs.names().end() - outputs.hidden());
  };
  EXPECT_THAT(names(""), ElementsAre("v(in)", "v(out)", "i(V1)", "i(R1)", "i(C1)"));
  EXPECT_THAT(names(".print tran v(OUT) V(in, out) i(r1) v (in)\n"),
              ElementsAre("v(out)", "v(in,out)", "i(R1)", "v(in)"));
  EXPECT_THAT(names(".save @c1[i] v1#branch\n.probe v(out)\n"), ElementsAre("i(C1)", "i(V1)", "v(out)"));
  EXPECT_THAT(names(".print tran par('2*v(out)') {v(in)-v(out)+1} v(out)/half\n"),
              ElementsAre("par('2*v(out)')", "{v(in)-v(out)+1}", "v(out)/half"));
  EXPECT_THAT(names(".print tran all v(out)\n"), ElementsAre("v(in)", "v(out)", "i(V1)", "i(R1)", "i(C1)"));
  EXPECT_THAT(names(".print ac vdb(out)\n.print tran v(out)\n"), ElementsAre("v(out)"));
  EXPECT_THAT(MeasurementFault(".print tran v(nix)\n"), AllOf(HasSubstr("a.cir:7:13"), HasSubstr("no node \"nix\"")));
  EXPECT_THAT(MeasurementFault(".print tran @r1[p]\n"), HasSubstr("a.cir:7:13: @r1[p]"));
  EXPECT_THAT(MeasurementFault(".print tran vdb(out)\n"), HasSubstr("vdb"));
  EXPECT_THAT(MeasurementFault(".print tran v(in)*i(v1)\n"), HasSubstr("a product can be measured"));
}

TEST(PrintedTest, AnExpressionHasItsConstant) {
  const ProgramOutcome csv = RunDlcs("solve " + WriteDeck(std::string(kCharger) + ".print tran {2*v(in)-v(out)+1}\n") +
                                     " --format csv --at 0,4e-3 --quiet");
  EXPECT_THAT(csv.out, ::testing::StartsWith("t,{2*v(in)-v(out)+1}\n0,21\n"));
}

}  // namespace
}  // namespace dlcs::client
