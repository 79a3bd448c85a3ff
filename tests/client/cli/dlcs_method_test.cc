// SPDX-License-Identifier: Apache-2.0
// Methods and their options on the command line.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/client/cli/program.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(DlcsMethodTest, LocatesSwitchingTimesForASmallErrorAndShowsThem) {
  const ProgramOutcome outcome = SolveText(kEasyProblem, "--tolerance 1e-9");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("Method event-driven: for an error of 1e-09 a few steps of high order"),
                                 HasSubstr("Switching times"), HasSubstr("start"), HasSubstr("estimated error")));
  EXPECT_THAT(outcome.err, HasSubstr("steps for the allowed error"));
}

// x' = -x/100 + sin 3t: the multiplier is exp(-P/100), the averages are 0.
TEST(DlcsMethodTest, FindsThePeriodicSteadyState) {
  const std::string problem =
      R"json({"A": [[-0.01]], "B": [[0]], "N": [[0]], "M": [[1]], "f": ["sin(3*t)"], "g": ["1"], "x0": [5], "T": 10,
              "states": ["speed"]})json";
  const std::string period = "2.0943951023931953";
  const ProgramOutcome table = SolveText(problem, "--tolerance 1e-9 --quiet --periodic " + period);
  EXPECT_EQ(table.code, 0) << table.err;
  EXPECT_THAT(table.out, AllOf(HasSubstr("SOLVED within an error of 1e-09"), HasSubstr("Periodic solution"),
                               HasSubstr("multipliers      0.979274"), HasSubstr("averages         speed ")));
  const ProgramOutcome json = SolveText(problem, "--quiet --format json --periodic " + period);
  EXPECT_EQ(json.code, 0) << json.err;
  const auto periodic = nlohmann::json::parse(json.out)["summary"]["periodic"];
  EXPECT_NEAR(periodic["multipliers"][0]["real"].get<double>(), std::exp(-0.02094395102393195), 1e-9);
  EXPECT_LE(periodic["periods"].get<int>(), 12);

  const ProgramOutcome refused = SolveText(problem, "--periodic 2");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("--periodic"), HasSubstr("period of every source, and that of f[0] (speed)"),
                                 HasSubstr("2.0943951")));
  const ProgramOutcome driven = SolveText(problem, "--periodic auto");
  EXPECT_EQ(driven.code, 2);
  EXPECT_THAT(driven.err, HasSubstr("f[0] (speed) depends on time"));
}

// x' = x/370 + sin t: disturbances grow by e^{2π/370} - 1 = 1.7 % a period, and by those of another sign they shrink.
TEST(DlcsMethodTest, SaysInTheFirstLineThatAPeriodicSteadyStateIsUnstable) {
  const auto problem = [](const char* a) {
    return fmt::format(
        R"json({{"A": [[{}]], "B": [[0]], "N": [[0]], "M": [[1]], "f": ["sin(t)"], "g": ["1"], "x0": [5], "T": 10,
                 "outputs": {{"names": ["twice", "one"], "C": [[2], [0]], "D": [[0], [0]], "h": [0, 1]}}}})json",
        a);
  };
  const std::string options = "--periodic 6.283185307179586 ";
  const ProgramOutcome unstable = SolveText(problem("0.002702702702702703"), options + "--quiet");
  EXPECT_EQ(unstable.code, 1);
  EXPECT_THAT(
      unstable.out.substr(0, unstable.out.find('\n')),
      AllOf(HasSubstr(": unstable: disturbances grow by 1.7 % a period; estimated error"), Not(HasSubstr("SOLVED"))));
  EXPECT_THAT(unstable.out, AllOf(HasSubstr("stability        unstable: disturbances grow by 1.7 % a period"),
                                  HasSubstr("Warning: The periodic solution is unstable"),
                                  HasSubstr("averages         twice "), HasSubstr(", one 1\n")));
  const ProgramOutcome json = SolveText(problem("0.002702702702702703"), options + "--quiet --format json");
  EXPECT_EQ(json.code, 1);
  const auto summary = nlohmann::json::parse(json.out)["summary"];
  EXPECT_EQ(summary["periodic"]["stability"], "STABILITY_UNSTABLE");
  EXPECT_NEAR(summary["periodic"]["growth"].get<double>(), std::expm1(6.283185307179586 / 370), 1e-12);
  EXPECT_NEAR(summary["periodic"]["mean_outputs"][1].get<double>(), 1, 1e-12);
  EXPECT_EQ(summary["periodic"]["mean_x"].size(), 1u);
  EXPECT_FALSE(summary["verdict"].value("success", false));
  const ProgramOutcome stable = SolveText(problem("-0.002702702702702703"), options);
  EXPECT_EQ(stable.code, 0) << stable.err;
  EXPECT_THAT(stable.out, AllOf(HasSubstr("SOLVED within"),
                                HasSubstr("stability        stable: disturbances shrink by 1.7 % a period")));
  const ProgramOutcome unknown = SolveText(problem("1e-18"), "--periodic 6.283185307179586");
  EXPECT_EQ(unknown.code, 1);  // one solution for each mean
  EXPECT_THAT(unknown.out, HasSubstr("not isolated"));
}

// Steps are missing, and no iteration has failed.
TEST(DlcsMethodTest, AdvisesOnIterationsOnlyWhereTheyFail) {
  const ProgramOutcome steps =
      SolveText(R"json({"kind": "nonlinear", "f": ["-x1**3+y1+sin(20*t)"], "g": ["x1+y1-1"], "x0": [1], "T": 5})json",
                "--tolerance 1e-13");
  EXPECT_EQ(steps.code, 1) << steps.out;
  EXPECT_THAT(steps.out, HasSubstr("needs more steps than are allowed"));
  EXPECT_THAT(steps.err, Not(AnyOf(HasSubstr("--window"), HasSubstr("does not iterate"))));
  const ProgramOutcome window = SolveText(kEasyProblem,
                                          "--steps 400 --method laplace-iteration --window whole "
                                          "--max-iterations 1");
  EXPECT_EQ(window.code, 1) << window.out;
  EXPECT_THAT(window.err, HasSubstr("--window auto shrinks windows"));
}

TEST(DlcsMethodTest, SaysWhyThereIsNoPeriodicSteadyState) {
  const std::string lossless =
      R"json({"A": [[0, 1], [-1, 0]], "B": [[0], [0]], "N": [[0, 0]], "M": [[1]], "g": ["1"], "x0": [1, 0],
              "T": 30})json";
  const ProgramOutcome family = SolveText(lossless, "--periodic auto");
  EXPECT_EQ(family.code, 1);
  EXPECT_THAT(family.out, AllOf(HasSubstr("NOT_PERIODIC"), HasSubstr("not isolated")));
}

TEST(DlcsMethodTest, TakesAToleranceInsteadOfAStepWithEveryMethod) {
  const auto last_x = [](const std::string& options) {
    const ProgramOutcome outcome = SolveText(kEasyProblem, "--at 4 --quiet --format json " + options);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out)["trajectory"]["x"][0].get<double>();
  };
  const double exact = last_x("--method event-driven --tolerance 1e-12");
  for (const char* method : {"exponential-integrator", "laplace-iteration", "time-stepping"}) {
    EXPECT_NEAR(last_x(std::string("--tolerance 1e-3 --method ") + method), exact, 1e-3) << method;
  }
}

TEST(DlcsMethodTest, SolvesStepsByNewtonsMethodAndShowsItsRate) {
  const std::string method = "--quiet --steps 64 --method time-stepping ";
  const ProgramOutcome table = SolveText(kEasyProblem, method + "--step-solver newton");
  EXPECT_EQ(table.code, 0) << table.err;
  EXPECT_THAT(table.out, AllOf(HasSubstr("Newton's method\n"), HasSubstr(" iterations in "),
                               HasSubstr("residuals of the step to t = "), HasSubstr("κ")));

  const auto root = [&](const std::string& options) {
    return nlohmann::json::parse(SolveText(kEasyProblem, method + "--at 4 --format json " + options).out);
  };
  const nlohmann::json newton = root("--step-solver newton"), substitution = root("");
  EXPECT_FALSE(substitution["summary"].contains("newton"));
  EXPECT_GE(newton["summary"]["cost"]["newton_iterations"].get<int>(), 64);
  EXPECT_EQ(newton["summary"]["cost"]["substituted_steps"], 0);
  EXPECT_GE(newton["summary"]["newton"]["residuals"].size(), 2U);
  EXPECT_NEAR(newton["trajectory"]["x"][0].get<double>(), substitution["trajectory"]["x"][0].get<double>(), 1e-12);
  // The averaged scheme is another one, of second order.
  EXPECT_GT(std::abs(root("--average-y")["trajectory"]["x"][0].get<double>() -
                     substitution["trajectory"]["x"][0].get<double>()),
            1e-6);
}

TEST(DlcsMethodTest, TakesTheKernelFromContoursWithTheSameAnswer) {
  const auto root = [](const std::string& kernel) {
    return nlohmann::json::parse(
        SolveText(kEasyProblem,
                  "--quiet --steps 200 --at 4 --format json --method laplace-iteration --kernel " + kernel)
            .out);
  };
  const nlohmann::json phi = root("phi-functions"), contour = root("contour");
  EXPECT_EQ(phi["summary"]["kernel"]["blocks_by_contour"], 0);
  EXPECT_GT(contour["summary"]["kernel"]["blocks_by_contour"].get<int>(), 0);
  EXPECT_EQ(contour["summary"]["kernel"]["fallback"], "");
  EXPECT_NEAR(phi["trajectory"]["x"][0].get<double>(), contour["trajectory"]["x"][0].get<double>(), 1e-10);
  const ProgramOutcome paper = SolveText(
      kEasyProblem, "--quiet --steps 50 --method wu-chen-iteration --interpolation cubic-spline --contour remark-2-4");
  EXPECT_EQ(paper.code, 0) << paper.err;
  EXPECT_THAT(paper.out, HasSubstr("Contour (Remark 2.4)"));
}

// The times of the table are nodes of the steps that were set, not additional ones.
TEST(DlcsMethodTest, ATableDoesNotChangeTheSteps) {
  const std::string system =
      R"(echo '{"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[1]], "f": ["t^2"], "x0": [1], "T": 1.3}' | )";
  for (const std::string steps :
       {"--steps 1", "--steps 2", "--steps 3", "--steps 37", "--step 0.1", "--grid 0,0.7,1.3"}) {
    const ProgramOutcome table = RunDlcs("solve - " + steps, system);
    const ProgramOutcome json = RunDlcs("solve - --format json " + steps, system);
    EXPECT_EQ(table.code, json.code) << steps;
    const int count = nlohmann::json::parse(json.out)["summary"]["cost"]["steps"].get<int>();
    EXPECT_THAT(table.out + table.err, HasSubstr(fmt::format(" {} step", count))) << steps;
  }
}

TEST(DlcsMethodTest, RefusesNewtonAndAveragingWithoutTheirMethod) {
  for (const std::string option : {"--step-solver newton", "--average-y"}) {
    const ProgramOutcome outcome = SolveText(kEasyProblem, option);
    EXPECT_EQ(outcome.code, 2);
    EXPECT_EQ(outcome.out, "");
    EXPECT_THAT(outcome.err, HasSubstr("dlcs: " + option.substr(0, option.find(' ')) + ": "));
    EXPECT_THAT(outcome.err, HasSubstr("time-stepping"));
  }
}

// A mass falls from height 1 at unit gravity and stays on the ground from t = sqrt(2) on.
TEST(DlcsMethodTest, LandsInelasticallyOnlyWhereAskedTo) {
  constexpr const char* kFall =
      R"json({"A": [[0, 1], [0, 0]], "B": [[0], [1]], "N": [[1, 0]], "M": [[0]], "x0": [1, 0], )json"
      R"json("T": 2, "f": [0, -1]})json";
  EXPECT_EQ(SolveText(kFall, "--quiet").code, 1);
  const ProgramOutcome outcome = SolveText(kFall, "--inelastic-impact --steps 2000 --at 1,2 --format json --quiet");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto root = nlohmann::json::parse(outcome.out);
  EXPECT_NEAR(root["trajectory"]["x"][0].get<double>(), 0.5, 2e-3);
  EXPECT_NEAR(root["trajectory"]["x"][2].get<double>(), 0, 2e-3);
  EXPECT_NEAR(root["trajectory"]["y"][1].get<double>(), 1, 1e-6);
}

TEST(DlcsMethodTest, NamesOptionsWithoutEffect) {
  const std::string problem = R"(echo '{"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[1]], "x0": [1], "T": 1}' | )";
  const ProgramOutcome outcome = RunDlcs("solve - --interpolation cubic-spline", problem);
  EXPECT_EQ(outcome.code, 0);
  EXPECT_THAT(outcome.err, HasSubstr("--interpolation had no effect: it is for wu-chen-iteration"));
  EXPECT_EQ(RunDlcs("solve - --interpolation cubic-spline --quiet", problem).err, "");
}

}  // namespace
}  // namespace dlcs::client
