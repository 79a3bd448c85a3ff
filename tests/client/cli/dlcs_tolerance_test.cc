// SPDX-License-Identifier: Apache-2.0
// --tolerance and --absolute-tolerance on the command line.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "tests/client/cli/program.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// z follows the difference of two states that are equal but for 1e-9: of 1e-9 of z, rounding leaves nothing.
const char* const kDifference =
    R"json({"states": ["a", "b", "z"], "pairs": ["idle"], "A": [[-1, 0, 0], [0, -1, 0], [1e3, -1e3, -1]],
            "B": [[0], [0], [0]], "N": [[0, 0, 0]], "M": [[1]], "f": ["sin(t)", "sin(t)", "0"], "g": ["1"],
            "x0": [1, 1.000000001, 0], "T": 5,
            "outputs": {"names": ["v(a,b)"], "C": [[1, -1, 0]], "D": [[0]], "h": [0]}})json";

TEST(DlcsToleranceTest, AnAbsoluteToleranceAcceptsWhatRoundingSpoils) {
  const ProgramOutcome missed = SolveText(kDifference, "--tolerance 1e-8");
  EXPECT_EQ(missed.code, 1);
  EXPECT_THAT(missed.out, HasSubstr("because of rounding"));
  for (const char* given : {"1e-9", "z=1e-9", "1e-13,z=1e-9", "1e-13 --absolute-tolerance z=1e-9", "x3=1n"}) {
    const ProgramOutcome accepted =
        SolveText(kDifference, fmt::format("--tolerance 1e-8 --absolute-tolerance {}", given));
    EXPECT_EQ(accepted.code, 0) << given << accepted.err;
    EXPECT_THAT(accepted.out, HasSubstr("SOLVED within an error of 1e-08"));
  }
  for (const char* too_little : {"1e-15", "a=1e-9", "1e-9,z=1e-15"}) {
    EXPECT_EQ(SolveText(kDifference, fmt::format("--tolerance 1e-8 --absolute-tolerance {}", too_little)).code, 1)
        << too_little;
  }
}

TEST(DlcsToleranceTest, HoldsForMembersOfEnsemblesToo) {
  const std::string members = ::testing::TempDir() + "dlcs-tolerance-members.json";
  std::ofstream(members) << R"([{}, {"x0": [2, 2.000000002, 0]}])";
  const auto run = [&](const std::string& options) {
    return RunDlcs("ensemble - '" + members + "' --tolerance 1e-8 --format json " + options,
                   fmt::format("echo '{}' | ", kDifference));
  };
  EXPECT_EQ(run("").code, 1);
  const ProgramOutcome accepted = run("--absolute-tolerance z=1e-9");
  EXPECT_EQ(accepted.code, 0) << accepted.err;
  std::istringstream lines(accepted.out);
  for (std::string line; std::getline(lines, line);) {
    EXPECT_EQ(nlohmann::json::parse(line)["summary"]["verdict"]["kind"], "VERDICT_KIND_SOLVED");
  }
}

TEST(DlcsToleranceTest, HoldsForPeriodicSolutionsToo) {
  // The source of b is 1e-9 larger, so that z does not vanish.
  std::string problem = kDifference;
  problem.replace(problem.find("\"sin(t)\", \"0\""), 8, "\"1.000000001*sin(t)\"");
  const std::string options = "--tolerance 1e-8 --periodic 6.283185307179586 ";
  EXPECT_EQ(SolveText(problem, options).code, 1);
  const ProgramOutcome accepted = SolveText(problem, options + "--absolute-tolerance z=1e-8");
  EXPECT_EQ(accepted.code, 0) << accepted.err;
  EXPECT_THAT(accepted.out, HasSubstr("SOLVED within an error of 1e-08"));
}

TEST(DlcsToleranceTest, NamesThatAreNoneAreRefusedWithThoseThatThereAre) {
  for (const char* command : {"solve - ", "analyze - "}) {
    const ProgramOutcome refused =
        RunDlcs(command + std::string("--absolute-tolerance 'z=1e-9,V(a,b)=1e-9,z=2,i(L)=0'"),
                fmt::format("echo '{}' | ", kDifference));
    EXPECT_EQ(refused.code, 2) << command;
    EXPECT_THAT(refused.err, AllOf(HasSubstr("dlcs: --absolute-tolerance: \"V(a,b)\"; is no state, pair or output of "
                                             "the problem, which has a, b, z, idle, "
                                             "w(idle), v(a,b); did you mean v(a,b)?"),
                                   HasSubstr("\"z\"; given twice; keep one of them"),
                                   HasSubstr("\"i(L)\"; is no state, pair or output either")));
  }
}

TEST(DlcsToleranceTest, NumbersThatAreNoneAreRefused) {
  for (const char* given : {"-1", "z=-1", "z=", "z", "1e-9,", "z=inf", "nan", ""}) {
    const ProgramOutcome refused = SolveText(kDifference, fmt::format("--absolute-tolerance '{}'", given));
    EXPECT_EQ(refused.code, 2) << given;
    EXPECT_THAT(refused.err, AllOf(HasSubstr("--absolute-tolerance"), Not(HasSubstr("problem.")))) << given;
  }
}

}  // namespace
}  // namespace dlcs::client
