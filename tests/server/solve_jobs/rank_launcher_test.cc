// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/rank_launcher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "spdlog/spdlog.h"
#include "tests/server/store/temporary_folder.h"

namespace dlcs {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(RankLauncherTest, WordsAreThoseOfAShell) {
  EXPECT_THAT(*SplitLauncher("mpirun  -n {ranks}"), ElementsAre("mpirun", "-n", "{ranks}"));
  EXPECT_THAT(*SplitLauncher("srun --ntasks={ranks} '--comment=for dlcs' \"\""),
              ElementsAre("srun", "--ntasks={ranks}", "--comment=for dlcs", ""));
  for (const char* const bad : {"", "mpirun -n 2", "mpirun -n '{ranks}"}) {
    const absl::Status status = SplitLauncher(bad).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << bad;
    EXPECT_THAT(std::string(status.message()), HasSubstr("--mpi-launcher"));
  }
}

// The launcher is a shell that runs a program of this test, which gets the words that ranks would get.
class RankLauncherProcessTest : public ::testing::Test {
 protected:
  // What programs print goes to the log.
  void SetUp() override { spdlog::set_level(spdlog::level::off); }
  void TearDown() override { spdlog::set_level(level_); }

  std::unique_ptr<RankLauncher> Start(const std::string& program,
                                      const std::vector<std::pair<std::string, std::string>>& variables = {}) {
    std::ofstream(folder_.File("program")) << program;
    auto launcher = RankLauncher::Start(
        {.launcher = "/bin/sh " + folder_.File("program") + " {ranks}", .program = "/bin/true", .host = "127.0.0.1"}, 3,
        variables, "job x");
    EXPECT_TRUE(launcher.ok()) << launcher.status();
    return launcher.ok() ? *std::move(launcher) : nullptr;
  }
  std::string Read(const std::string& name) {
    std::ifstream file(folder_.File(name));
    return {std::istreambuf_iterator<char>(file), {}};
  }

  const spdlog::level::level_enum level_ = spdlog::get_level();
  jobs::testing::TemporaryFolder folder_;
};

TEST_F(RankLauncherProcessTest, GivesNumberProgramAndVariables) {
  setenv("DLCSD_STORE", "postgresql://dlcs:secret@db/dlcs", 1);
  const auto launcher = Start("echo \"$@\" > " + folder_.File("words") + "\nenv > " + folder_.File("variables") +
                                  "\nls /proc/self/fd | wc -l > " + folder_.File("files") + "\ncat\n",
                              {{"DLCS_MPI_SECRET", "s"}});
  ASSERT_TRUE(launcher->Wait(seconds(10)));  // cat reads an empty standard input
  unsetenv("DLCSD_STORE");
  EXPECT_EQ(Read("words"), "3 /bin/true --ranks 3 attend\n");
  EXPECT_THAT(Read("variables"), HasSubstr("DLCS_MPI_SECRET=s\n"));
  EXPECT_THAT(Read("variables"), HasSubstr("PATH="));
  EXPECT_THAT(Read("variables"), Not(HasSubstr("DLCSD_STORE")));
  EXPECT_EQ(std::stoi(Read("files")), 4);  // 0, 1, 2, and the folder that is listed
  EXPECT_EQ(launcher->HowItEnded(), "ended with exit code 0");
  EXPECT_FALSE(launcher->WasKilled());
}

TEST_F(RankLauncherProcessTest, KeepsWhatIsPrintedLast) {
  const auto launcher = Start(
      "i=0; while [ $i -lt 3000 ]; do echo line $i; i=$((i+1)); done\n"
      "printf 'no\\tsuch \\033[31mhost' >&2; exit 7");
  ASSERT_TRUE(launcher->Wait(seconds(10)));
  EXPECT_THAT(launcher->HowItEnded(), HasSubstr("ended with exit code 7: "));
  EXPECT_THAT(launcher->HowItEnded(), HasSubstr("line 2999 / no?such ?[31mhost"));
  EXPECT_LT(launcher->HowItEnded().size(), 1000u);
  EXPECT_FALSE(launcher->WasKilled());
}

TEST_F(RankLauncherProcessTest, KeepsNoAddressesOfCrashes) {
  const auto launcher = Start(
      "echo 'mpirun noticed that rank 1 exited on signal 9'\n"
      "echo '[vm:17] *** Process received signal ***'\n"
      "echo '[vm:17] Signal: Segmentation fault (11)'\n"
      "echo '[vm:17] Signal code: Address not mapped (1)'\n"
      "echo '[vm:17] Failing at address: (nil)'\n"
      "for i in 0 1 2 3 4 5 6 7 8 9; do echo \"[vm:17] [ $i] /lib/libpmix.so.2(PMIx_Finalize+0x703)[0x7fc54c050e83]\"; "
      "done\n"
      "echo '[vm:17] [10] mpirun(+0x1131)[0x559fb69e8131]'\n"
      "echo '[vm:17] *** End of error message ***'\n"
      "kill -SEGV $$");
  ASSERT_TRUE(launcher->Wait(seconds(10)));
  EXPECT_EQ(launcher->HowItEnded(),
            "was ended by signal 11: mpirun noticed that rank 1 exited on signal 9 / "
            "[vm:17] Signal: Segmentation fault (11)");
}

TEST_F(RankLauncherProcessTest, TellsWhatWasKilled) {
  auto launcher = Start("kill -9 $$");
  ASSERT_TRUE(launcher->Wait(seconds(10)));
  EXPECT_TRUE(launcher->WasKilled());
  EXPECT_EQ(launcher->HowItEnded(), "was ended by signal 9");
  launcher = Start("exit 137");  // as mpirun, of a rank
  ASSERT_TRUE(launcher->Wait(seconds(10)));
  EXPECT_TRUE(launcher->WasKilled());
}

TEST_F(RankLauncherProcessTest, EndsWhatDoesNotWantToEnd) {
  const auto launcher = Start("trap '' TERM; echo $$ > " + folder_.File("pid") +
                              "; (while :; do sleep 1; done) & while :; do sleep 1; done");
  EXPECT_FALSE(launcher->Wait(milliseconds(500)));
  const auto begin = steady_clock::now();
  launcher->End();
  EXPECT_LT(steady_clock::now() - begin, seconds(10));
  EXPECT_EQ(launcher->HowItEnded(), "was ended by signal 9");
  // Nor is there anything else of its group, once init has noticed.
  const int group = std::stoi(Read("pid"));
  for (int k = 0; k < 100 && kill(-group, 0) == 0; ++k) std::this_thread::sleep_for(milliseconds(50));
  EXPECT_NE(kill(-group, 0), 0);
}

TEST_F(RankLauncherProcessTest, WhatIsNotThereIsRefused) {
  const RankSettings none{.launcher = "no-such-launcher {ranks}", .program = "/bin/true", .host = "127.0.0.1"};
  EXPECT_THAT(std::string(CheckRankSettings(none).message()), HasSubstr("no-such-launcher is not a program in PATH"));
  EXPECT_EQ(RankLauncher::Start(none, 2, {}, "job x").status().code(), absl::StatusCode::kFailedPrecondition);
  const RankSettings no_ranks{.launcher = "sh {ranks}", .program = "no-such-ranks", .host = "127.0.0.1"};
  EXPECT_THAT(std::string(CheckRankSettings(no_ranks).message()), HasSubstr("--mpi-program no-such-ranks"));
}

}  // namespace
}  // namespace dlcs
