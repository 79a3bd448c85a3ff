// SPDX-License-Identifier: Apache-2.0
#include "client/files/problem_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/paths.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A valid file with two states and one pair; `changes` are merged into it, null removes a key.
std::string Example(const nlohmann::json& changes = nlohmann::json::object()) {
  nlohmann::json root = nlohmann::json::parse(R"json({
    "A": [[-1, 0.5], [0, -2]], "B": [[1], [2]], "N": [[3, 4]], "M": [[5]],
    "x0": [1, 2], "T": 1.5, "f": ["sin(t)", "0"], "g": ["1"]})json");
  root.merge_patch(changes);
  return root.dump();
}

std::string ErrorOf(const std::string& text) {
  const auto file = ParseProblem(text, "p.json");
  return file.ok() ? "no error" : std::string(file.status().message());
}

TEST(ProblemFileTest, KeepsEveryNumberInItsPlace) {
  const auto file =
      ParseProblem(Example({{"name", "two tanks"}, {"rule", "unique"}, {"break_points", {0.25, 0.5}}}), "p.json");
  ASSERT_TRUE(file.ok()) << file.status();
  const v1::Problem& problem = file->problem;
  EXPECT_THAT(problem.a().dense().values(), ElementsAre(-1, 0.5, 0, -2));
  EXPECT_EQ(problem.b().dense().rows(), 2);
  EXPECT_EQ(problem.b().dense().columns(), 1);
  EXPECT_THAT(problem.n().dense().values(), ElementsAre(3, 4));
  EXPECT_THAT(problem.m().dense().values(), ElementsAre(5));
  EXPECT_THAT(problem.x0(), ElementsAre(1, 2));
  EXPECT_EQ(problem.horizon(), 1.5);
  EXPECT_THAT(problem.break_points(), ElementsAre(0.25, 0.5));
  EXPECT_EQ(problem.rule(), v1::SOLUTION_RULE_UNIQUE);
  ASSERT_EQ(problem.f().pieces_size(), 1);
  EXPECT_THAT(problem.f().pieces(0).formulas().formulas(), ElementsAre("sin(t)", "0"));
  EXPECT_EQ(file->name, "two tanks");
}

TEST(ProblemFileTest, TakesAMassMatrix) {
  const auto file = ParseProblem(Example({{"E", {{2, 0.5}, {0.5, "4*c"}}}, {"parameters", {{"c", 1}}}}), "p.json");
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->problem.e().dense().rows(), 2);
  EXPECT_EQ(file->problem.e().dense().formulas_size(), 1);
  EXPECT_FALSE(ParseProblem(Example(), "p.json")->problem.has_e());
  EXPECT_EQ(ProblemJson(file->problem).at("E").at(0).at(0), 2);
  EXPECT_THAT(ErrorOf(Example({{"E", 2}})), HasSubstr("E"));
}

TEST(ProblemFileTest, TakesMissingSourcesAsZero) {
  const auto file = ParseProblem(Example({{"f", nullptr}, {"g", nullptr}}), "p.json");
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_THAT(file->problem.f().pieces(0).constant().values(), ElementsAre(0, 0));
  EXPECT_THAT(file->problem.g().pieces(0).constant().values(), ElementsAre(0));
}

TEST(ProblemFileTest, WritesNumbersNextToFormulasWithAllTheirDigits) {
  const auto file = ParseProblem(Example({{"f", {"t", -0.1}}, {"g", {0.1}}}), "p.json");
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_THAT(file->problem.f().pieces(0).formulas().formulas(), ElementsAre("t", "-0.1"));
  EXPECT_THAT(file->problem.g().pieces(0).constant().values(), ElementsAre(0.1));
}

TEST(ProblemFileTest, ReadsSamplesTimeByTime) {
  const auto file =
      ParseProblem(Example({{"f", {{"times", {0, 1, 2}}, {"values", {{1, 2}, {3, 4}, {5, 6}}}}}}), "p.json");
  ASSERT_TRUE(file.ok()) << file.status();
  const v1::SampledFunction& samples = file->problem.f().pieces(0).samples();
  EXPECT_THAT(samples.times(), ElementsAre(0, 1, 2));
  EXPECT_THAT(samples.values(), ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST(ProblemFileTest, ReadsPolynomialsLowestDegreeFirst) {
  const auto file =
      ParseProblem(Example({{"f", {{"breaks", {0, 1, 2}}, {"coefficients", {{{1, 2}, {3, 4}}, {{5, 6}}}}}}}), "p.json");
  ASSERT_TRUE(file.ok()) << file.status();
  const v1::PiecewisePolynomial& polynomial = file->problem.f().pieces(0).polynomial();
  EXPECT_THAT(polynomial.breaks(), ElementsAre(0, 1, 2));
  ASSERT_EQ(polynomial.coefficients_size(), 2);
  EXPECT_THAT(polynomial.coefficients(0).values(), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(polynomial.coefficients(1).values(), ElementsAre(5, 6));
}

TEST(ProblemFileTest, ReplacesSourcesByPieces) {
  const auto file =
      ParseProblem(Example({{"f", nullptr},
                            {"g", nullptr},
                            {"pieces", {{{"t0", 0}, {"f", {"t", 1}}, {"g", {2}}}, {{"t0", 0.5}, {"g", {"t"}}}}}}),
                   "p.json");
  ASSERT_TRUE(file.ok()) << file.status();
  const v1::Problem& problem = file->problem;
  ASSERT_EQ(problem.f().pieces_size(), 2);
  ASSERT_EQ(problem.g().pieces_size(), 2);
  EXPECT_THAT(problem.f().pieces(0).formulas().formulas(), ElementsAre("t", "1"));
  EXPECT_THAT(problem.f().pieces(1).constant().values(), ElementsAre(0, 0));
  EXPECT_EQ(problem.f().pieces(1).start(), 0.5);
  EXPECT_EQ(problem.g().pieces(1).start(), 0.5);
  EXPECT_THAT(problem.g().pieces(1).formulas().formulas(), ElementsAre("t"));
}

TEST(ProblemFileTest, ReadsEveryCase) {
  int cases = 0;
  for (const auto& entry : std::filesystem::directory_iterator(dlcs::testing::ProjectPath("tests/cases"))) {
    if (entry.path().extension() != ".json") continue;
    ++cases;
    const auto file = ReadProblemFile(entry.path());
    ASSERT_TRUE(file.ok()) << file.status();
    std::ifstream stream(entry.path());
    const auto root = nlohmann::json::parse(stream);
    EXPECT_EQ(file->name, root["name"]) << entry.path();
    EXPECT_EQ(file->problem.x0_size(), static_cast<int>(root["x0"].size())) << entry.path();
    EXPECT_EQ(file->problem.f().pieces_size(), root.contains("pieces") ? static_cast<int>(root["pieces"].size()) : 1)
        << entry.path();
  }
  EXPECT_GE(cases, 17);
}

TEST(ProblemFileTest, TakesAnyAnnotations) {
  const std::string system = R"({"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[1]], "x0": [1], "T": 1, "annotations": )";
  EXPECT_TRUE(ParseProblem(system + R"({"author": "me", "values": [1, {"x": null}]}})", "a.json").ok());
  EXPECT_THAT(std::string(ParseProblem(system + "3}", "a.json").status().message()),
              HasSubstr("annotations must be an object"));
}

struct Broken {
  std::string name;               // what the case shows
  std::string text;               // the file
  std::vector<std::string> says;  // what the message must hold
};

std::ostream& operator<<(std::ostream& stream, const Broken& broken) { return stream << broken.name; }

class BrokenProblemTest : public ::testing::TestWithParam<Broken> {};

TEST_P(BrokenProblemTest, NamesFilePlaceAndRule) {
  const std::string error = ErrorOf(GetParam().text);
  EXPECT_THAT(error, HasSubstr("p.json"));
  for (const std::string& part : GetParam().says) EXPECT_THAT(error, HasSubstr(part));
}

// merge_patch takes null for "remove", so a null value is written into the text by hand.
std::string With(const std::string& member) {
  std::string text = Example();
  return text.insert(1, member + ",");
}

INSTANTIATE_TEST_SUITE_P(
    Files, BrokenProblemTest,
    ::testing::Values(
        Broken{"Empty", " \n ", {"the file is empty"}},
        Broken{"NotAnObject", "[1, 2]", {"holds a list (of 2)", "must be one object", "x0"}},
        Broken{"CutOff", "{\"A\": [[1, 2]", {"line 1, column 14", "ends in the middle"}},
        Broken{"MissingComma", "{\n  \"T\": 1\n  \"A\": 2}", {"line 3, column 3: a comma is missing before \"A\""}},
        Broken{"MissingCommaInAList", "{\"x0\": [1 25.5]}", {"line 1, column 11: a comma is missing before 25.5"}},
        Broken{"MissingCommaBetweenRows", "{\"A\": [[1] [2]]}", {"column 12: a comma is missing before [2"}},
        Broken{"MissingColon", "{\"T\" 2}", {"a colon is missing after the key"}},
        Broken{"Utf16", std::string("\xff\xfe{\0\"\0T\0\"\0", 12), {"is text in UTF-16", "save it as UTF-8"}},
        Broken{"Utf16WithoutAMark", std::string("{\0\"\0T\0\"\0:\0", 10), {"is text in UTF-16LE"}},
        Broken{"Utf16BigEnd", std::string("\0{\0\"\0T\0\"\0:", 10), {"is text in UTF-16BE"}},
        Broken{"Utf32", std::string("\xff\xfe\0\0{\0\0\0", 8), {"is text in UTF-32"}},
        Broken{"Latin1",
               With("\"name\": \"caf\xe9\""),
               {"line 1, column 14: the byte 0xe9 is not UTF-8 (in Latin-1 it is \"é\")"}},
        Broken{"AProgram",
               std::string("\x7f"
                           "ELF\2\1\1\0",
                           8),
               {"p.json: is a program", "JSON in UTF-8 is expected"}},
        Broken{"Gzip", "\x1f\x8b\x08 and so on", {"compressed by gzip"}},
        Broken{"OtherBytes", std::string("{\"T\": \0 1}", 11), {"is a binary file (byte 7 is zero)"}},
        Broken{"AZeroBehindTheEnd", Example() + std::string("\0 7", 3), {"is a binary file (byte 108 is zero)"}},
        Broken{"Scalar", Example({{"A", -1}}), {"A is a number (-1)", "a 1 x 1 matrix is written [[-1]]"}},
        Broken{"DecimalComma",
               R"({"A": [[-1,5]], "B": [[1]], "N": [[1]], "M": [[1]], "x0": [0], "T": 1})",
               {"A is 1 x 2; must be square", "JSON reads 1,5 as two numbers; a decimal is written 1.5"}},
        Broken{"DecimalCommaInTheState",
               R"({"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[1]], "x0": [0,5], "T": 1})",
               {"x0 has 2 values", "a decimal is written 1.5"}},
        Broken{"PiecesBesideF",
               Example({{"f", {"0", "0"}}, {"pieces", {{{"t0", 0}, {"g", {1}}}}}}),
               {"f is given as well as pieces, which hold f and g"}},
        Broken{"PiecesBesideG", Example({{"g", {"0"}}, {"pieces", {{{"t0", 0}}}}}), {"g is given as well as pieces"}},
        Broken{"Title", Example({{"title", "x"}}), {"\"title\" is not a known key; did you mean \"name\"?"}},
        Broken{"Notes", Example({{"notes", "x"}}), {"\"notes\" is not a known key; did you mean \"about\"?"}},
        Broken{"RuleNear",
               Example({{"rule", "leastelement"}}),
               {"rule is \"leastelement\"; must be one of auto, unique", "; did you mean \"least-element\"?"}},
        Broken{"KindNear",
               Example({{"kind", "nonlinera"}}),
               {"kind is \"nonlinera\"; must be one of linear, nonlinear; did you mean \"nonlinear\"?"}},
        Broken{"TrailingComma", "{\n  \"T\": [1, 2,]}", {"line 2, column 14", "comma before the closing ']'"}},
        Broken{"NotANumber", "{\"T\": NaN}", {"line 1, column 7", "NaN", "must be finite"}},
        Broken{"NegativeInfinity", "{\"x0\": [0, -Infinity]}", {"line 1", "Infinity", "must be finite"}},
        Broken{"Overflow", "{\"T\": 1e999}", {"line 1, column 7: 1e999 is too large", "must be finite"}},
        Broken{"PythonTrue", "{\"y_unique\": True}", {"column 14", "JSON writes true"}},
        Broken{"SingleQuotes", "{'T': 1}", {"column 2", "double quotes"}},
        Broken{"Comment", "{\n// horizon\n\"T\": 1}", {"line 2, column 1", "no comments"}},
        Broken{"BareFormula", "{\"f\": [sin(t)]}", {"line 1", "sin", "double quotes"}},
        Broken{"TextAfterTheEnd",
               Example() + " 7",
               {"line 1, column 109", "there is something after the end of the object"}},
        Broken{"AnObjectAfterTheEnd", Example() + Example(), {"there is something after the end", "a file holds one"}},
        Broken{"Yaml", "# A system\nA: [[-1]]\n", {"line 1, column 1", "no comments"}},
        Broken{"YamlWithoutComment",
               "\nA: [[-1]]\n",
               {"line 2, column 1: begins with \"A:\"; JSON is one object {\"KEY\": VALUE, ...}"}},
        Broken{"Table", "1;2\n3;4\n", {"line 1, column 1: begins with \"1;2\"; JSON is one object"}},
        Broken{"Octave", "A = [1 2; 3 4];\n", {"begins with \"A\"; JSON is one object", "keys in double quotes"}},
        Broken{"IndicesFromOne",
               Example({{"N", {{"rows", 1}, {"columns", 2}, {"entries", {{1, 2, 1}}}}}}),
               {"N.entries[0][0] is a number (1); must be a whole number from 0 to 0, since rows and columns count "
                "from 0"}},
        Broken{"LimitOfNoOutput",
               Example({{"outputs", {{"names", {"power"}}, {"limits", {{"powr", 1}}}}}}),
               {"\"powr\" is not a known key in outputs.limits; did you mean \"power\"?"}},
        Broken{"KeyTwice", With("\"T\": 2"), {"key \"T\" is given twice"}},
        Broken{"KeyTwiceInside", With("\"pieces\": [{\"t0\": 0, \"t0\": 1}]"), {"\"t0\"", "twice", "\"pieces\""}},
        Broken{"TooDeep", With("\"refs\": " + std::string(50, '[') + std::string(50, ']')), {"deeper than 32"}},
        Broken{"MissingKey", Example({{"N", nullptr}}), {"\"N\" is missing", "row per complementarity pair"}},
        Broken{"UnknownKeyNear",
               Example({{"breakpoints", {0.5}}}),
               {"\"breakpoints\" is not a known key", "did you mean \"break_points\"?"}},
        Broken{"UnknownKeyCase", Example({{"t", 3}}), {"\"t\" is not a known key", "did you mean \"T\"?"}},
        Broken{"UnknownKeyFar",
               Example({{"zzzzzz", 3}}),
               {"\"zzzzzz\" is not a known key; known are A, B, N, M, x0", "name, about, source, $schema"}},
        Broken{"StringForNumber", Example({{"x0", {1, "abc"}}}), {"x0[1] is a string (\"abc\"); must be a number"}},
        Broken{"QuotedNumber", Example({{"T", "1.5"}}), {"T is a string (\"1.5\")", "without quotes"}},
        Broken{"NumberWithAUnit",
               Example({{"T", "2ms"}}),
               {"T is a string (\"2ms\"); must be a number; numbers have no units: in seconds write 2e-3"}},
        Broken{"NumberWithAnotherUnit", Example({{"x0", {1, "5 V"}}}), {"x0[1]", "must be a number; numbers have no"}},
        Broken{"ColumnForVector",
               Example({{"x0", {{0}, {1.5}}}}),
               {"p.json: x0 is a list of 2 lists; must be a list of numbers: [0,1.5]"}},
        Broken{
            "RowForVector", Example({{"x0", {{0, 1}}}}), {"x0 is a list of 1 list; must be a list of numbers: [0,1]"}},
        Broken{"NullInMatrix", With("\"break_points\": [null]"), {"break_points[0] is null; must be a number"}},
        Broken{"BooleanHorizon", Example({{"T", true}}), {"T is true; must be a number"}},
        Broken{"ScalarState", Example({{"x0", 1}}), {"x0 is a number (1); must be a list of numbers"}},
        Broken{"RaggedRows",
               Example({{"A", {{1, 2}, {3}}}}),
               {"A[1] has length 1, but A[0] has length 2; all rows must have the same"}},
        Broken{"ColumnAsList", Example({{"B", {1, 2}}}), {"B[0] is a number (1)", "[[1], [2]]"}},
        Broken{"EmptyMatrix", Example({{"M", nlohmann::json::array()}}), {"M is an empty list", "list of rows"}},
        Broken{"EmptyRow", Example({{"N", {nlohmann::json::array()}}}), {"N is a list of empty rows"}},
        Broken{"TextInSelector",
               Example({{"selector", {{"C", {{"x"}}}, {"b", {1}}}}}),
               {"selector.C[0][0] is a string (\"x\"); must be a number"}},
        Broken{"NumberInQuotesInMatrix",
               Example({{"A", {{1, "-1"}, {0, 1}}}}),
               {"A[0][1] is a string (\"-1\"); must be a number; write it without quotes"}},
        Broken{"NamesAreNoList", Example({{"states", "vC"}}), {"states is a string (\"vC\"); must be a list of names"}},
        Broken{"NameOfAPairIsNoText", Example({{"pairs", {1}}}), {"pairs[0] is a number (1); must be text"}},
        Broken{"ParametersAreNoObject",
               Example({{"parameters", {314}}}),
               {"parameters is a list (of 1); must be an object with a number for each name"}},
        Broken{"ParameterIsText",
               Example({{"parameters", {{"R", "1k"}}}}),
               {"parameters.R is a string (\"1k\"); must be a number"}},
        Broken{"FormulaWithoutList", Example({{"f", "sin(t)"}}), {"f is a string (\"sin(t)\")", "list with a formula"}},
        Broken{"FormulaIsAList", Example({{"g", {{1}}}}), {"g[0] is a list (of 1)", "formula in t"}},
        Broken{"SamplesWithoutTimes", Example({{"f", {{"values", {{1, 2}}}}}}), {"\"times\" is missing", "f needs"}},
        Broken{"SamplesTooFew",
               Example({{"f", {{"times", {0, 1}}, {"values", {{1, 2}}}}}}),
               {"f.values has 1 rows but f.times has 2"}},
        Broken{"SamplesTooWide",
               Example({{"g", {{"times", {0}}, {"values", {{1, 2}}}}}}),
               {"g.values has rows of 2", "1 here"}},
        Broken{"PolynomialTooNarrow",
               Example({{"f", {{"breaks", {0, 1}}, {"coefficients", {{{1}, {2}}}}}}}),
               {"f.coefficients[0] has rows of 1", "2 here"}},
        Broken{"PolynomialMistyped",
               Example({{"f", {{"breaks", {0, 1}}, {"coeffs", {{{1, 2}}}}}}}),
               {"\"coeffs\" is not a known key in f; did you mean", "\"coefficients\" is missing"}},
        Broken{"PiecesNotAList", Example({{"pieces", 3}}), {"pieces is a number (3); must be a list of objects"}},
        Broken{"PieceWithoutStart", Example({{"pieces", {{{"g", {1}}}}}}), {"pieces[0] has no \"t0\""}},
        Broken{"PieceUnknownKey",
               Example({{"pieces", {{{"t0", 0}, {"t1", 1}}}}}),
               {"\"t1\" is not a known key in pieces[0]", "\"t0\""}},
        Broken{"WrongRule",
               Example({{"rule", "smallest"}}),
               {"rule is \"smallest\"; must be one of auto, unique, least-element", "; did you mean \"sparsest\"?"}},
        Broken{"NameNotText", Example({{"name", 7}}), {"name is a number (7); must be text"}}),
    [](const ::testing::TestParamInfo<Broken>& broken) { return broken.param.name; });

TEST(ProblemFileTest, ReadsNamesParametersAndFormulasInMatrices) {
  const std::string text = Example({{"states", {"iL", "vC"}},
                                    {"pairs", {"D1"}},
                                    {"parameters", {{"R", 2}, {"omega", 314.5}}},
                                    {"A", {{-1, "-1/R"}, {"R**2", -2}}},
                                    {"N", {{"rows", 1}, {"columns", 2}, {"entries", {{0, 1, "R"}, {0, 0, 3}}}}}});
  const auto file = ParseProblem(text, "p.json");
  ASSERT_TRUE(file.ok()) << file.status();
  const v1::Problem& problem = file->problem;
  EXPECT_THAT(problem.state_names(), ElementsAre("iL", "vC"));
  EXPECT_THAT(problem.pair_names(), ElementsAre("D1"));
  ASSERT_EQ(problem.parameters_size(), 2);
  EXPECT_EQ(problem.parameters(1).name(), "omega");
  EXPECT_EQ(problem.parameters(1).value(), 314.5);
  ASSERT_EQ(problem.a().dense().formulas_size(), 2);
  EXPECT_EQ(problem.a().dense().formulas(0).index(), 1);
  EXPECT_EQ(problem.a().dense().formulas(0).formula(), "-1/R");
  EXPECT_EQ(problem.a().dense().formulas(1).index(), 2);
  EXPECT_THAT(problem.a().dense().values(), ElementsAre(-1, 0, 0, -2));
  ASSERT_EQ(problem.n().sparse().formulas_size(), 1);
  EXPECT_EQ(problem.n().sparse().formulas(0).index(), 0);
  // The same problem when it is written as a file again.
  const auto again = ParseProblem(ProblemJson(problem).dump(), "p.json");
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->problem.SerializeAsString(), problem.SerializeAsString());
}

TEST(ProblemFileTest, NamesItsSchema) {
  EXPECT_EQ(ErrorOf(Example({{"$schema", "../client/problem.schema.json"}})), "no error");
}

TEST(ProblemFileTest, NamesEveryMistakeAtOnceUpToTwenty) {
  nlohmann::json x0 = nlohmann::json::array();
  for (int i = 0; i < 25; ++i) x0.push_back("a");
  const std::string error = ErrorOf(Example({{"x0", x0}, {"rul", "unique"}}));
  EXPECT_THAT(error, AllOf(HasSubstr("did you mean \"rule\"?"), HasSubstr("x0[0] "), HasSubstr("x0[18] ")));
  EXPECT_THAT(error, HasSubstr("p.json: and 6 more"));
}

TEST(ProblemFileTest, RefusesFilesThatCannotBeRead) {
  const auto missing = ReadProblemFile("no/such/file.json");
  EXPECT_EQ(missing.status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(missing.status().message()), HasSubstr("no/such/file.json"));
  const auto folder = ReadProblemFile(dlcs::testing::ProjectPath("tests/cases"));
  EXPECT_EQ(folder.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(folder.status().message()), HasSubstr("is a folder; name a file in it"));
}

TEST(ProblemFileTest, ReadsRuleAndSelector) {
  const auto file =
      ParseProblem(Example({{"rule", "minimizer"}, {"selector", {{"C", {{1}, {2}}}, {"b", {3, 4}}}}}), "p.json");
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->problem.rule(), v1::SOLUTION_RULE_MINIMIZER);
  EXPECT_EQ(file->problem.selector().c().dense().rows(), 2);
  EXPECT_THAT(file->problem.selector().b(), ElementsAre(3, 4));
  EXPECT_THAT(ErrorOf(Example({{"selector", {{"D", 1}}}})),
              AllOf(HasSubstr("selector"), HasSubstr("\"D\""), HasSubstr("\"b\"")));
  EXPECT_THAT(ErrorOf(Example({{"selector", 3}})), HasSubstr("p.json: selector is a number (3)"));
}

constexpr const char* kNonlinear = R"json({"kind": "nonlinear", "name": "stop", "f": ["x2", "-x1-y1"],
    "g": ["y1-40*(x1-0.5)"], "x0": [0, 1], "T": 2, "break_points": [1], "W": [[0, 1], [-1, 0]]})json";

TEST(ProblemFileTest, SaysOfJunkWhatItsNameWants) {
  for (const char* name : {"junk.mat", "junk.npz", "junk.npy"}) {
    for (const char* junk : {"", "\xbb\xff", "MATLAB 4"}) {
      const auto read = ParseProblem(junk, name);
      ASSERT_FALSE(read.ok());
      EXPECT_THAT(std::string(read.status().message()),
                  ::testing::AllOf(HasSubstr(name), HasSubstr("is neither an .npy, an .npz nor a .mat file")));
    }
  }
}

TEST(NonlinearFileTest, ReadsFormulasTimesAndSplitting) {
  const auto file = ParseProblem(kNonlinear, "n.json");
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->name, "stop");
  ASSERT_TRUE(file->nonlinear);
  EXPECT_THAT(file->nonlinear->f(), ElementsAre("x2", "-x1-y1"));
  EXPECT_THAT(file->nonlinear->g(), ElementsAre("y1-40*(x1-0.5)"));
  EXPECT_THAT(file->nonlinear->x0(), ElementsAre(0, 1));
  EXPECT_EQ(file->nonlinear->horizon(), 2);
  EXPECT_THAT(file->nonlinear->break_points(), ElementsAre(1));
  EXPECT_THAT(file->nonlinear->w().dense().values(), ElementsAre(0, 1, -1, 0));
}

TEST(NonlinearFileTest, ReadsNamesAndParameters) {
  nlohmann::json root = nlohmann::json::parse(kNonlinear);
  root.merge_patch(
      {{"states", {"pos", "speed"}}, {"pairs", {"stop"}}, {"parameters", {{"k", 40}}}, {"W", {{0, "k"}, {-1, 0}}}});
  const auto file = ParseProblem(root.dump(), "n.json");
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_THAT(file->nonlinear->state_names(), ElementsAre("pos", "speed"));
  EXPECT_THAT(file->nonlinear->pair_names(), ElementsAre("stop"));
  EXPECT_EQ(file->nonlinear->parameters(0).value(), 40);
  EXPECT_EQ(file->nonlinear->w().dense().formulas(0).formula(), "k");
}

TEST(NonlinearFileTest, NamesWhatIsWrong) {
  const auto error_with = [](const nlohmann::json& changes) {
    nlohmann::json root = nlohmann::json::parse(kNonlinear);
    root.merge_patch(changes);
    return ErrorOf(root.dump());
  };
  EXPECT_THAT(error_with({{"f", nullptr}}), HasSubstr("\"f\" is missing"));
  EXPECT_THAT(error_with({{"g", "y1"}}), HasSubstr("p.json: g is a string"));
  EXPECT_THAT(error_with({{"f", {"x2", true}}}), HasSubstr("f[1]"));
  EXPECT_THAT(error_with({{"M", {{1}}}}), HasSubstr("\"M\" is not a known key"));
  EXPECT_THAT(error_with({{"kind", "odd"}}), HasSubstr("kind is \"odd\"; must be"));
  EXPECT_THAT(ErrorOf(Example({{"kind", "linear"}, {"W", {{1}}}})), HasSubstr("\"W\" is not a known key"));
}

}  // namespace
}  // namespace dlcs::client
