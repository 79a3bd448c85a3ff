// SPDX-License-Identifier: Apache-2.0
// The manual page through the real formatter.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <string>

#include "tests/client/cli/program.h"
#include "tests/server/store/temporary_folder.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string PrintedBy(const std::string& command) {
  std::FILE* const out = popen(command.c_str(), "r");
  std::string text;
  char block[4096];
  for (std::size_t count; (count = std::fread(block, 1, sizeof block, out)) > 0;) text.append(block, count);
  EXPECT_EQ(pclose(out), 0) << command << "\n" << text;
  return text;
}

class ManPageTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const ProgramOutcome page = RunDlcs("man");
    ASSERT_EQ(page.code, 0) << page.err;
    std::ofstream(page_) << page.out;
  }

  jobs::testing::TemporaryFolder folder_;
  const std::string page_ = folder_.File("dlcs.1");
};

TEST_F(ManPageTest, IsRoffWithoutAComplaint) {
  EXPECT_EQ(PrintedBy("groff -man -Tutf8 -ww -z '" + page_ + "' 2>&1"), "");
  // It has no date, which would differ between builds.
  EXPECT_EQ(PrintedBy("mandoc -Tlint -Wwarning '" + page_ + "' 2>&1 | sed '/missing date/d'"), "");
}

TEST_F(ManPageTest, HasEveryCommandOptionAndExitCode) {
  // Without the overstrikes and colors of a terminal; on long lines, so that no text is broken.
  const std::string text = PrintedBy("GROFF_NO_SGR=1 groff -man -Tutf8 -P-cbou -rLL=200n '" + page_ + "'");
  for (const char* const section : {"NAME", "SYNOPSIS", "DESCRIPTION", "COMMANDS", "EXIT STATUS"}) {
    EXPECT_THAT(text, HasSubstr(std::string("\n") + section + "\n"));
  }
  EXPECT_THAT(text, AllOf(HasSubstr("dlcs solve PROBLEM [OPTION]..."), HasSubstr("dlcs context set NAME [OPTION]..."),
                          HasSubstr("-o, --output FILE"), HasSubstr("--tolerance E"), HasSubstr("Everyday:"),
                          HasSubstr("Only wu-chen-iteration:"), HasSubstr("143 SIGTERM.")));
  // Letter by letter, so that it can be copied.
  EXPECT_THAT(text, AllOf(HasSubstr(R"({"A": [[-1]], "B": [[1]])"), HasSubstr(R"("f": ["-x1**3+y1"])"),
                          HasSubstr("dlcs submit circuit.json --title 'diode, warm' --wait")));
  EXPECT_THAT(text, AllOf(Not(HasSubstr("\\")), Not(HasSubstr("{false}"))));
}

}  // namespace
}  // namespace dlcs::client
