// SPDX-License-Identifier: Apache-2.0
// `dlcs model`: problems of whole fields.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/client/cli/program.h"
#include "tests/support/paths.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(DlcsModelTest, MakesAProblemOfAnEconomyThatItThenSolves) {
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
  const ProgramOutcome solved = SolveText(model.out, "--at 1 --format json --quiet");
  ASSERT_EQ(solved.code, 0) << solved.err;
  EXPECT_NEAR(nlohmann::json::parse(solved.out)["trajectory"]["x"][0].get<double>(), std::exp(-0.5), 1e-6);
}

TEST(DlcsModelTest, NamesWhatIsWrongWithAModel) {
  const ProgramOutcome negative =
      RunDlcs("model input-output -", R"(echo '{"C": [[-1]], "A": [[-1]], "B": [[1]], "d": [1], "T": 1}' | )");
  EXPECT_EQ(negative.code, 2);
  EXPECT_THAT(negative.err, HasSubstr("standard input: C[0][0]: -1; must"));
  const ProgramOutcome demand =
      RunDlcs("model input-output -", R"(echo '{"C": [[0.5]], "A": [[-1]], "B": [[1]], "d": [1, 2], "T": 1}' | )");
  EXPECT_EQ(demand.code, 2);
  EXPECT_THAT(demand.err, HasSubstr("standard input: d: "));
  const ProgramOutcome missing = RunDlcs("model input-output -", R"(echo '{"C": [[0.5]], "G": 1}' | )");
  EXPECT_EQ(missing.code, 2);
  EXPECT_THAT(missing.err, AllOf(HasSubstr("A"), HasSubstr("d"), HasSubstr("T"), HasSubstr("G")));
  EXPECT_EQ(RunDlcs("model growth x.json").code, 2);
}

TEST(DlcsModelTest, KeepsTheNamesOfAnEconomy) {
  const auto model = [](const std::string& names) {
    return RunDlcs("model input-output -",
                   "echo '{\"C\": [[0.5]], \"A\": [[-1]], \"B\": [[0.25]], \"d\": [1], \"T\": 1, " + names + "}' | ");
  };
  const ProgramOutcome named = model(R"("states": ["need"], "pairs": ["grain"])");
  ASSERT_EQ(named.code, 0) << named.err;
  EXPECT_EQ(nlohmann::json::parse(named.out)["states"], nlohmann::json({"need"}));
  EXPECT_EQ(nlohmann::json::parse(named.out)["pairs"], nlohmann::json({"grain"}));
  const ProgramOutcome wrong = model(R"("states": ["need", "more"], "pairs": ["2"])");
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.err, AllOf(HasSubstr("standard input: states 2 names; must be 1"),
                               HasSubstr("standard input: pairs[0] \"2\"; must be a letter")));
}

TEST(DlcsModelTest, MakesASignoriniProblemThatItThenSolves) {
  const ProgramOutcome model = RunDlcs("model signorini --cells 8 --coefficient 0.2 --horizon 0.25");
  ASSERT_EQ(model.code, 0) << model.err;
  const auto problem = nlohmann::json::parse(model.out);
  EXPECT_EQ(problem["A"]["kronecker_sum"].size(), 2u);
  EXPECT_EQ(problem["f"]["of"].size(), 7u);
  // The same system with every entry written down.
  nlohmann::json dense = problem;
  const auto rows = [](const nlohmann::json& sparse) {
    nlohmann::json all(sparse["rows"].get<std::size_t>(),
                       std::vector<double>(sparse["columns"].get<std::size_t>(), 0.0));
    for (std::size_t k = 0; k < sparse["values"].size(); ++k) {
      all[sparse["row_indices"][k].get<std::size_t>()][sparse["column_indices"][k].get<std::size_t>()] =
          sparse["values"][k];
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
  const std::string options = "--method exponential-integrator --steps 100 --at 0.25 --format json --quiet";
  const ProgramOutcome structured = SolveText(model.out, options);
  const ProgramOutcome written_down = SolveText(dense.dump(), options);
  ASSERT_EQ(structured.code, 0) << structured.err;
  ASSERT_EQ(written_down.code, 0) << written_down.err;
  const auto x = nlohmann::json::parse(structured.out)["trajectory"]["x"].get<std::vector<double>>();
  const auto expected = nlohmann::json::parse(written_down.out)["trajectory"]["x"].get<std::vector<double>>();
  ASSERT_EQ(x.size(), 49u);
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(x[i], expected[i], 1e-11) << i;
}

TEST(DlcsModelTest, NamesWhatIsWrongWithASignoriniModel) {
  EXPECT_THAT(RunDlcs("model signorini").err, HasSubstr("--cells: is required"));
  EXPECT_THAT(RunDlcs("model signorini --cells 5000").err, HasSubstr("--cells: is 5000, must be from 2 to 4096"));
  EXPECT_THAT(RunDlcs("model signorini x.json --cells 4").err, HasSubstr("is for input-output"));
  EXPECT_THAT(RunDlcs("model input-output x.json --cells 4").err, HasSubstr("--cells"));
  EXPECT_EQ(RunDlcs("model input-output").code, 2);
}

TEST(DlcsModelTest, MakesProblemsOnGridsThatItThenSolves) {
  for (const char* model : {"signorini --cells 6 --dimensions 3 --coefficient 0.1 --horizon 0.5", "obstacle --cells 16",
                            "obstacle --cells 8 --dimensions 2 --load=-t", "american-option --cells 40 --rate 0.1",
                            "american-option --cells 10 --dimensions 2 --correlation 0.5",
                            "drainage --cells 20 --drains 2 --recharge t", "drainage --cells 8 --dimensions 2"}) {
    const ProgramOutcome made = RunDlcs(std::string("model ") + model);
    ASSERT_EQ(made.code, 0) << model << made.err;
    const ProgramOutcome solved = SolveText(made.out, "--tolerance 1e-4 --quiet");
    EXPECT_EQ(solved.code, 0) << model << solved.out << solved.err;
    EXPECT_THAT(solved.out, HasSubstr("SOLVED")) << model;
  }
}

TEST(DlcsModelTest, MakesAProblemOfAMeshThatItThenSolves) {
  const std::string mesh = testing::ProjectPath("deploy/examples/plate.msh");
  const ProgramOutcome made = RunDlcs("model heat " + mesh + " --contact wall --fixed lid");
  ASSERT_EQ(made.code, 0) << made.err;
  const auto problem = nlohmann::json::parse(made.out);
  EXPECT_TRUE(problem.contains("E"));
  EXPECT_EQ(problem["annotations"]["nodes"].size(), problem["x0"].size());
  EXPECT_EQ(problem["x0"].size(), 60u);
  const ProgramOutcome solved = SolveText(made.out, "--at 1 --quiet");
  EXPECT_EQ(solved.code, 0) << solved.out << solved.err;
  EXPECT_THAT(solved.out, HasSubstr("SOLVED"));

  EXPECT_THAT(RunDlcs("model heat " + mesh).err, HasSubstr("--contact: missing; must name a physical group"));
  EXPECT_THAT(RunDlcs("model heat " + mesh + " --contact wll").err,
              HasSubstr("--contact: \"wll\"; the mesh has no physical group of lines"));
  EXPECT_THAT(RunDlcs("model heat --contact wall").err, HasSubstr("FILE: is required for heat"));
  EXPECT_THAT(RunDlcs("model heat " + mesh + " --contact wall --load 'sin('").err, HasSubstr("--load"));
  EXPECT_THAT(RunDlcs("model heat - --contact wall", "echo 'solid body' | ").err,
              HasSubstr("standard input:1: \"solid\"; must be $MeshFormat"));
}

TEST(DlcsModelTest, NamesTheOptionThatIsWrong) {
  EXPECT_THAT(RunDlcs("model obstacle --cells 8 --dimensions 3").err, HasSubstr("--dimensions: is 3, must be 1 or 2"));
  EXPECT_THAT(RunDlcs("model obstacle --cells 8 --drains 2").err, HasSubstr("--drains: is for drainage"));
  EXPECT_THAT(RunDlcs("model obstacle --cells 8 --load 'sin(x)'").err, HasSubstr("--load"));
  EXPECT_THAT(RunDlcs("model drainage --cells 8 --drains 9").err, HasSubstr("--drains: is 9, must be from 1 to"));
  EXPECT_THAT(RunDlcs("model obstacles --cells 8").err, HasSubstr("obstacle"));
}

}  // namespace
}  // namespace dlcs::client
