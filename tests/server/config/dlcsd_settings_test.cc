// SPDX-License-Identifier: Apache-2.0
// Flags, variables and a configuration file, as the program reads them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/server/dlcsd_process.h"
#include "tests/server/store/temporary_folder.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using ::testing::AllOf;
using testing::DlcsdProcess;
using ::testing::HasSubstr;
using ::testing::Not;

class DlcsdSettingsTest : public ::testing::Test {
 protected:
  // A file with this text. Returns its path.
  std::string Write(const std::string& text) {
    std::ofstream(path_) << text;
    return path_;
  }

  jobs::testing::TemporaryFolder folder_;
  const std::string path_ = folder_.File("dlcsd.conf");
};

// What the program prints and how it ends.
struct Ended {
  std::string output, errors;
  int exit_status = 0;
};
Ended RunDlcsd(const std::vector<std::string>& flags, const std::vector<std::string>& environment = {}) {
  DlcsdProcess dlcsd(flags, environment);
  Ended ended;
  ended.output = dlcsd.ReadOutput();
  ended.exit_status = dlcsd.Wait();
  ended.errors = dlcsd.ReadErrors();
  return ended;
}

TEST_F(DlcsdSettingsTest, FlagBeforeVariableBeforeFileBeforeDefault) {
  Write("max-steps = 1\nmax-members = 1\nmax-states = 1\n");
  const Ended told = RunDlcsd({"--config", path_, "--max-steps", "3", "--check-config"},
                              {"DLCSD_MAX_STEPS=2", "DLCSD_MAX_MEMBERS=2", "DLCSD_MAX_STATES="});
  EXPECT_EQ(told.exit_status, 0) << told.errors;
  EXPECT_THAT(told.output, ::testing::ContainsRegex("max-steps = 3 +# flag\n"));
  EXPECT_THAT(told.output, ::testing::ContainsRegex("max-members = 2 +# DLCSD_MAX_MEMBERS\n"));
  EXPECT_THAT(told.output, ::testing::ContainsRegex("max-states = 1 +# " + path_ + ":3\n"));
  EXPECT_THAT(told.output, HasSubstr("max-constraints = 2000\n"));
}

TEST_F(DlcsdSettingsTest, WhatIsPrintedMeansTheSameWhenItIsRead) {
  const Ended first = RunDlcsd({"--store", folder_.File("the jobs.db"), "--threads", "3", "--check-config"});
  Write(first.output);
  const Ended second = RunDlcsd({"--check-config"}, {"DLCSD_CONFIG=" + path_});
  EXPECT_EQ(second.exit_status, 0) << second.errors;
  EXPECT_THAT(second.output, HasSubstr("store = \"" + folder_.File("the jobs.db") + "\""));
  EXPECT_THAT(second.output, HasSubstr("threads = 3"));
}

TEST_F(DlcsdSettingsTest, AFileIsWhatTheServerRunsBy) {
  DlcsdProcess dlcsd({"--config", Write("listen = 127.0.0.1:0\n")});
  const std::string address = dlcsd.ReadAddress();
  EXPECT_THAT(address, HasSubstr("127.0.0.1:"));
  EXPECT_NE(address, "127.0.0.1:50051");
}

TEST_F(DlcsdSettingsTest, ErrorsNameTheSettingItsValueTheRuleAndThePlace) {
  struct Case {
    std::string file;
    std::string words;
  };
  for (const Case& wrong : std::vector<Case>{
           {"\nmax-stepz = 3", path_ + ":2: max-stepz: there is no such setting; did you mean max-steps?"},
           {"help = true", path_ + ":1: help: there is no such setting"},
           {"max-steps = 0", "--max-steps 0: must be at least 1 (" + path_ + ":1)"},
           {"max-steps = many", "--max-steps: \"many\" is not a whole number"},
           {"max-steps = 99999999999999999999", "--max-steps: 99999999999999999999 is too large a number"},
           {"threads = 5000000000", "--threads 5000000000: must be a smaller number (" + path_ + ":1)"},
           {"grace = -1", "--grace: \"-1\" is not a number of seconds between 0 and 86400"},
           {"log-level = loud", "--log-level: \"loud\" is none of debug, info, warn, error, off (" + path_ + ":1)"},
           {"log-format = jsn", "--log-format: \"jsn\" is none of text, json; did you mean json?"},
           {"keep-finished = 5x", "--keep-finished: \"5x\" is not a duration; write seconds, or 90s, 30m, 12h, 7d"},
           {"listen = here", "--listen: \"here\" is not HOST:PORT"},
           {"store = /no/such/folder/jobs.db",
            "--store /no/such/folder/jobs.db: the folder /no/such/folder must exist"},
           {"exit-when-idle = 5 minutes", "\"5 minutes\" is not a duration"},
           {"exit-when-idle = 5m", "--exit-when-idle 300: needs --role worker"},
           {"store = mysql://host/jobs", "--store mysql://host/jobs: must be a file, or begin with postgresql://"},
           {"listen = 0.0.0.0:50051", "--listen 0.0.0.0:50051: other machines can reach this address"},
           {"tls-cert = /no/such.pem\ntls-key = /no/such.key", "/no/such.pem"},
           {"tokens = /no/such.txt", "--tokens /no/such.txt"},
           {"max-held-result-bytes = 5", "--max-held-result-bytes 5: must be at least --max-result-bytes (" + path_},
       }) {
    const Ended told = RunDlcsd({"--check-config", "--config", Write(wrong.file)});
    EXPECT_EQ(told.exit_status, 2) << wrong.file;
    EXPECT_EQ(told.output, "");
    EXPECT_THAT(told.errors, HasSubstr("dlcsd: ")) << wrong.file;
    EXPECT_THAT(told.errors, HasSubstr(wrong.words));
  }
  EXPECT_THAT(RunDlcsd({}, {"DLCSD_MAX_STEPS=0"}).errors,
              HasSubstr("--max-steps 0: must be at least 1 (DLCSD_MAX_STEPS)"));
  EXPECT_THAT(RunDlcsd({"--config", "/no/such"}).errors, HasSubstr("--config /no/such: No such file or directory"));
  EXPECT_EQ(RunDlcsd({"--config", folder_.path().string()}).exit_status, 2);
  EXPECT_EQ(RunDlcsd({}, {"DLCSD_CONFIG=/no/such"}).exit_status, 2);
}

TEST_F(DlcsdSettingsTest, NamesThatAreNoneAreToldWithTheNearestOne) {
  const Ended flag = RunDlcsd({"--max-stepps=3"});
  EXPECT_EQ(flag.exit_status, 2);
  EXPECT_THAT(flag.errors, HasSubstr("--max-stepps: there is no such flag; did you mean --max-steps?"));
  EXPECT_THAT(RunDlcsd({"--zzzzzzzzzz"}).errors, HasSubstr("there is no such flag; dlcsd --help lists all"));
  // Other programs may set such variables: Kubernetes does for a service named dlcsd. That is not an error.
  const Ended variable = RunDlcsd({"--check-config"}, {"DLCSD_MAX_STEP=3", "DLCSD_PORT=tcp://10.0.0.1:50051",
                                                       "DLCSD_SERVICE_HOST=10.0.0.1", "DLCSD_THREADS=1"});
  EXPECT_EQ(variable.exit_status, 0);
  EXPECT_THAT(variable.errors,
              HasSubstr("DLCSD_MAX_STEP is set, but there is no such setting; did you mean DLCSD_MAX_STEPS?"));
  EXPECT_THAT(variable.errors, Not(HasSubstr("DLCSD_PORT")));
  EXPECT_THAT(variable.errors, Not(HasSubstr("DLCSD_SERVICE")));
  EXPECT_THAT(variable.errors, Not(HasSubstr("DLCSD_THREADS")));
}

TEST_F(DlcsdSettingsTest, AFileOfAnotherKindIsRefusedForLittleMemory) {
  {
    std::ofstream file(path_);
    const std::string block(1'000'000, '[');
    for (int k = 0; k < 100; ++k) file << block;
  }
  DlcsdProcess dlcsd({"--config", path_});
  EXPECT_EQ(dlcsd.Wait(), 2);
  const std::string errors = dlcsd.ReadErrors();
  EXPECT_THAT(errors, HasSubstr(path_ + ": has more than 1000000 bytes"));
  EXPECT_LT(errors.size(), 500u);
  if (testing::kSlowness == 1) {  // sanitizers take memory of their own
    // Memory that a child shares with its parent before it becomes dlcsd is counted as its own.
    rusage own{};
    getrusage(RUSAGE_SELF, &own);
    EXPECT_LT(dlcsd.peak_bytes(), std::max<std::int64_t>(100'000'000, 1024 * own.ru_maxrss + 50'000'000));
  }
}

TEST_F(DlcsdSettingsTest, DoesNotStartWithAStoreThatCannotBe) {
  const Ended told = RunDlcsd({"--listen", "127.0.0.1:0", "--store", "/no/such/folder/jobs.db"});
  EXPECT_EQ(told.exit_status, 2);
  EXPECT_THAT(told.errors, HasSubstr("the folder /no/such/folder must exist"));
}

TEST_F(DlcsdSettingsTest, DoesNotTakeAFileOfAnotherKindForItsStore) {
  const std::string problem = folder_.File("problem.json");
  for (const std::string& content : {std::string("{}"), std::string(5000, 'x')}) {
    std::ofstream(problem, std::ios::trunc) << content;
    const Ended told = RunDlcsd({"--listen", "127.0.0.1:0", "--store", problem});
    EXPECT_EQ(told.exit_status, 2);
    EXPECT_THAT(told.errors, AllOf(HasSubstr("--store " + problem), HasSubstr("no SQLite database")));
    std::ostringstream left;
    left << std::ifstream(problem).rdbuf();
    EXPECT_EQ(left.str(), content);
    EXPECT_FALSE(std::filesystem::exists(problem + ".lock"));
  }
  const std::string empty = folder_.File("empty.db");
  std::ofstream(empty).flush();
  EXPECT_EQ(RunDlcsd({"--check-config", "--store", empty}).exit_status, 0);
}

// The second server would continue the jobs that the first one is running.
TEST_F(DlcsdSettingsTest, AFileOfJobsIsForOneServerAtATime) {
  const std::vector<std::string> flags = {"--listen", "127.0.0.1:0", "--store", folder_.File("jobs.db")};
  {
    DlcsdProcess first(flags);
    ASSERT_NE(first.ReadAddress(), "");
    const Ended second = RunDlcsd(flags);
    EXPECT_EQ(second.exit_status, 3);
    EXPECT_THAT(second.errors, HasSubstr("another dlcsd uses it"));
    first.Signal(SIGKILL);
    first.Wait();
  }
  DlcsdProcess next(flags);
  EXPECT_NE(next.ReadAddress(), "");
}

TEST_F(DlcsdSettingsTest, CheckingChangesNothingAndTellsNoPassword) {
  const std::string store = folder_.File("jobs.db");
  EXPECT_EQ(RunDlcsd({"--check-config", "--store", store}).exit_status, 0);
  EXPECT_FALSE(std::filesystem::exists(store));
  // The port may be in use by the running server, whose settings the user wants to change.
  DlcsdProcess running({"--listen", "127.0.0.1:0"});
  EXPECT_EQ(RunDlcsd({"--check-config", "--listen", running.ReadAddress()}).exit_status, 0);
  const Ended told = RunDlcsd({"--check-config"}, {"DLCSD_STORE=postgresql://me:secret@host/jobs"});
  EXPECT_THAT(told.output + told.errors, Not(HasSubstr("secret")));
}

}  // namespace
}  // namespace dlcs
