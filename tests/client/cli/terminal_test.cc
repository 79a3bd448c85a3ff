// SPDX-License-Identifier: Apache-2.0
// The built program on a terminal.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <csignal>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "client/cli/output/result_page.h"
#include "client/cli/terminal/wrapped_text.h"
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

// The final screen after the output `text`, with the control sequences that a panel uses. Sets `widest` to the length
// of the longest line that was ever shown.
std::vector<std::string> ScreenAfter(const std::string& text, std::size_t& widest) {
  std::vector<std::string> lines(1);
  std::size_t row = 0, column = 0;
  widest = 0;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (c == '\r') {
      column = 0;
    } else if (c == '\n') {
      ++row;
      if (row == lines.size()) lines.emplace_back();
    } else if (c == '\x1b') {
      std::size_t end = at + 2;
      while (std::isalpha(static_cast<unsigned char>(text[end])) == 0) ++end;
      if (text[end] == 'A') row -= std::stoul(text.substr(at + 2, end - at - 2));
      if (text[end] == 'K' || text[end] == 'J') lines[row].resize(std::min(lines[row].size(), column));
      if (text[end] == 'J') lines.resize(row + 1);
      at = end;
    } else {
      if (lines[row].size() <= column) lines[row].resize(column + 1, ' ');
      lines[row][column++] = c;
      widest = std::max(widest, LetterCount(lines[row]));
    }
  }
  return lines;
}

// A solve that lasts until it is stopped.
RunningProgram LongSolve(const std::string& problem, std::map<std::string, std::string> variables, int columns) {
  variables.emplace("LC_ALL", "C.UTF-8");
  return RunningProgram({"solve", problem, "--method", "wu-chen-iteration", "--steps", "2000000"},
                        {.variables = variables, .columns = columns});
}

TEST_F(TerminalTest, ShowsAPanelAndNoIterates) {
  RunningProgram program = LongSolve(problem_, {{"TERM", "xterm"}, {"NO_COLOR", "1"}}, 100);
  program.AwaitErrorText("\r[....");
  program.AwaitErrorText("t = 0 of 4");
  program.Send({SIGINT});
  const ProgramOutcome outcome = program.Await();
  EXPECT_EQ(outcome.code, 130);
  EXPECT_THAT(outcome.out, AllOf(Not(HasSubstr("LCP resid")), Not(HasSubstr("\x1b[3"))));
}

TEST_F(TerminalTest, CtrlCLeavesNothingOfThePanel) {
  for (const std::vector<int>& signals : {std::vector<int>{SIGINT}, {SIGINT, SIGINT}}) {
    RunningProgram program = LongSolve(problem_, {{"TERM", "xterm"}}, 40);
    program.AwaitErrorText("t = 0 of 4");
    for (const int signal : signals) program.Send({signal});
    const ProgramOutcome outcome = program.Await();
    EXPECT_EQ(outcome.code, 130);
    EXPECT_THAT(outcome.out, Not(HasSubstr("\x1b[?25")));  // the cursor was never hidden
    std::size_t widest = 0;
    for (const std::string& line : ScreenAfter(outcome.out, widest)) {
      EXPECT_THAT(line, AllOf(Not(HasSubstr("[....")), Not(HasSubstr("t = 0 of 4"))));
    }
  }
}

TEST_F(TerminalTest, ThePanelFollowsTheWidth) {
  RunningProgram program = LongSolve(problem_, {{"TERM", "xterm"}}, 100);
  program.AwaitErrorText("\r[" + std::string(30, '.') + "]");
  program.Resize(40);
  program.AwaitErrorText("\r[......]");
  program.Send({SIGTERM});
  EXPECT_EQ(program.Await().code, 143);
}

TEST_F(TerminalTest, ThePanelNeverWraps) {
  RunningProgram program = LongSolve(problem_, {{"TERM", "xterm"}}, 40);
  program.AwaitErrorText("t = 0 of 4");
  program.Send({SIGINT});
  const std::string out = program.Await().out;
  std::size_t widest = 0;
  ScreenAfter(out.substr(0, out.rfind("\x1b[J")), widest);
  EXPECT_LT(widest, 40U);
}

// Rows are printed as they come: a panel below them would be redrawn into them.
TEST_F(TerminalTest, CsvOnATerminalHasNoPanel) {
  RunningProgram program({"solve", problem_, "--steps", "200000", "--no-estimate-error", "--format", "csv"},
                         {.variables = {{"TERM", "xterm"}}, .columns = 80});
  const ProgramOutcome outcome = program.Await();
  EXPECT_EQ(outcome.code, 0);
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("\n4,"), Not(HasSubstr("\x1b[J")), Not(HasSubstr("\r["))));
}

TEST_F(TerminalTest, ADumbTerminalHasLinesAndNoControlSequences) {
  RunningProgram program = LongSolve(problem_, {{"TERM", "dumb"}}, 80);
  program.AwaitErrorText("2000000 steps");
  program.Send({SIGINT});
  EXPECT_THAT(program.Await().out, Not(HasSubstr("\x1b")));
}

TEST_F(TerminalTest, APipeHasLinesAndNoControlSequences) {
  RunningProgram program = LongSolve(problem_, {{"TERM", "xterm"}}, 0);
  program.AwaitErrorText("2000000 steps");
  program.Send({SIGINT});
  const ProgramOutcome outcome = program.Await();
  EXPECT_THAT(outcome.out + outcome.err, AllOf(Not(HasSubstr("\x1b")), Not(HasSubstr("\r"))));
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

TEST(FirstLettersTest, CountsCharactersAndKeepsEscapeSequences) {
  EXPECT_EQ(FirstLetters("one two", 3), "one");
  EXPECT_EQ(FirstLetters("▁▂▃", 2), "▁▂");
  EXPECT_EQ(FirstLetters("\x1b[36mone\x1b[0m two", 2), "\x1b[36mon\x1b[0m");
  EXPECT_EQ(FirstLetters("", 2), "");
}

TEST(WrappedTest, ContinuesBelowTheTextBehindALabel) {
  EXPECT_EQ(Wrapped("  label    one two three", 22), "  label    one two\n           three");
  EXPECT_EQ(Wrapped("  label    one", 20), "  label    one");
  EXPECT_EQ(Wrapped("one two three four", 8), "one two\nthree\nfour");
}

}  // namespace
}  // namespace dlcs::client
