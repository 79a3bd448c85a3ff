// SPDX-License-Identifier: Apache-2.0
// The completion scripts in the real shells.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/client/cli/program.h"
#include "tests/server/store/temporary_folder.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::IsSupersetOf;
using ::testing::Not;
using ::testing::StartsWith;
using ::testing::UnorderedElementsAre;

class CompletionTest : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const ProgramOutcome script = RunDlcs(std::string("completion ") + GetParam());
    ASSERT_EQ(script.code, 0) << script.err;
    std::ofstream(script_) << script.out;
  }

  // The words that the shell offers for the last word of `line`.
  std::vector<std::string> Completions(const std::string& line) const {
    const std::string shell = GetParam();
    const std::string last = line.substr(line.rfind(' ') + 1);
    std::string program;
    if (shell == "fish") {
      program = "source " + script_ + "; complete -C '" + line + "'";
    } else {
      // In zsh, bashcompinit calls the function in the same way, with arrays from 0 and the word in PREFIX.
      const std::string begin =
          shell == "zsh" ? "autoload -U +X compinit && compinit -u; setopt ksharrays; PREFIX='" + last + "'; " : "";
      program = begin + "source " + script_ + "; COMP_WORDS=(" + line + (line.ends_with(' ') ? "\"\"" : "") +
                "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _dlcs; printf \"%s\\n\" \"${COMPREPLY[@]}\"";
    }
    std::ofstream(folder_.File("program")) << program;
    const std::string command = "HOME=" + folder_.File("") + " " + shell + " " + folder_.File("program");
    std::FILE* const out = popen(command.c_str(), "r");
    std::vector<std::string> words;
    char text[4096];
    while (std::fgets(text, sizeof text, out) != nullptr) {
      std::string word = text;
      word = word.substr(0, word.find_first_of("\t\n"));              // fish adds descriptions
      const bool offered = shell != "zsh" || word.starts_with(last);  // zsh itself leaves out the others
      if (!word.empty() && offered) words.push_back(word);
    }
    EXPECT_EQ(pclose(out), 0);
    return words;
  }

  jobs::testing::TemporaryFolder folder_;
  const std::string script_ = folder_.File("script");
};

TEST_P(CompletionTest, KnowsCommandsOptionsAndTheirWords) {
  EXPECT_THAT(Completions("dlcs an"), ElementsAre("analyze"));
  EXPECT_THAT(Completions("dlcs "), IsSupersetOf({"solve", "plot", "watch", "completion"}));
  EXPECT_THAT(Completions("dlcs solve --tol"), ElementsAre("--tolerance"));
  EXPECT_THAT(Completions("dlcs solve --"), AllOf(Contains("--format"), Each(StartsWith("--"))));
  EXPECT_THAT(Completions("dlcs solve --format "),
              UnorderedElementsAre("table", "json", "csv", "npy", "npz", "hdf5", "mat", "raw"));
  EXPECT_THAT(Completions("dlcs ensemble --format "), UnorderedElementsAre("table", "json", "csv"));
  EXPECT_THAT(Completions("dlcs solve --method ev"), ElementsAre("event-driven"));
  EXPECT_THAT(Completions("dlcs model sig"), ElementsAre("signorini"));
  EXPECT_THAT(Completions("dlcs context "), IsSupersetOf({"set", "use", "list", "delete"}));
  EXPECT_THAT(Completions("dlcs help pl"), ElementsAre("plot"));
  EXPECT_THAT(Completions("dlcs plot --"), Not(Contains("--tolerance")));
}

TEST_P(CompletionTest, KnowsFiles) {
  std::ofstream(folder_.File("circuit.json")) << "{}";
  EXPECT_THAT(Completions("dlcs solve " + folder_.File("circ")), ElementsAre(folder_.File("circuit.json")));
}

INSTANTIATE_TEST_SUITE_P(Shells, CompletionTest, ::testing::Values("bash", "zsh", "fish"),
                         [](const auto& test) { return std::string(test.param); });

}  // namespace
}  // namespace dlcs::client
