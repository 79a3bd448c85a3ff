// SPDX-License-Identifier: Apache-2.0
// dlcs plot with the real gnuplot.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/client/cli/program.h"
#include "tests/server/store/temporary_folder.h"
#include "tests/support/paths.h"

namespace dlcs::client {
namespace {

using dlcs::testing::QuotedExample;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string ContentOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class PlotCommandTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const ProgramOutcome solved =
        RunDlcs("solve " + QuotedExample("named-rectifier") + " --quiet --format json --output '" + result_ + "'");
    ASSERT_EQ(solved.code, 0) << solved.err;
  }
  ProgramOutcome Plot(const std::string& input, const std::string& output) {
    return RunDlcs("plot '" + input + "' --output '" + output + "'");
  }

  jobs::testing::TemporaryFolder folder_;
  const std::string result_ = folder_.File("result.json");
};

TEST_F(PlotCommandTest, DrawsEveryComponentByItsName) {
  const std::string picture = folder_.File("result.svg");
  const ProgramOutcome drawn = Plot(result_, picture);
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  EXPECT_EQ(drawn.out + drawn.err, "");
  EXPECT_THAT(ContentOf(picture), AllOf(HasSubstr("<svg"), HasSubstr(">i<"), HasSubstr(">v<"), HasSubstr(">diode<"),
                                        HasSubstr("w(diode)"), HasSubstr("SOLVED within")));
  EXPECT_FALSE(std::filesystem::exists(picture + ".partial"));
  const std::string png = folder_.File("result.png");
  ASSERT_EQ(Plot(result_, png).code, 0);
  EXPECT_EQ(ContentOf(png).substr(1, 3), "PNG");
}

// The text that gnuplot wrote into a picture: legend, labels of axes and ticks.
TEST_F(PlotCommandTest, DrawsTheComponentsThatAreChosen) {
  const std::string picture = folder_.File("result.svg");
  const auto drawn = [&](const std::string& options) {
    const ProgramOutcome outcome = RunDlcs("plot '" + result_ + "' --output '" + picture + "' " + options);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    return ContentOf(picture);
  };
  EXPECT_THAT(drawn("--show v,'w(diode)'"), AllOf(HasSubstr(">v<"), HasSubstr(">w(diode)<"), Not(HasSubstr(">i<")),
                                                  Not(HasSubstr(">diode<")), Not(HasSubstr(">y<"))));
  EXPECT_THAT(drawn("--show x2"), AllOf(HasSubstr(">v<"), Not(HasSubstr(">i<")), Not(HasSubstr("diode<"))));
  EXPECT_THAT(drawn("--show y --show i"), AllOf(HasSubstr(">diode<"), HasSubstr(">i<"), Not(HasSubstr(">v<"))));
  const ProgramOutcome unknown = RunDlcs("plot '" + result_ + "' --output '" + picture + "' --show diod");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.err, AllOf(HasSubstr("--show: \"diod\""), HasSubstr("did you mean diode?")));
}

TEST_F(PlotCommandTest, DrawsOverTheComponentsAtEachTime) {
  const std::string picture = folder_.File("profile.svg"), few = folder_.File("few.json");
  const std::string solve = "solve " + QuotedExample("named-rectifier") + " --quiet --format json --output ";
  ASSERT_EQ(RunDlcs(solve + "'" + few + "' --at 0,0.5,3").code, 0);
  const ProgramOutcome drawn = RunDlcs("plot '" + few + "' --profile --show x --output '" + picture + "'");
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  EXPECT_EQ(drawn.err, "");
  EXPECT_THAT(ContentOf(picture), AllOf(HasSubstr(">t = 0<"), HasSubstr(">t = 0.5<"), HasSubstr(">t = 3<"),
                                        HasSubstr(">i<"), HasSubstr(">v<"), Not(HasSubstr("diode"))));
  ASSERT_EQ(RunDlcs(solve + "'" + few + "' --at 0:0.1:3").code, 0);
  const ProgramOutcome many = RunDlcs("plot '" + few + "' --profile --output '" + picture + "'");
  EXPECT_THAT(many.err, HasSubstr("12 of the 31 times"));
  EXPECT_THAT(ContentOf(picture), AllOf(HasSubstr(">t = 0<"), HasSubstr(">t = 3<")));
}

// gnuplot warns of an axis without a length.
TEST_F(PlotCommandTest, DrawsWhatIsConstant) {
  const std::string picture = folder_.File("constant.svg");
  const ProgramOutcome drawn =
      SolveText(R"json({"A": [[0]], "B": [[0]], "N": [[0]], "M": [[1]], "g": [1], "x0": [5], "T": 1})json",
                "--quiet --plot '" + picture + "'");
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  EXPECT_EQ(drawn.err, "");
  EXPECT_THAT(ContentOf(picture), HasSubstr(">w1<"));
}

TEST_F(PlotCommandTest, ASolveDrawsAndPrintsTheSameTable) {
  const std::string picture = folder_.File("solve.svg"), solve = "solve " + QuotedExample("named-rectifier");
  const ProgramOutcome plain = RunDlcs(solve + " --quiet");
  const ProgramOutcome drawn = RunDlcs(solve + " --plot '" + picture + "'");
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  // The rows, but not the times and roundings of the certificate.
  const std::size_t begin = plain.out.find("\n\n"), end = plain.out.find("\n\n", begin + 2);
  EXPECT_THAT(drawn.out, HasSubstr(plain.out.substr(begin, end - begin)));
  EXPECT_THAT(drawn.err, HasSubstr("wrote " + picture));
  EXPECT_THAT(ContentOf(picture), AllOf(HasSubstr("<svg"), HasSubstr(">diode<"), HasSubstr("SOLVED within")));
  // CSV is written as it arrives, and the picture needs all of it.
  const std::string png = folder_.File("solve.png"), csv = folder_.File("solve.csv");
  ASSERT_EQ(RunDlcs(solve + " --output '" + csv + "' --plot '" + png + "'").code, 0);
  EXPECT_EQ(ContentOf(png).substr(1, 3), "PNG");
  EXPECT_THAT(ContentOf(csv), HasSubstr("t,i,v,"));
}

TEST_F(PlotCommandTest, ASolveIsNotBegunForAPictureThatCannotBe) {
  const std::string solve = "solve " + QuotedExample("named-rectifier") + " --plot ";
  const ProgramOutcome named = RunDlcs(solve + "'" + folder_.File("solve.gif") + "'");
  EXPECT_EQ(named.code, 2);
  EXPECT_EQ(named.out, "");
  EXPECT_THAT(named.err, HasSubstr("--plot " + folder_.File("solve.gif") + ": must end with .svg or .png"));
}

// A title comes from a file that somebody else may have written.
TEST_F(PlotCommandTest, ATitleIsTextAndNoCommand) {
  auto root = nlohmann::json::parse(ContentOf(result_));
  const std::string mark = folder_.File("mark");
  root["title"] = "a'; system 'touch " + mark + "'; set title ' `touch " + mark + "` \n!touch " + mark + "\n_{sub}";
  std::ofstream(result_) << root.dump();
  const std::string picture = folder_.File("it's.svg");
  const ProgramOutcome drawn = RunDlcs("plot '" + result_ + "' --output \"" + picture + "\"");
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  EXPECT_FALSE(std::filesystem::exists(mark));
  EXPECT_THAT(ContentOf(picture), HasSubstr("_{sub}"));
}

TEST_F(PlotCommandTest, BadInputIsNamedAndNothingIsWritten) {
  const std::string picture = folder_.File("result.svg");
  EXPECT_THAT(Plot(folder_.File("missing.json"), picture).err, HasSubstr("there is no such file; check the path"));
  EXPECT_THAT(Plot(result_, folder_.File("result.gif")).err, HasSubstr("must end with .svg or .png"));
  EXPECT_THAT(Plot(dlcs::testing::ExamplePath("rectifier"), picture).err,
              AllOf(HasSubstr("no trajectory to draw"), HasSubstr("dlcs solve PROBLEM --plot FILE.svg draws at once")));
  std::ofstream(folder_.File("text")) << "no JSON";
  EXPECT_THAT(Plot(folder_.File("text"), picture).err, HasSubstr("is not the JSON"));
  auto root = nlohmann::json::parse(ContentOf(result_));
  root["trajectory"]["x"].erase(0);
  std::ofstream(folder_.File("short.json")) << root.dump();
  const ProgramOutcome cut = Plot(folder_.File("short.json"), picture);
  EXPECT_EQ(cut.code, 2);
  EXPECT_THAT(cut.err, HasSubstr("missing values"));
  const ProgramOutcome nowhere = Plot(result_, folder_.File("no/such/folder/a.svg"));
  EXPECT_EQ(nowhere.code, 2);
  EXPECT_THAT(nowhere.err,
              AllOf(HasSubstr("there is no folder " + folder_.File("no/such/folder")), Not(HasSubstr("gnuplot"))));
  EXPECT_THAT(RunDlcs("plot '" + result_ + "' --show volts --output '" + picture + "'").err,
              HasSubstr("\"volts\" is not a component of the result, which has i, v, diode, w(diode); x, y and w"));
  EXPECT_FALSE(std::filesystem::exists(picture));
}

// Before the solve, which may take long.
TEST_F(PlotCommandTest, ASolveWhosePictureHasNoFolderDoesNotBegin) {
  const ProgramOutcome refused = RunDlcs("solve " + QuotedExample("rectifier") + " --plot /no/such/folder/a.svg");
  EXPECT_EQ(refused.code, 2);
  EXPECT_EQ(refused.out, "");
  EXPECT_THAT(refused.err, HasSubstr("--plot /no/such/folder/a.svg: there is no folder /no/such/folder"));
}

// gnuplot ends with 0 then.
TEST_F(PlotCommandTest, AFullDiskIsReported) {
  const std::string full = folder_.File("full.svg");
  std::filesystem::create_symlink("/dev/full", full);
  const ProgramOutcome outcome = Plot(result_, full);
  EXPECT_EQ(outcome.code, 3);
  EXPECT_THAT(outcome.err, HasSubstr("No space left on device; is the disk full?"));
}

}  // namespace
}  // namespace dlcs::client
