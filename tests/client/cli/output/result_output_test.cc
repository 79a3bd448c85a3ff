// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/result_output.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <sstream>
#include <string>
#include <utility>

#include "client/cli/output/ensemble_output.h"
#include "tests/client/cli/printed.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// Two states, one pair, three times; the numbers do not end in binary.
SolveResult ResultExample() {
  SolveResult result;
  result.states = 2;
  result.constraints = 1;
  result.times = {0, 0.1, 1.0 / 3};
  result.x = {1, 0.1 + 0.2, -1e-300, 5e-324, 1.7976931348623157e308, -0.0};
  result.y = {0, 2.0 / 3, 1e16};
  result.w = {0.7, 0, -0.0};
  result.analysis.set_matrix_class("P-matrix");
  v1::Summary& summary = result.summary;
  summary.set_termination(v1::TERMINATION_REACHED_END);
  summary.mutable_verdict()->set_kind(v1::VERDICT_KIND_ERROR_UNKNOWN);
  summary.mutable_verdict()->set_success(true);
  summary.mutable_verdict()->set_text("reached T, error not estimated");
  summary.set_method(v1::METHOD_LAPLACE_ITERATION);
  summary.set_reason("M is a P-matrix");
  summary.set_step(0.1);
  summary.add_warnings("a \"quoted\" warning");
  v1::StateJump& jump = *summary.add_jumps();
  jump.set_time(0);
  jump.add_dx(0.5);
  jump.add_dx(0);
  jump.add_multiplier(2);
  v1::Certificate& certificate = *summary.mutable_certificate();
  certificate.set_node_residual(3e-16);
  certificate.set_midpoint_residual(2e-7);
  certificate.set_lcp_scale(12);
  certificate.set_ode_scale(std::numeric_limits<double>::quiet_NaN());
  summary.mutable_cost()->set_iterations(7);
  summary.mutable_cost()->set_seconds_total(0.25);
  return result;
}

// y1 becomes positive at 0.1, where it jumps.
SolveResult WithSwitchings() {
  SolveResult result = ResultExample();
  v1::SwitchingTime& start = *result.summary.add_switching_times();
  start.set_kind(v1::SWITCHING_KIND_START);
  v1::SwitchingTime& switching = *result.summary.add_switching_times();
  switching.set_time(0.1);
  switching.add_entering(0);
  switching.set_kind(v1::SWITCHING_KIND_BREAK_POINT);
  result.summary.set_switchings(2);
  v1::LeftLimit& limit = result.left_limits.emplace_back();
  limit.set_index(1);
  limit.add_y(0.5);
  limit.add_w(0.25);
  return result;
}

TEST(ResultTableTest, ListsSwitchingTimesByTheNamesOfItsColumns) {
  const std::string table = Printed([](std::FILE* out) { PrintTable("", WithSwitchings(), 80, out); });
  EXPECT_THAT(table, ::testing::ContainsRegex("0\\.1 +break point +y1 +-"));
  SolveResult many = WithSwitchings();
  many.summary.set_switchings(500);
  EXPECT_THAT(Printed([&](std::FILE* out) { PrintTable("", many, 80, out); }), HasSubstr("and 498 more"));
}

TEST(ResultTableTest, KeepsTheColumnsOfSwitchingTimesStraightWithLongNames) {
  SolveResult result = WithSwitchings();
  result.names.pairs = {"resistance of the valve"};
  result.summary.mutable_switching_times(0)->add_leaving(0);
  std::istringstream lines(Printed([&](std::FILE* out) { PrintTable("", result, 80, out); }));
  std::string line;
  while (std::getline(lines, line) && line != "Switching times") continue;
  std::getline(lines, line);
  const std::size_t active = line.find("active"), inactive = line.find("inactive");
  ASSERT_NE(inactive, std::string::npos);
  std::getline(lines, line);
  EXPECT_EQ(line.substr(active, 2), "- ");
  EXPECT_EQ(line.substr(inactive), "resistance of the valve");
  std::getline(lines, line);
  EXPECT_EQ(line.substr(active, inactive - active), "resistance of the valve  ");
  EXPECT_EQ(line.substr(inactive), "-");
}

TEST(ResultCsvTest, HasAHeaderAndGivesBackTheSameBits) {
  const SolveResult result = ResultExample();
  const auto chunk = [&](std::size_t first, std::size_t end) {
    v1::TrajectoryChunk part;
    part.mutable_times()->Add(result.times.begin() + first, result.times.begin() + end);
    part.mutable_x()->Add(result.x.begin() + first * result.states, result.x.begin() + end * result.states);
    part.mutable_y()->Add(result.y.begin() + first * result.constraints, result.y.begin() + end * result.constraints);
    part.mutable_w()->Add(result.w.begin() + first * result.constraints, result.w.begin() + end * result.constraints);
    return part;
  };
  std::istringstream lines(Printed([&](std::FILE* out) {
    PrintCsvHeader({}, result.states, result.constraints, /*has_w=*/true, out);
    for (const auto& [first, end] : {std::pair<std::size_t, std::size_t>(0, 2), {2, 2}, {2, 3}}) {
      PrintCsvLines(chunk(first, end), out);
    }
  }));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "t,x1,x2,y1,w1");
  for (std::size_t k = 0; k < 3; ++k) {
    ASSERT_TRUE(std::getline(lines, line));
    std::istringstream fields(line);
    std::vector<double> numbers;
    for (std::string field; std::getline(fields, field, ',');) numbers.push_back(std::strtod(field.c_str(), nullptr));
    EXPECT_THAT(numbers, ::testing::ElementsAre(result.times[k], result.x_at(k)[0], result.x_at(k)[1],
                                                result.y_at(k)[0], result.w_at(k)[0]));
  }
  EXPECT_FALSE(std::getline(lines, line));
}

SolveResult Named() {
  SolveResult result = WithSwitchings();
  result.names = {{"iL", "vC"}, {"D1"}};
  return result;
}

TEST(ResultNamesTest, StandInEveryOutput) {
  const std::string table = Printed([](std::FILE* out) { PrintTable("", Named(), 100, out); });
  EXPECT_THAT(table, ::testing::ContainsRegex("t +iL +vC +D1 +w\\(D1\\)\n"));
  EXPECT_THAT(table, ::testing::ContainsRegex("0\\.1 +break point +D1 +-"));
  const std::string header = Printed([](std::FILE* out) { PrintCsvHeader(Named().names, 2, 1, /*has_w=*/true, out); });
  EXPECT_EQ(header, "t,iL,vC,D1,w(D1)\n");
}

TEST(ResultNamesTest, OfColumnsCanBeToldApart) {
  SolveResult result = WithSwitchings();
  result.names.outputs = {"t", "label"};
  result.outputs.assign(2 * result.times.size(), 1.0);
  const std::string table = Printed([&](std::FILE* out) { PrintTable("", result, 100, out); });
  EXPECT_THAT(table, ::testing::ContainsRegex("t +output:t +label\n"));
  const auto header = [&](auto print) { return Printed([&](std::FILE* out) { print(result.names, out); }); };
  EXPECT_EQ(header([](const DisplayNames& names, std::FILE* out) { PrintCsvHeader(names, 2, 1, true, out); }),
            "t,output:t,label\n");
  EXPECT_EQ(header([](const DisplayNames& names, std::FILE* out) { PrintMemberCsvHeader(names, 2, 1, out); }),
            "member,label,t,output:t,output:label\n");
  // One with the name of a state stands in its place.
  result.names = {{"iL", "vC"}, {"D1"}, {"D1", "iL"}};
  EXPECT_EQ(header([](const DisplayNames& names, std::FILE* out) { PrintCsvHeader(names, 2, 1, true, out); }),
            "t,D1,iL\n");
  result.names = {{"label", "x2"}, {}};
  EXPECT_EQ(header([](const DisplayNames& names, std::FILE* out) { PrintMemberCsvHeader(names, 2, 1, out); }),
            "member,label,t,x:label,x2,y1,w1\n");
}

TEST(ResultTableTest, HasWBesideY) {
  const std::string table = Printed([](std::FILE* out) { PrintTable("", ResultExample(), 100, out); });
  EXPECT_THAT(table, ::testing::ContainsRegex("t +x1 +x2 +y1 +w1\n"));
  EXPECT_THAT(table, ::testing::ContainsRegex("0 +1 +0\\.3 +0 +0\\.7\n"));
}

TEST(ResultTableTest, EndsWithACertificateInWords) {
  const std::string table = Printed([](std::FILE* out) { PrintTable("two tanks", ResultExample(), 100, out); });
  EXPECT_THAT(table, HasSubstr("two tanks: reached T, error not estimated"));
  EXPECT_THAT(table, HasSubstr("laplace-iteration"));
  EXPECT_THAT(table, HasSubstr("Warning: a \"quoted\" warning"));
  EXPECT_THAT(table, HasSubstr("LCP residual     3.0e-16 at nodes, 2.0e-07 between them (size of y, w: 12)"));
  EXPECT_THAT(table, HasSubstr("at t = 0: dx = (0.5, 0), multiplier (2)"));
  EXPECT_THAT(table, Not(HasSubstr("shorter steps")));
}

TEST(ResultTableTest, SaysNothingTwice) {
  SolveResult result = ResultExample();
  v1::Verdict& verdict = *result.summary.mutable_verdict();
  verdict.set_text("reached T: x1 has an error of 2e-05, allowed is 1e-06, because of steps (and 1 more)");
  verdict.add_concerns("x1 has an error of 2e-05, allowed is 1e-06, because of steps.");
  verdict.add_concerns("x2 has an error of 3e-06, allowed is 1e-06, because of steps.");
  const std::string table = Printed([&](std::FILE* out) { PrintTable("", result, 100, out); });
  EXPECT_THAT(table, Not(HasSubstr("Warning: x1")));
  EXPECT_THAT(table, HasSubstr("Warning: x2 has an error of 3e-06"));
}

TEST(ResultTableTest, NamesThePropagator) {
  SolveResult result = ResultExample();
  result.summary.mutable_propagator()->set_used(v1::PROPAGATOR_KIND_KRONECKER_SUM);
  const std::string table = Printed([&](std::FILE* out) { PrintTable("", result, 80, out); });
  EXPECT_THAT(table, HasSubstr("\nPropagator\n  kronecker-sum\n"));
}

TEST(ResultTableTest, SaysWhatTheVerdictIsConcernedAbout) {
  SolveResult result = ResultExample();
  result.summary.mutable_verdict()->add_concerns("The residual is large: take shorter steps.");
  EXPECT_THAT(Printed([&](std::FILE* out) { PrintTable("", result, 100, out); }), HasSubstr("shorter steps"));
}

TEST(ResultTableTest, BreaksWideSystemsIntoBlocks) {
  SolveResult result;
  result.states = 30;
  result.constraints = 2;
  result.times = {0, 1};
  result.x.assign(60, 0.123456789);
  result.y.assign(4, 1);
  std::istringstream lines(Printed([&](std::FILE* out) { PrintTable("", result, 80, out); }));
  int heads = 0;
  std::string all;
  for (std::string line; std::getline(lines, line);) {
    if (line.find(" x") != std::string::npos) {
      EXPECT_LE(line.size(), 80U);
      heads += line.rfind("t ", 0) == 0 ? 1 : 0;
      all += line;
    }
  }
  EXPECT_GT(heads, 2);
  EXPECT_THAT(all, AllOf(HasSubstr(" x1 "), HasSubstr(" x30"), HasSubstr(" y2")));
}

}  // namespace
}  // namespace dlcs::client
