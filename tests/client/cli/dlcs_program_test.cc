// SPDX-License-Identifier: Apache-2.0
// The built `dlcs` as people and scripts use it: exit codes, streams, files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/client/cli/program.h"
#include "tests/support/paths.h"

namespace dlcs::client {
namespace {

using dlcs::testing::QuotedCase;
using dlcs::testing::QuotedExample;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(DlcsProgramTest, PrintsTheResultOnStandardOutputAndTheRestOnStandardError) {
  const ProgramOutcome outcome = RunDlcs("solve " + QuotedCase("rlcd"));
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("rlcd: SOLVED within an error of 1e-06 (the default)"),
                                 HasSubstr("Certificate"), HasSubstr("LCP residual")));
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("event-driven"), HasSubstr("1e-06"), HasSubstr("--tolerance")));
  EXPECT_THAT(outcome.err, Not(HasSubstr("\x1b")));
}

// The example of `dlcs netlist --help`, word by word.
TEST(DlcsProgramTest, RunsTheExampleInTheHelpOfNetlist) {
  const std::string help = RunDlcs("netlist --help").out;
  const std::string begin = "dlcs netlist rectifier.cir ";
  const std::size_t at = help.find(begin), bar = help.find("| dlcs ", at), end = help.find('\n', at);
  ASSERT_NE(at, std::string::npos) << help;
  ASSERT_LT(bar, end) << help;
  const std::string deck = dlcs::testing::ProjectPath("deploy/examples/circuits/half-wave.cir");
  const std::string first = "netlist '" + deck + "' " + help.substr(at + begin.size(), bar - at - begin.size());
  const std::string second = help.substr(bar + 7, end - bar - 7);
  const ProgramOutcome problem = RunDlcs(first);
  ASSERT_EQ(problem.code, 0) << problem.err;
  const ProgramOutcome outcome = RunDlcs(second + " --format csv", "printf %s '" + problem.out + "' | ");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 1 + 21);
  EXPECT_THAT(outcome.out, HasSubstr("\n0.02,"));
}

TEST(DlcsProgramTest, TabulatesElevenEvenTimes) {
  const ProgramOutcome outcome = SolveText(kEasyProblem, "--quiet --steps 40");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  for (const char* time : {"\n  0  ", "\n0.4  ", "\n2.8  ", "\n  4  "}) EXPECT_THAT(outcome.out, HasSubstr(time));
}

TEST(DlcsProgramTest, GivesEveryNodeToPrograms) {
  const ProgramOutcome outcome = SolveText(kEasyProblem, "--steps 64 --format json");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto root = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(root["trajectory"]["times"].size(), 65U);
  EXPECT_EQ(root["trajectory"]["x"].size(), 65U);
  EXPECT_EQ(root["trajectory"]["y"].size(), 65U);
  EXPECT_EQ(root["summary"]["termination"], "TERMINATION_REACHED_END");
  EXPECT_LT(root["summary"]["certificate"]["node_residual"].get<double>(), 1e-10);
}

TEST(DlcsProgramTest, ReportsItsOwnPeakMemoryAndNotThatOfTheProcessThatStartedIt) {
  constexpr std::size_t kBytes = 300'000'000;
  std::vector<char>(kBytes, 1).swap(*std::make_unique<std::vector<char>>());
  const ProgramOutcome outcome = SolveText(kEasyProblem, "--steps 64 --format json");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const std::string bytes = nlohmann::json::parse(outcome.out)["summary"]["cost"]["process_peak_bytes"];
  EXPECT_GT(std::stod(bytes), 1'000'000);
  EXPECT_LT(std::stod(bytes), kBytes);
}

TEST(DlcsProgramTest, GivesOnlyTheTimesAskedFor) {
  const ProgramOutcome outcome = SolveText(kEasyProblem, "--format json --at 3.14,0.1 --steps 64");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["trajectory"]["times"], nlohmann::json({0.1, 3.14}));
}

TEST(DlcsProgramTest, SolvesOnTheNodesGiven) {
  for (const char* method : {"laplace-iteration", "time-stepping"}) {
    const ProgramOutcome outcome = SolveText(
        kEasyProblem, std::string("--no-estimate-error --format json --grid 0.01,0.03,0.1,1,3 --method ") + method);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(nlohmann::json::parse(outcome.out)["trajectory"]["times"],
              nlohmann::json({0.0, 0.01, 0.03, 0.1, 1.0, 3.0, 4.0}));
  }
  const ProgramOutcome outside = SolveText(kEasyProblem, "--grid 1,5");
  EXPECT_EQ(outside.code, 2);
  EXPECT_THAT(outside.err, HasSubstr("dlcs: --grid[1]: 5; must lie in [0, T] = [0, 4]"));
}

TEST(DlcsProgramTest, WritesTheFileAndSaysWhere) {
  const std::string path = ::testing::TempDir() + "dlcs-program-test.csv";
  const ProgramOutcome outcome = SolveText(kEasyProblem, "--steps 10 --format csv --output " + path);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, HasSubstr("wrote " + path));
  std::ifstream stream(path);
  const std::string content(std::istreambuf_iterator<char>(stream), {});
  EXPECT_EQ(std::count(content.begin(), content.end(), '\n'), 12);
  EXPECT_THAT(content, HasSubstr("t,x1,y1,w1\n0,1,"));
  std::filesystem::remove(path);
}

TEST(DlcsProgramTest, ExitsWithOneWhenThereIsNoAnswer) {
  for (const char* format : {"table", "json", "csv"}) {
    const ProgramOutcome outcome = RunDlcs("solve " + QuotedCase("outside_infeasible") + " --format " + format);
    EXPECT_EQ(outcome.code, 1) << outcome.err;
    EXPECT_THAT(outcome.out + outcome.err, ::testing::AnyOf(HasSubstr("INFEASIBLE"), HasSubstr("INCONSISTENT_STATE")));
    EXPECT_THAT(outcome.out, AllOf(Not(HasSubstr("nan")), Not(HasSubstr("inf,"))));
  }
}

TEST(DlcsProgramTest, ExitsWithTwoOnBadInput) {
  EXPECT_EQ(RunDlcs("solve no-such-file.json").code, 2);
  EXPECT_EQ(RunDlcs("solve " + QuotedCase("rlcd") + " --step").code, 2);
  EXPECT_EQ(RunDlcs("solve " + QuotedCase("rlcd") + " --theta 2").code, 2);
  EXPECT_EQ(RunDlcs("solve " + QuotedCase("rlcd") + " --server localhost").code, 2);
  EXPECT_EQ(RunDlcs("solve " + QuotedCase("rlcd") + " --output /no/such/folder/x").code, 2);
  EXPECT_EQ(RunDlcs("").code, 2);
  EXPECT_EQ(SolveText("{\"A\": 1", "").code, 2);
}

TEST(DlcsProgramTest, NamesFileAndFieldOfAProblemThatBreaksARule) {
  const ProgramOutcome outcome =
      SolveText(R"json({"A": [[-1]], "B": [[1, 2]], "N": [[1]], "M": [[2]], "x0": [1], "T": -4, )json"
                R"json("f": ["sin(x)"], "g": [-1]})json",
                "");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("dlcs: standard input: B: "), HasSubstr("dlcs: standard input: T: "),
                                 HasSubstr("dlcs: standard input: f[0]: ")));
}

TEST(DlcsProgramTest, NamesTheOptionThatBreaksARuleOfTheEngine) {
  const ProgramOutcome outcome = SolveText(kEasyProblem, "--at 1,5");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("dlcs: --at[1]: "));
}

TEST(DlcsProgramTest, ExitsWithThreeWhenTimeRunsOut) {
  const ProgramOutcome outcome =
      SolveText(kEasyProblem, "--method wu-chen-iteration --steps 200000 --deadline 0.5 --format json --at 4");
  EXPECT_EQ(outcome.code, 3);
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["summary"]["termination"], "TERMINATION_DEADLINE");
  EXPECT_THAT(outcome.err, HasSubstr("DEADLINE"));
}

TEST(DlcsProgramTest, RefusesToReplaceItsInput) {
  const std::string path = ::testing::TempDir() + "dlcs-program-test-input.json";
  std::filesystem::copy_file(dlcs::testing::CasePath("rlcd"), path, std::filesystem::copy_options::overwrite_existing);
  const std::string link = path + ".link";
  std::filesystem::remove(link);
  std::filesystem::create_hard_link(path, link);
  for (const std::string& output : {path, link}) {
    const ProgramOutcome outcome = RunDlcs("solve " + path + " --format json --output " + output);
    EXPECT_EQ(outcome.code, 2);
    EXPECT_THAT(outcome.err, AllOf(HasSubstr("--output " + output), HasSubstr("is the input")));
  }
  EXPECT_EQ(RunDlcs("solve " + path + " --quiet").code, RunDlcs("solve " + QuotedCase("rlcd") + " --quiet").code);
  for (const std::string& file : {path, link}) std::filesystem::remove(file);
}

TEST(DlcsProgramTest, TakesAHyphenForStandardOutputAndRefusesAFormatForAFile) {
  EXPECT_EQ(SolveText(kEasyProblem, "-q --steps 10 -f csv -o -").out,
            SolveText(kEasyProblem, "--quiet --steps 10 --format csv").out);
  const ProgramOutcome format = SolveText(kEasyProblem, "-o json");
  EXPECT_EQ(format.code, 2);
  EXPECT_THAT(format.err, HasSubstr("did you mean --format json?"));
}

TEST(DlcsProgramTest, ExitsWithThreeWhenItsOutputIsLost) {
  const ProgramOutcome outcome = SolveText(kEasyProblem, "--quiet --steps 10 > /dev/full");
  EXPECT_EQ(outcome.code, 3);
  EXPECT_THAT(outcome.err, HasSubstr("No space left"));
}

TEST(DlcsProgramTest, AnalyzesAndRecommendsACommandThatWorks) {
  const ProgramOutcome outcome = RunDlcs("analyze " + QuotedCase("rlcd") + " --step 1e-5");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("Solution   the one"), HasSubstr("Run ")));
  const std::size_t begin = outcome.out.find("dlcs solve ");
  ASSERT_NE(begin, std::string::npos) << outcome.out;
  const std::size_t end = outcome.out.find('\n', begin);
  const std::string command = outcome.out.substr(begin + 5, end - begin - 5);
  EXPECT_THAT(command, HasSubstr("--step 1e-05"));
  EXPECT_EQ(RunDlcs(command + " --quiet").code, 0) << command;
}

TEST(DlcsProgramTest, RefusesAnAnalysisOfABrokenProblemWithPlaceAndRule) {
  const ProgramOutcome outcome =
      RunDlcs("analyze -", R"(echo '{"A": [[-1]], "B": [[1, 2]], "N": [[1]], "M": [[2]], "x0": [1], "T": 4}' | )");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("standard input: B: "));
  const ProgramOutcome option = RunDlcs("analyze " + QuotedCase("rlcd") + " --theta 3");
  EXPECT_EQ(option.code, 2);
  EXPECT_THAT(option.err, HasSubstr("--theta"));
}

TEST(DlcsProgramTest, ExitsWithOneWhereNoMethodServes) {
  const ProgramOutcome outcome = RunDlcs("analyze " + QuotedCase("outside_triple_integrator") + " --format json");
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  EXPECT_NE(nlohmann::json::parse(outcome.out)["recommendation"]["refusal"], "");
}

TEST(DlcsProgramTest, SendsAFileOfAnotherKindToItsCommand) {
  const std::string lcp = R"(echo '{"M": [[1]], "q": [-1]}' | )";
  EXPECT_THAT(RunDlcs("solve -", lcp).err, HasSubstr("holds one linear complementarity problem; run dlcs lcp"));
  const std::string dcp = R"(echo '{"M": [[1]], "q": {"times": [0, 1], "values": [[0], [-1]]}}' | )";
  EXPECT_THAT(RunDlcs("analyze -", dcp).err, HasSubstr("run dlcs dcp"));
  EXPECT_THAT(RunDlcs("lcp -", dcp).err, HasSubstr("run dlcs dcp"));
  EXPECT_THAT(RunDlcs("dcp -", R"(echo '{"kind": "nonlinear"}' | )").err, HasSubstr("run dlcs solve"));
  EXPECT_THAT(RunDlcs("solve -", R"(echo '{"C": [[0.5]], "d": [1]}' | )").err, HasSubstr("dlcs model"));
}

TEST(DlcsProgramTest, SolvesANonlinearProblem) {
  const std::string example = "solve " + QuotedExample("oscillator-with-stop") + " ";
  const ProgramOutcome table = RunDlcs(example + "--steps 2000");
  EXPECT_EQ(table.code, 0) << table.err;
  EXPECT_THAT(table.out, AllOf(HasSubstr("oscillator with a stop: "), HasSubstr("splitting")));
  EXPECT_THAT(table.err, HasSubstr("iteration"));
  const auto root = nlohmann::json::parse(RunDlcs(example + "--quiet --steps 2000 --format json").out);
  EXPECT_LT(root["summary"]["certificate"]["node_residual"].get<double>(), 1e-9);
  double deepest = 0;
  for (std::size_t k = 0; k < root["trajectory"]["times"].size(); ++k) {
    const double x = root["trajectory"]["x"][2 * k].get<double>(), y = root["trajectory"]["y"][k].get<double>();
    EXPECT_NEAR(y, std::max(0.0, 40 * (x - 0.4)), 1e-8);
    deepest = std::max(deepest, x);
  }
  EXPECT_GT(deepest, 0.4);  // it does reach the stop
}

TEST(DlcsProgramTest, NamesTheMatricesOfOutputsAsInTheFile) {
  const ProgramOutcome outcome =
      RunDlcs("solve -", R"(echo '{"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[1]], "x0": [0], "T": 1,
                                   "outputs": {"names": ["z"], "C": [[1, 2]], "D": [[1], [2]]}}' | )");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("outputs.C: 1 x 2"), HasSubstr("outputs.D: 2 x 1")));
}

TEST(DlcsProgramTest, RefusesWhatIsForLinearProblemsOnly) {
  const std::string nonlinear =
      R"(echo '{"kind": "nonlinear", "f": ["-x1+y1"], "g": ["y1+x1-z"], "x0": [1], "T": 1}' | )";
  const ProgramOutcome formula = RunDlcs("solve -", nonlinear);
  EXPECT_EQ(formula.code, 2);
  EXPECT_THAT(formula.err, HasSubstr("standard input: g[0]: "));
  EXPECT_THAT(RunDlcs("solve - --rule unique", nonlinear).err, HasSubstr("--rule: "));
  EXPECT_THAT(RunDlcs("solve - --rule unique", nonlinear).code, 2);
  const ProgramOutcome method =
      RunDlcs("solve - --method time-stepping",
              R"(echo '{"kind": "nonlinear", "f": ["-x1+y1"], "g": ["y1+x1"], "x0": [1], "T": 1}' | )");
  EXPECT_EQ(method.code, 2) << method.out;
  EXPECT_THAT(method.err, HasSubstr("--method: nonlinear problems are solved by laplace-iteration only"));
  EXPECT_THAT(RunDlcs("analyze -", nonlinear).err, HasSubstr("nonlinear"));
  EXPECT_EQ(RunDlcs("analyze -", nonlinear).code, 2);
}

TEST(DlcsProgramTest, TakesFBesidePiecesOnlyWhereBothSayTheSame) {
  const auto with = [](const std::string& f) {
    return SolveText(
        R"json({"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[1]], "x0": [1], "T": 4, "f": [")json" + f +
            R"json("], "pieces": [{"t0": 0, "f": [1], "g": ["sin(t)"]}, {"t0": 2, "f": ["t"], "g": [0]}]})json",
        "--steps 10 --quiet --format csv");
  };
  const ProgramOutcome same = with("(t<2)*1+(t>=2)*t");
  EXPECT_EQ(same.code, 0) << same.err;
  const ProgramOutcome other = with("(t<2)*1+(t>=2)*t*1.001");
  EXPECT_EQ(other.code, 2);
  EXPECT_THAT(other.err, HasSubstr("f is given as well as pieces, which hold another f"));
}

}  // namespace
}  // namespace dlcs::client
