// SPDX-License-Identifier: Apache-2.0
// The built `dlcs` as people and scripts use it: exit codes, streams, files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "server/dlcs_server.h"
#include "spdlog/spdlog.h"
#include "tests/client/program.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// A scalar problem that is solved in a few milliseconds.
constexpr const char* kEasy =
    R"json('{"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[2]], "x0": [1], "T": 4, "f": ["sin(t)"], "g": [-1]}')json";

std::string Case(const std::string& name) { return std::string("'" DLCS_CASES_DIR "/") + name + ".json'"; }

ProgramOutcome SolveText(const std::string& json, const std::string& options) {
  return RunDlcs("solve - " + options, "echo " + json + " | ");
}

TEST(DlcsProgramTest, PrintsTheResultOnStandardOutputAndTheRestOnStandardError) {
  const ProgramOutcome outcome = RunDlcs("solve " + Case("rlcd"));
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out,
              AllOf(HasSubstr("rlcd: SOLVED within an error of 1e-06 (the default)"), HasSubstr("Certificate"),
                    HasSubstr("LCP residual")));
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("event-located"), HasSubstr("1e-06"), HasSubstr("--tolerance")));
  EXPECT_THAT(outcome.err, Not(HasSubstr("\x1b")));
}

TEST(DlcsProgramTest, TabulatesElevenEvenTimes) {
  const ProgramOutcome outcome = SolveText(kEasy, "--quiet --steps 64");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  for (const char* time : {"\n  0  ", "\n0.4  ", "\n2.8  ", "\n  4  "})
    EXPECT_THAT(outcome.out, HasSubstr(time));
}

TEST(DlcsProgramTest, GivesEveryNodeToPrograms) {
  const ProgramOutcome outcome = SolveText(kEasy, "--steps 64 --format json");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto root = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(root["times"].size(), 65U);
  EXPECT_EQ(root["x"].size(), 65U);
  EXPECT_EQ(root["y"].size(), 65U);
  EXPECT_EQ(root["termination"], "REACHED_END");
  EXPECT_LT(root["certificate"]["node_residual"].get<double>(), 1e-10);
}

TEST(DlcsProgramTest, GivesOnlyTheTimesAskedFor) {
  const ProgramOutcome outcome = SolveText(kEasy, "--format json --at 3.14,0.1 --steps 64");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["times"], nlohmann::json({0.1, 3.14}));
}

TEST(DlcsProgramTest, SolvesOnTheNodesGiven) {
  for (const char* method : {"laplace-iteration", "time-stepping"}) {
    const ProgramOutcome outcome =
        SolveText(kEasy, std::string("--no-estimate-error --format json --grid 0.01,0.03,0.1,1,3 --method ") + method);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(nlohmann::json::parse(outcome.out)["times"],
              nlohmann::json({0.0, 0.01, 0.03, 0.1, 1.0, 3.0, 4.0}));
  }
  const ProgramOutcome outside = SolveText(kEasy, "--grid 1,5");
  EXPECT_EQ(outside.code, 2);
  EXPECT_THAT(outside.err, HasSubstr("dlcs: --grid[1]: 5; must lie in [0, T] = [0, 4]"));
}

// A mass falls from height 1 at unit gravity and stays on the ground from t = sqrt(2) on.
TEST(DlcsProgramTest, LocatesSwitchingTimesForASmallErrorAndShowsThem) {
  const ProgramOutcome outcome = SolveText(kEasy, "--tolerance 1e-9");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("Method event-located: for an error of 1e-09 a few steps of high order"),
                                 HasSubstr("Switching times"), HasSubstr("start"), HasSubstr("estimated error")));
  EXPECT_THAT(outcome.err, HasSubstr("steps as short as the error that is allowed needs"));
}

TEST(DlcsProgramTest, TakesAToleranceInsteadOfAStepWithEveryMethod) {
  const auto last_x = [](const std::string& options) {
    const ProgramOutcome outcome = SolveText(kEasy, "--at 4 --quiet --format json " + options);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out)["x"][0][0].get<double>();
  };
  const double exact = last_x("--method event-located --tolerance 1e-12");
  for (const char* method : {"exponential-march", "laplace-iteration", "time-stepping"}) {
    EXPECT_NEAR(last_x(std::string("--tolerance 1e-3 --method ") + method), exact, 1e-3) << method;
  }
}

TEST(DlcsProgramTest, SolvesStepsByNewtonsMethodAndShowsItsRate) {
  const std::string method = "--quiet --steps 64 --method time-stepping ";
  const ProgramOutcome table = SolveText(kEasy, method + "--step-solver newton");
  EXPECT_EQ(table.code, 0) << table.err;
  EXPECT_THAT(table.out, AllOf(HasSubstr("Newton's method\n"), HasSubstr(" iterations in "),
                               HasSubstr("residuals of the step to t = "), HasSubstr("κ")));

  const auto root = [&](const std::string& options) {
    return nlohmann::json::parse(SolveText(kEasy, method + "--at 4 --format json " + options).out);
  };
  const nlohmann::json newton = root("--step-solver newton"), substitution = root("");
  EXPECT_EQ(substitution["newton"], nullptr);
  EXPECT_GE(newton["cost"]["newton_iterations"].get<int>(), 64);
  EXPECT_EQ(newton["cost"]["substituted_steps"], 0);
  EXPECT_GE(newton["newton"]["residuals"].size(), 2U);
  EXPECT_NEAR(newton["x"][0][0].get<double>(), substitution["x"][0][0].get<double>(), 1e-12);
  // The averaged scheme is another one, of second order.
  EXPECT_GT(std::abs(root("--average-y")["x"][0][0].get<double>() - substitution["x"][0][0].get<double>()),
            1e-6);
}

TEST(DlcsProgramTest, TakesTheKernelFromContoursWithTheSameAnswer) {
  const auto root = [](const std::string& kernel) {
    return nlohmann::json::parse(
        SolveText(kEasy,
                  "--quiet --steps 200 --at 4 --format json --method laplace-iteration --kernel " + kernel)
            .out);
  };
  const nlohmann::json phi = root("phi-functions"), contour = root("contour");
  EXPECT_EQ(phi["kernel"]["blocks_by_contour"], 0);
  EXPECT_GT(contour["kernel"]["blocks_by_contour"].get<int>(), 0);
  EXPECT_EQ(contour["kernel"]["fallback"], "");
  EXPECT_NEAR(phi["x"][0][0].get<double>(), contour["x"][0][0].get<double>(), 1e-10);
  const ProgramOutcome paper = SolveText(
      kEasy, "--quiet --steps 50 --method paper-iteration --interpolation cubic-spline --contour remark-2-4");
  EXPECT_EQ(paper.code, 0) << paper.err;
  EXPECT_THAT(paper.out, HasSubstr("Contour (Remark 2.4)"));
}

TEST(DlcsProgramTest, RefusesNewtonAndAveragingWithoutTheirMethod) {
  for (const std::string option : {"--step-solver newton", "--average-y"}) {
    const ProgramOutcome outcome = SolveText(kEasy, option);
    EXPECT_EQ(outcome.code, 2);
    EXPECT_EQ(outcome.out, "");
    EXPECT_THAT(outcome.err, HasSubstr("dlcs: " + option.substr(0, option.find(' ')) + ": "));
    EXPECT_THAT(outcome.err, HasSubstr("time-stepping"));
  }
}

TEST(DlcsProgramTest, LandsInelasticallyOnlyWhereAskedTo) {
  constexpr const char* kFall =
      R"json('{"A": [[0, 1], [0, 0]], "B": [[0], [1]], "N": [[1, 0]], "M": [[0]], "x0": [1, 0], )json"
      R"json("T": 2, "f": [0, -1]}')json";
  EXPECT_EQ(SolveText(kFall, "--quiet").code, 1);
  const ProgramOutcome outcome =
      SolveText(kFall, "--inelastic-impact --steps 2000 --at 1,2 --format json --quiet");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto root = nlohmann::json::parse(outcome.out);
  EXPECT_NEAR(root["x"][0][0].get<double>(), 0.5, 2e-3);
  EXPECT_NEAR(root["x"][1][0].get<double>(), 0, 2e-3);
  EXPECT_NEAR(root["y"][1][0].get<double>(), 1, 1e-6);
}

TEST(DlcsProgramTest, WritesTheFileAndSaysWhere) {
  const std::string path = testing::TempDir() + "dlcs-program-test.csv";
  const ProgramOutcome outcome = SolveText(kEasy, "--steps 10 --format csv --output " + path);
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
    const ProgramOutcome outcome = RunDlcs("solve " + Case("outside_infeasible") + " --format " + format);
    EXPECT_EQ(outcome.code, 1) << outcome.err;
    EXPECT_THAT(outcome.out + outcome.err,
                testing::AnyOf(HasSubstr("INFEASIBLE"), HasSubstr("INCONSISTENT_STATE")));
    EXPECT_THAT(outcome.out, AllOf(Not(HasSubstr("nan")), Not(HasSubstr("inf,"))));
  }
}

TEST(DlcsProgramTest, ExitsWithTwoOnBadInput) {
  EXPECT_EQ(RunDlcs("solve no-such-file.json").code, 2);
  EXPECT_EQ(RunDlcs("solve " + Case("rlcd") + " --step").code, 2);
  EXPECT_EQ(RunDlcs("solve " + Case("rlcd") + " --theta 2").code, 2);
  EXPECT_EQ(RunDlcs("solve " + Case("rlcd") + " --server localhost").code, 2);
  EXPECT_EQ(RunDlcs("solve " + Case("rlcd") + " --output /no/such/folder/x").code, 2);
  EXPECT_EQ(RunDlcs("").code, 2);
  EXPECT_EQ(SolveText("'{\"A\": 1'", "").code, 2);
}

TEST(DlcsProgramTest, NamesFileAndFieldOfAProblemThatBreaksARule) {
  const ProgramOutcome outcome = SolveText(
      R"json('{"A": [[-1]], "B": [[1, 2]], "N": [[1]], "M": [[2]], "x0": [1], "T": -4, )json"
      R"json("f": ["sin(x)"], "g": [-1]}')json",
      "");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err,
              AllOf(HasSubstr("dlcs: standard input: B: "), HasSubstr("dlcs: standard input: T: "),
                    HasSubstr("dlcs: standard input: f[0]: ")));
}

TEST(DlcsProgramTest, NamesTheOptionThatBreaksARuleOfTheEngine) {
  const ProgramOutcome outcome = SolveText(kEasy, "--at 1,5");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("dlcs: --at[1]: "));
}

TEST(DlcsProgramTest, ExitsWithThreeWhenNobodyServes) {
  const ProgramOutcome outcome = RunDlcs("solve " + Case("rlcd") + " --server 127.0.0.1:1");
  EXPECT_EQ(outcome.code, 3);
  EXPECT_THAT(outcome.err, HasSubstr("dlcsd --listen 127.0.0.1:1"));
  EXPECT_EQ(outcome.out, "");
}

TEST(DlcsProgramTest, ExitsWithThreeWhenTimeRunsOut) {
  const ProgramOutcome outcome =
      SolveText(kEasy, "--method paper-iteration --steps 200000 --deadline 0.5 --format json --at 4");
  EXPECT_EQ(outcome.code, 3);
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["termination"], "DEADLINE");
  EXPECT_THAT(outcome.err, HasSubstr("DEADLINE"));
}

TEST(DlcsProgramTest, RefusesToReplaceItsInput) {
  const std::string path = testing::TempDir() + "dlcs-program-test-input.json";
  std::filesystem::copy_file(DLCS_EXAMPLES_DIR "/../../tests/cases/rlcd.json", path,
                             std::filesystem::copy_options::overwrite_existing);
  const std::string link = path + ".link";
  std::filesystem::remove(link);
  std::filesystem::create_hard_link(path, link);
  for (const std::string& output : {path, link}) {
    const ProgramOutcome outcome = RunDlcs("solve " + path + " --format json --output " + output);
    EXPECT_EQ(outcome.code, 2);
    EXPECT_THAT(outcome.err, AllOf(HasSubstr("--output " + output), HasSubstr("is the input")));
  }
  EXPECT_EQ(RunDlcs("solve " + path + " --quiet").code, RunDlcs("solve " + Case("rlcd") + " --quiet").code);
  for (const std::string& file : {path, link}) std::filesystem::remove(file);
}

TEST(DlcsProgramTest, TakesAHyphenForStandardOutputAndRefusesAFormatForAFile) {
  EXPECT_EQ(SolveText(kEasy, "-q --steps 10 -f csv -o -").out, SolveText(kEasy, "--quiet --steps 10 --format csv").out);
  const ProgramOutcome format = SolveText(kEasy, "-o json");
  EXPECT_EQ(format.code, 2);
  EXPECT_THAT(format.err, HasSubstr("did you mean --format json?"));
}

TEST(DlcsProgramTest, SolvesNowhereElseThanWasMeant) {
  const ProgramOutcome empty = RunDlcs("solve " + Case("rlcd") + " --server \"$NOT_SET\"");
  EXPECT_EQ(empty.code, 2);
  EXPECT_THAT(empty.err, AllOf(HasSubstr("--server"), HasSubstr("is empty")));
  const ProgramOutcome variable = RunDlcs("solve " + Case("rlcd"), "DLCS_SERVER= ");
  EXPECT_EQ(variable.code, 2);
  EXPECT_THAT(variable.err, HasSubstr("DLCS_SERVER is set and empty"));
}

TEST(DlcsProgramTest, TakesTheServerFromTheEnvironmentOrAContext) {
  spdlog::set_level(spdlog::level::off);
  ServerConfig config;
  config.listen = "127.0.0.1:0";
  const auto server = DlcsServer::Start(config);
  ASSERT_TRUE(server.ok()) << server.status();
  const std::string address = (*server)->address();
  const std::string solve = "solve " + Case("rlcd") + " --steps 50 ";
  const ProgramOutcome variable = RunDlcs(solve, "DLCS_SERVER=" + address + " ");
  EXPECT_THAT(variable.err, HasSubstr("dlcs: on " + address + " (DLCS_SERVER)"));
  EXPECT_THAT(RunDlcs(solve + "--local", "DLCS_SERVER=" + address + " ").err, Not(HasSubstr("dlcs: on ")));

  const std::string folder = testing::TempDir() + "dlcs-program-test-config";
  std::filesystem::remove_all(folder);
  const std::string config_home = "XDG_CONFIG_HOME=" + folder + " ";
  EXPECT_EQ(RunDlcs("context set lab --server " + address, config_home).code, 0);
  EXPECT_EQ(RunDlcs("context set far --server far.example:1 --tls", config_home).code, 0);
  EXPECT_EQ(RunDlcs("context use lab", config_home).code, 0);
  EXPECT_THAT(RunDlcs("context list", config_home).out,
              AllOf(HasSubstr("* lab"), HasSubstr("  far"), HasSubstr("encrypted")));
  EXPECT_THAT(RunDlcs(solve, config_home).err, HasSubstr("dlcs: on " + address + " (context lab)"));
  EXPECT_EQ(RunDlcs("health", config_home).out, "SERVING\n");
  EXPECT_EQ(RunDlcs(solve + "--context lab", config_home).code, 0);
  const ProgramOutcome unknown = RunDlcs(solve, config_home + "DLCS_CONTEXT=lob ");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("did you mean lab?"));
  EXPECT_EQ(RunDlcs("context delete lab", config_home).code, 0);
  EXPECT_THAT(RunDlcs(solve, config_home).err, Not(HasSubstr("dlcs: on ")));
  std::filesystem::remove_all(folder);
}

TEST(DlcsProgramTest, ExitsWithThreeWhenItsOutputIsLost) {
  const ProgramOutcome outcome = SolveText(kEasy, "--quiet --steps 10 > /dev/full");
  EXPECT_EQ(outcome.code, 3);
  EXPECT_THAT(outcome.err, HasSubstr("No space left"));
}

TEST(DlcsProgramTest, AnalysesAndRecommendsACommandThatWorks) {
  const ProgramOutcome outcome = RunDlcs("analyze " + Case("rlcd") + " --step 1e-5");
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
  const ProgramOutcome outcome = RunDlcs(
      "analyze -", R"(echo '{"A": [[-1]], "B": [[1, 2]], "N": [[1]], "M": [[2]], "x0": [1], "T": 4}' | )");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("standard input: B: "));
  const ProgramOutcome option = RunDlcs("analyze " + Case("rlcd") + " --theta 3");
  EXPECT_EQ(option.code, 2);
  EXPECT_THAT(option.err, HasSubstr("--theta"));
}

TEST(DlcsProgramTest, ExitsWithOneWhereNoMethodServes) {
  const ProgramOutcome outcome = RunDlcs("analyze " + Case("outside_triple_integrator") + " --format json");
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  EXPECT_NE(nlohmann::json::parse(outcome.out)["recommendation"]["refusal"], "");
}

TEST(DlcsProgramTest, MakesAProblemOfAnEconomyThatItThenSolves) {
  const std::string economy =
      std::string(R"json(echo '{"C": [[0.5]], "A": [[-1]], "B": [[0.25]], "d": [1], "T": 1}')json");
  const ProgramOutcome model = RunDlcs("model input-output -", economy + " | ");
  ASSERT_EQ(model.code, 0) << model.err;
  const auto problem = nlohmann::json::parse(model.out);
  EXPECT_EQ(problem["M"], nlohmann::json({{0.5}}));
  EXPECT_EQ(problem["N"], nlohmann::json({{-1.0}}));
  EXPECT_EQ(problem["rule"], "least-element");
  EXPECT_THAT(model.err, AllOf(Not(HasSubstr("JSON")), HasSubstr("M-matrix"), HasSubstr("1/(3κ)")));
  // Demand is met: y = 2 x, so x' = -x / 2.
  const ProgramOutcome solved = SolveText("'" + model.out + "'", "--at 1 --format json --quiet");
  ASSERT_EQ(solved.code, 0) << solved.err;
  EXPECT_NEAR(nlohmann::json::parse(solved.out)["x"][0][0].get<double>(), std::exp(-0.5), 1e-6);
}

TEST(DlcsProgramTest, NamesWhatIsWrongWithAModel) {
  const ProgramOutcome negative = RunDlcs(
      "model input-output -", R"(echo '{"C": [[-1]], "A": [[-1]], "B": [[1]], "d": [1], "T": 1}' | )");
  EXPECT_EQ(negative.code, 2);
  EXPECT_THAT(negative.err, HasSubstr("standard input: C[0][0]: -1; must"));
  const ProgramOutcome demand = RunDlcs(
      "model input-output -", R"(echo '{"C": [[0.5]], "A": [[-1]], "B": [[1]], "d": [1, 2], "T": 1}' | )");
  EXPECT_EQ(demand.code, 2);
  EXPECT_THAT(demand.err, HasSubstr("standard input: d: "));
  const ProgramOutcome missing = RunDlcs("model input-output -", R"(echo '{"C": [[0.5]], "G": 1}' | )");
  EXPECT_EQ(missing.code, 2);
  EXPECT_THAT(missing.err, AllOf(HasSubstr("A"), HasSubstr("d"), HasSubstr("T"), HasSubstr("G")));
  EXPECT_EQ(RunDlcs("model growth x.json").code, 2);
}

TEST(DlcsProgramTest, MakesASignoriniProblemThatItThenSolves) {
  const ProgramOutcome model = RunDlcs("model signorini --cells 8 --coefficient 0.2 --horizon 0.25");
  ASSERT_EQ(model.code, 0) << model.err;
  const auto problem = nlohmann::json::parse(model.out);
  EXPECT_EQ(problem["A"]["kronecker_sum"].size(), 2u);
  EXPECT_EQ(problem["f"]["of"].size(), 7u);
  // The same system with every entry written down.
  nlohmann::json dense = problem;
  const auto rows = [](const nlohmann::json& sparse) {
    nlohmann::json all(sparse["rows"].get<std::size_t>(), std::vector<double>(sparse["columns"].get<std::size_t>(), 0.0));
    for (std::size_t k = 0; k < sparse["values"].size(); ++k) {
      all[sparse["row_indices"][k].get<std::size_t>()][sparse["column_indices"][k].get<std::size_t>()] = sparse["values"][k];
    }
    return all;
  };
  const nlohmann::json difference = rows(problem["A"]["kronecker_sum"][0]);
  nlohmann::json a(49, std::vector<double>(49, 0.0));
  for (std::size_t q = 0; q < 7; ++q) {
    for (std::size_t i = 0; i < 7; ++i) {
      for (std::size_t j = 0; j < 7; ++j) {
        for (const auto& [row, column] : {std::pair(q * 7 + i, q * 7 + j), std::pair(i * 7 + q, j * 7 + q)}) {
          a[row][column] = a[row][column].get<double>() + difference[i][j].get<double>();
        }
      }
    }
  }
  dense["A"] = a;
  for (const char* key : {"B", "N", "M"}) dense[key] = rows(problem[key]);
  const std::string options = "--method exponential-march --steps 100 --at 0.25 --format json --quiet";
  const ProgramOutcome structured = SolveText("'" + model.out + "'", options);
  const ProgramOutcome written_down = SolveText("'" + dense.dump() + "'", options);
  ASSERT_EQ(structured.code, 0) << structured.err;
  ASSERT_EQ(written_down.code, 0) << written_down.err;
  const auto x = nlohmann::json::parse(structured.out)["x"][0].get<std::vector<double>>();
  const auto expected = nlohmann::json::parse(written_down.out)["x"][0].get<std::vector<double>>();
  ASSERT_EQ(x.size(), 49u);
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(x[i], expected[i], 1e-11) << i;
}

TEST(DlcsProgramTest, NamesWhatIsWrongWithASignoriniModel) {
  EXPECT_THAT(RunDlcs("model signorini").err, HasSubstr("needs --cells"));
  EXPECT_THAT(RunDlcs("model signorini --cells 5000").err, HasSubstr("--cells: is 5000, must be from 2 to 4096"));
  EXPECT_THAT(RunDlcs("model signorini x.json --cells 4").err, HasSubstr("takes no file"));
  EXPECT_THAT(RunDlcs("model input-output x.json --cells 4").err, HasSubstr("--cells"));
  EXPECT_EQ(RunDlcs("model input-output").code, 2);
}

TEST(DlcsProgramTest, SendsAFileOfAnotherKindToItsCommand) {
  const std::string lcp = R"(echo '{"M": [[1]], "q": [-1]}' | )";
  EXPECT_THAT(RunDlcs("solve -", lcp).err,
              HasSubstr("holds one linear complementarity problem; run dlcs lcp"));
  const std::string dcp = R"(echo '{"M": [[1]], "q": {"times": [0, 1], "values": [[0], [-1]]}}' | )";
  EXPECT_THAT(RunDlcs("analyze -", dcp).err, HasSubstr("run dlcs dcp"));
  EXPECT_THAT(RunDlcs("lcp -", dcp).err, HasSubstr("run dlcs dcp"));
  EXPECT_THAT(RunDlcs("dcp -", R"(echo '{"kind": "nonlinear"}' | )").err, HasSubstr("run dlcs solve"));
  EXPECT_THAT(RunDlcs("solve -", R"(echo '{"C": [[0.5]], "d": [1]}' | )").err, HasSubstr("dlcs model"));
}

TEST(DlcsProgramTest, SaysWhichOptionsChangedNothing) {
  const std::string problem =
      R"(echo '{"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[1]], "x0": [1], "T": 1}' | )";
  const ProgramOutcome outcome = RunDlcs("solve - --interpolation cubic-spline", problem);
  EXPECT_EQ(outcome.code, 0);
  EXPECT_THAT(outcome.err, HasSubstr("--interpolation changed nothing: it is for paper-iteration"));
  EXPECT_EQ(RunDlcs("solve - --interpolation cubic-spline --quiet", problem).err, "");
}

TEST(DlcsProgramTest, SolvesAnLcp) {
  const ProgramOutcome outcome =
      RunDlcs("lcp - --format json", R"(echo '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}' | )");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto root = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(root["verdict"], "SOLVED");
  EXPECT_NEAR(root["y"][0].get<double>(), 4.0 / 3, 1e-14);
  EXPECT_LT(root["residual"].get<double>(), 1e-14);
  const ProgramOutcome none = RunDlcs("lcp -", R"(echo '{"M": [[0]], "q": [-1]}' | )");
  EXPECT_EQ(none.code, 1);
  EXPECT_THAT(none.out, HasSubstr("INFEASIBLE"));
}

TEST(DlcsProgramTest, ListsAllSolutionsOfAnLcp) {
  const std::string lcp = R"(echo '{"M": [[1, 1], [1, 1]], "q": [-1, -1], "rule": "least-norm"}' | )";
  const ProgramOutcome table = RunDlcs("lcp - --all", lcp);
  EXPECT_EQ(table.code, 0) << table.err;
  EXPECT_THAT(table.out, AllOf(HasSubstr("J (y > 0)      {0, 1}"), HasSubstr("2 basic solutions"),
                               HasSubstr("a continuum with w = 0 on {0, 1}")));
  const auto root = nlohmann::json::parse(RunDlcs("lcp - --format json", lcp).out);
  EXPECT_NEAR(root["y"][0].get<double>(), 0.5, 1e-12);
  EXPECT_EQ(root["all"], nullptr);
}

TEST(DlcsProgramTest, RefusesASelectorWithoutItsRule) {
  const ProgramOutcome outcome =
      RunDlcs("lcp -", R"(echo '{"M": [[1]], "q": [-1], "selector": {"C": [[1]], "b": [0]}}' | )");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("standard input: selector: "));
}

TEST(DlcsProgramTest, ShowsTwoSolutionsOfExampleTen) {
  const std::string example = "dcp '" DLCS_EXAMPLES_DIR "/example-10-dcp.json'";
  const ProgramOutcome solved = RunDlcs(example + " --step 0.01");
  EXPECT_EQ(solved.code, 0) << solved.err;
  EXPECT_THAT(solved.out,
              AllOf(HasSubstr("SOLVED"), HasSubstr("  1   0.25   0.25   0.25\n"), HasSubstr("unknown")));
  const auto other = nlohmann::json::parse(
      RunDlcs(example + " --format json --check '" DLCS_EXAMPLES_DIR "/example-10-dcp-other.json'").out);
  EXPECT_EQ(other["certificate"]["start"], 0);
  EXPECT_GE(other["certificate"]["least_increase"].get<double>(), 0);
  EXPECT_GE(other["certificate"]["least_w"].get<double>(), -1e-15);
  EXPECT_LE(other["certificate"]["complementarity"].get<double>(), 1e-15);
}

TEST(DlcsProgramTest, NamesWhatIsWrongWithADcp) {
  const ProgramOutcome start =
      RunDlcs("dcp -", R"(echo '{"M": [[1]], "q": {"times": [0], "values": [[-1]]}}' | )");
  EXPECT_EQ(start.code, 2);
  EXPECT_THAT(start.err, HasSubstr("standard input: q.values[0][0]: -1; q(0) must be >= 0"));
  const std::string sound = R"(echo '{"M": [[0]], "q": {"times": [0, 1], "values": [[0], [-1]]}}' | )";
  const ProgramOutcome none = RunDlcs("dcp -", sound);
  EXPECT_EQ(none.code, 1);
  EXPECT_THAT(none.out,
              AllOf(HasSubstr("NOT SOLVED"), HasSubstr("INFEASIBLE"), Not(HasSubstr("Certificate"))));
  EXPECT_EQ(RunDlcs("dcp - --step 0", sound).code, 2);
  EXPECT_EQ(RunDlcs("dcp - --check no/such/path.json", sound).code, 2);
  EXPECT_EQ(RunDlcs("dcp - --step 1 --check v.json", sound).code, 2);
}

TEST(DlcsProgramTest, SolvesANonlinearProblem) {
  const std::string example = "solve '" DLCS_EXAMPLES_DIR "/oscillator-with-stop.json' ";
  const ProgramOutcome table = RunDlcs(example + "--steps 2000");
  EXPECT_EQ(table.code, 0) << table.err;
  EXPECT_THAT(table.out, AllOf(HasSubstr("oscillator with a stop: "), HasSubstr("splitting")));
  EXPECT_THAT(table.err, HasSubstr("iteration"));
  const auto root = nlohmann::json::parse(RunDlcs(example + "--quiet --steps 2000 --format json").out);
  EXPECT_LT(root["certificate"]["node_residual"].get<double>(), 1e-9);
  double deepest = 0;
  for (std::size_t k = 0; k < root["x"].size(); ++k) {
    const double x = root["x"][k][0].get<double>(), y = root["y"][k][0].get<double>();
    EXPECT_NEAR(y, std::max(0.0, 40 * (x - 0.4)), 1e-8);
    deepest = std::max(deepest, x);
  }
  EXPECT_GT(deepest, 0.4);  // it does reach the stop
}

TEST(DlcsProgramTest, RefusesWhatIsForLinearProblemsOnly) {
  const std::string nonlinear =
      R"(echo '{"kind": "nonlinear", "f": ["-x1+y1"], "g": ["y1+x1-z"], "x0": [1], "T": 1}' | )";
  const ProgramOutcome formula = RunDlcs("solve -", nonlinear);
  EXPECT_EQ(formula.code, 2);
  EXPECT_THAT(formula.err, HasSubstr("standard input: g[0]: "));
  EXPECT_THAT(RunDlcs("solve - --rule unique", nonlinear).err, HasSubstr("--rule: "));
  EXPECT_THAT(RunDlcs("solve - --rule unique", nonlinear).code, 2);
  EXPECT_THAT(RunDlcs("analyze -", nonlinear).err, HasSubstr("nonlinear"));
  EXPECT_EQ(RunDlcs("analyze -", nonlinear).code, 2);
}

TEST(DlcsProgramTest, GivesTheSameAnswerFromAServer) {
  spdlog::set_level(spdlog::level::off);  // passing tests print nothing
  ServerConfig config;
  config.listen = "127.0.0.1:0";
  const auto server = DlcsServer::Start(config);
  ASSERT_TRUE(server.ok()) << server.status();
  const std::string where = " --server " + (*server)->address();
  const std::string solve = "solve " + Case("leontief_stock") + " --format csv --quiet";
  const ProgramOutcome here = RunDlcs(solve);
  const ProgramOutcome there = RunDlcs(solve + where);
  EXPECT_EQ(here.code, 0) << here.err;
  EXPECT_EQ(there.code, 0) << there.err;
  EXPECT_EQ(here.out, there.out);

  const ProgramOutcome capabilities = RunDlcs("capabilities --format json" + where);
  EXPECT_EQ(capabilities.code, 0) << capabilities.err;
  EXPECT_GT(nlohmann::json::parse(capabilities.out)["max_states"].get<int>(), 0);
  const ProgramOutcome refused =
      SolveText(R"('{"A": [[-1]], "B": [[1, 2]], "N": [[1]], "M": [[2]], "x0": [1], "T": 4}')", where);
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("standard input: B: "));
}

const std::string kRectifierEnsemble =
    "ensemble '" DLCS_EXAMPLES_DIR "/rectifier.json' '" DLCS_EXAMPLES_DIR "/rectifier-members.json' ";

TEST(DlcsProgramTest, AnEnsembleHasALineForEachMemberInTheirOrder) {
  const ProgramOutcome outcome = RunDlcs(kRectifierEnsemble + "--steps 400 --threads 2");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(testing::AnyOf(HasSubstr("rectifier: 6 solved"), HasSubstr("rectifier: 6 reached T")),
                                 HasSubstr("half the voltage"), HasSubstr("residual"),
                                 HasSubstr("x1"), HasSubstr("shared")));
  EXPECT_LT(outcome.out.find("charged before"), outcome.out.find("with a load"));
}

TEST(DlcsProgramTest, AnEnsembleGivesProgramsALineForEachMemberOrTime) {
  const ProgramOutcome json = RunDlcs(kRectifierEnsemble + "--steps 400 --at 1 --format json");
  ASSERT_EQ(json.code, 0) << json.err;
  std::istringstream lines(json.out);
  std::map<int, double> x1;
  for (std::string line; std::getline(lines, line);) {
    const auto member = nlohmann::json::parse(line);
    EXPECT_EQ(member["termination"], "REACHED_END");
    EXPECT_EQ(member["times"], nlohmann::json({1.0}));
    x1[member["member"].get<int>()] = member["x"][0][0].get<double>();
  }
  ASSERT_EQ(x1.size(), 6U);
  // Each is the solve of its own problem.
  const ProgramOutcome own =
      RunDlcs("solve '" DLCS_EXAMPLES_DIR "/rectifier.json' --steps 400 --at 1 --format json --quiet");
  EXPECT_EQ(x1[0], nlohmann::json::parse(own.out)["x"][0][0].get<double>());
  // The problem is homogeneous of degree one: half the voltage, half the charge.
  EXPECT_NEAR(x1[1], 0.5 * x1[0], 1e-12);

  const ProgramOutcome csv = RunDlcs(kRectifierEnsemble + "--steps 10 --no-estimate-error --at 0,1 --format csv --quiet");
  EXPECT_EQ(csv.code, 0);
  EXPECT_EQ(csv.err, "");
  EXPECT_THAT(csv.out, AllOf(HasSubstr("member,label,t,x1,y1,w1\n"), HasSubstr("\n2,charged before,0,8,")));
}

TEST(DlcsProgramTest, AnEnsembleSaysWhatIsWrongWithAMember) {
  const std::string problem = "ensemble '" DLCS_EXAMPLES_DIR "/rectifier.json' - ";
  const ProgramOutcome shape = RunDlcs(problem, "echo '[{\"x0\": [1, 2]}]' | ");
  EXPECT_EQ(shape.code, 2);
  EXPECT_THAT(shape.err, HasSubstr("dlcs: standard input: members[0].x0: 2 components"));
  EXPECT_EQ(shape.out, "");
  const ProgramOutcome key = RunDlcs(problem, "echo '[{\"A\": [[1]]}]' | ");
  EXPECT_EQ(key.code, 2);
  EXPECT_THAT(key.err, HasSubstr("members[0]: \"A\""));
  const ProgramOutcome none = RunDlcs(problem, "echo 'x1' | ");
  EXPECT_EQ(none.code, 2);
  EXPECT_THAT(none.err, HasSubstr("at least one"));
}

TEST(DlcsProgramTest, AnEnsembleWithAMemberThatHasNoSolutionSaysWhichAndEndsWithOne) {
  const std::string members = testing::TempDir() + "dlcs-members.json";
  std::ofstream(members) << R"([{}, {"g": [-1]}])";
  const ProgramOutcome outcome =
      RunDlcs("ensemble - '" + members + "' --steps 10",
              R"(echo '{"A": [[-1]], "B": [[1]], "N": [[0]], "M": [[0]], "x0": [1], "T": 4, "g": [1]}' | )");
  std::filesystem::remove(members);
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr(", 1 failed"), HasSubstr("Member 1: ")));
}

TEST(DlcsNamesTest, StandInTheOutputOfASolve) {
  const std::string solve = "solve '" DLCS_EXAMPLES_DIR "/named-rectifier.json' --quiet ";
  const ProgramOutcome csv = RunDlcs(solve + "--tolerance 1e-8 --at 0.5,1 --format csv");
  EXPECT_EQ(csv.code, 0) << csv.err;
  EXPECT_THAT(csv.out, HasSubstr("t,i,v,diode,w(diode)\n0.5,"));
  const auto root = nlohmann::json::parse(RunDlcs(solve + "--tolerance 1e-8 --at 0.5,1 --format json").out);
  EXPECT_EQ(root["states"], nlohmann::json({"i", "v"}));
  EXPECT_EQ(root["pairs"], nlohmann::json({"diode"}));
  for (std::size_t k = 0; k < 2; ++k) {
    // The diode carries a current or blocks; w is the current.
    EXPECT_EQ(root["y"][k][0].get<double>() * root["w"][k][0].get<double>(), 0);
    EXPECT_NEAR(root["w"][k][0].get<double>(), root["x"][k][0].get<double>(), 1e-6);
  }
  EXPECT_THAT(RunDlcs(solve + "--tolerance 1e-8").out, ::testing::ContainsRegex("switch +diode +-"));
}

TEST(DlcsProgramTest, TakesFBesidePiecesOnlyWhereBothSayTheSame) {
  const auto with = [](const std::string& f) {
    return SolveText(R"json('{"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[1]], "x0": [1], "T": 4, "f": [")json" + f +
                         R"json("], "pieces": [{"t0": 0, "f": [1], "g": ["sin(t)"]}, {"t0": 2, "f": ["t"], "g": [0]}]}')json",
                     "--steps 10 --quiet --format csv");
  };
  const ProgramOutcome same = with("(t<2)*1+(t>=2)*t");
  EXPECT_EQ(same.code, 0) << same.err;
  const ProgramOutcome other = with("(t<2)*1+(t>=2)*t*1.001");
  EXPECT_EQ(other.code, 2);
  EXPECT_THAT(other.err, HasSubstr("f is given beside pieces, which hold another f"));
}

TEST(DlcsNamesTest, StandInRefusals) {
  auto root = nlohmann::json::parse(R"json({"A": [["-1/R"]], "B": [[1]], "N": [[1]], "M": [[1]], "x0": [0, 1], "T": 1,
                                        "states": ["vC"], "pairs": ["D1"], "parameters": {"R": 2}, "g": ["1/(t-5)*S"]})json");
  const auto error_of = [&root] { return SolveText("'" + root.dump() + "'", "--quiet").err; };
  EXPECT_THAT(error_of(), AllOf(HasSubstr("x0: 2 components"), HasSubstr("g[0] (D1)"), HasSubstr("S")));
  root["parameters"]["S"] = 1;
  root["x0"] = {0};
  EXPECT_EQ(error_of(), "");
  root["pairs"] = {"vC"};
  EXPECT_THAT(error_of(), HasSubstr("pairs[0]: \"vC\"; is the name of states[0] already"));
  root["pairs"] = {"D1"};
  root["A"] = {{"-1/Q"}};
  EXPECT_THAT(error_of(), AllOf(HasSubstr("A[0][0] (vC, vC)"), HasSubstr("-1/Q")));
}

TEST(DlcsNamesTest, MeanVariablesInNonlinearFormulas) {
  const ProgramOutcome named = SolveText(R"json('{"kind": "nonlinear", "T": 1,
      "states": ["pos", "v"], "pairs": ["stop"], "parameters": {"k": 40},
      "f": ["v", "-2*pos - stop"], "g": ["stop - k*(pos - 0.4)"], "x0": [0, 1]}')json",
                                         "--quiet --steps 50 --at 1 --format csv");
  const ProgramOutcome plain = SolveText(R"json('{"kind": "nonlinear", "T": 1,
      "f": ["x2", "-2*x1 - y1"], "g": ["y1 - 40*(x1 - 0.4)"], "x0": [0, 1]}')json",
                                         "--quiet --steps 50 --at 1 --format csv");
  EXPECT_EQ(named.code, 0) << named.err;
  EXPECT_EQ(named.out.substr(0, named.out.find('\n')), "t,pos,v,stop,w(stop)");
  EXPECT_EQ(named.out.substr(named.out.find('\n')), plain.out.substr(plain.out.find('\n')));
}

}  // namespace
}  // namespace dlcs::client
