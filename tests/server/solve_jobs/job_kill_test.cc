// SPDX-License-Identifier: Apache-2.0
// The program dlcsd is killed at random moments while the engine works at jobs: nothing acknowledged is lost, and the
// bits are those of undisturbed solves.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/server/dlcsd_process.h"
#include "tests/server/solve_jobs/followed_jobs.h"
#include "tests/server/store/random_kills.h"
#include "tests/server/store/temporary_folder.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::DlcsdProcess;

constexpr seconds kPatience{120};

TEST(JobKillTest, KilledServersLoseNothingAndRepeatNothing) {
  const jobs::testing::TemporaryFolder folder;
  const jobs::testing::RandomKills kills(6, 1);
  std::mt19937 random(kills.seed);
  SCOPED_TRACE(kills.trace());
  std::string listen = "127.0.0.1:0";
  std::unique_ptr<DlcsdProcess> server;
  const auto start = [&] {
    server.reset();
    server = std::make_unique<DlcsdProcess>(std::vector<std::string>{
        "--listen", listen, "--store", folder.File("jobs.db"), "--checkpoint-ms", "10", "--log-level", "off"});
    listen = server->ReadAddress();
    ASSERT_NE(listen, "");
  };
  start();
  testing::FollowedJobs jobs(listen, kPatience);

  std::uniform_int_distribution<int> pause_ms(5, 250);
  for (int kill = 0; kill < kills.count; ++kill) {
    // One is submitted while the server may be dying: sent again, it is still one job.
    if (jobs.size() < 24) {
      jobs.Submit(kill % 2 == 0 ? testing::SteppingRequest(60'000 + 1000 * kill)
                                : testing::SwitchingRequest(20'000 + kill));
    }
    std::this_thread::sleep_for(milliseconds(pause_ms(random)));
    server->Signal(SIGKILL);
    server->Wait();
    start();
  }
  jobs.ExpectAllSucceed();
}

}  // namespace
}  // namespace dlcs
