// SPDX-License-Identifier: Apache-2.0
// The built program on a terminal.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "client/cli/output/result_page.h"
#include "client/cli/output/wrapped_text.h"
#include "tests/client/cli/running_program.h"
#include "tests/server/store/temporary_folder.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class TerminalTest : public ::testing::Test {
 protected:
  TerminalTest() { std::ofstream(problem_) << kEasyProblem; }

  std::string Solve(const std::map<std::string, std::string>& variables, int columns = 80) const {
    RunningProgram program({"solve", problem_, "--steps", "100"}, {.variables = variables, .columns = columns});
    const ProgramOutcome outcome = program.Await();
    EXPECT_EQ(outcome.code, 0) << outcome.out;
    return outcome.out;
  }

  jobs::testing::TemporaryFolder folder_;
  const std::string problem_ = folder_.File("easy.json");
};

TEST_F(TerminalTest, ShowsABarAndNoIteratesFromTheFirstSecondOn) {
  RunningProgram program({"solve", problem_, "--method", "wu-chen-iteration", "--steps", "200000"},
                         {.variables = {{"TERM", "xterm"}}, .columns = 100});
  program.AwaitErrorText("\r\x1b[K[....");
  program.AwaitErrorText("t = 0 of 4");
  program.Send({SIGINT});
  const ProgramOutcome outcome = program.Await();
  EXPECT_EQ(outcome.code, 130);
  EXPECT_THAT(outcome.out, Not(HasSubstr("LCP resid")));
}

TEST_F(TerminalTest, ColorsTheVerdictUnlessToldNotTo) {
  EXPECT_THAT(Solve({{"TERM", "xterm"}, {"NO_COLOR", ""}}),
              AllOf(HasSubstr("easy.json: \x1b[3"), HasSubstr("\x1b[0m")));
  EXPECT_THAT(Solve({{"TERM", "xterm"}, {"NO_COLOR", "1"}}), Not(HasSubstr("\x1b[3")));
  EXPECT_THAT(Solve({{"TERM", "dumb"}, {"NO_COLOR", ""}}), Not(HasSubstr("\x1b")));
}

TEST_F(TerminalTest, KeepsAllLinesWithinItsWidth) {
  for (const int columns : {60, 80}) {
    std::istringstream lines(Solve({{"TERM", "dumb"}}, columns));
    for (std::string line; std::getline(lines, line);) {
      if (!line.empty() && line.back() == '\r') line.pop_back();
      EXPECT_LE(LetterCount(line), static_cast<std::size_t>(columns)) << line;
    }
  }
}

TEST(WrappedTest, ContinuesBelowTheTextBehindALabel) {
  EXPECT_EQ(Wrapped("  label    one two three", 22), "  label    one two\n           three");
  EXPECT_EQ(Wrapped("  label    one", 20), "  label    one");
  EXPECT_EQ(Wrapped("one two three four", 8), "one two\nthree\nfour");
}

}  // namespace
}  // namespace dlcs::client
