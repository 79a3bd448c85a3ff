// SPDX-License-Identifier: Apache-2.0
// The program dlcsd is killed at random moments while the engine works at jobs: nothing acknowledged is lost, and the
// bits are those of solves that nobody disturbed.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "client/job_client.h"
#include "tests/server/dlcsd_process.h"
#include "tests/server/job_events.h"
#include "tests/server/job_runs.h"
#include "tests/server/jobs/random_kills.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using client::CallLimits;
using client::JobClient;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::DlcsdProcess;

constexpr seconds kPatience{120};

struct Followed {
  std::string name;
  v1::SolveRequest request;
  std::vector<v1::JobEvent> events;
  absl::Status status;
  std::thread thread;
};

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
  const CallLimits limits{.deadline = kPatience, .stop = {}};
  const auto client = *JobClient::Connect(listen);

  std::vector<std::unique_ptr<Followed>> jobs;
  const auto submit = [&](v1::SolveRequest request) {
    v1::CreateSolveJobRequest create;
    *create.mutable_solve() = request;
    const auto job = client->Submit(create, limits);
    ASSERT_TRUE(job.ok()) << job.status();
    auto followed = std::make_unique<Followed>();
    followed->name = job->name();
    followed->request = std::move(request);
    followed->thread = std::thread([address = listen, limits, f = followed.get()] {
      const auto watching = *JobClient::Connect(address);
      v1::WatchSolveJobRequest watch;
      watch.set_name(f->name);
      f->status = watching->Watch(
          watch, [f](const v1::JobEvent& event) { f->events.push_back(event); }, limits);
    });
    jobs.push_back(std::move(followed));
  };

  std::uniform_int_distribution<int> pause_ms(5, 250);
  for (int kill = 0; kill < kills.count; ++kill) {
    // One is submitted while the server may be dying: sent again, it is still one job.
    if (jobs.size() < 24) {
      submit(kill % 2 == 0 ? testing::MarchingRequest(60'000 + 1000 * kill) : testing::SwitchingRequest(20'000 + kill));
    }
    std::this_thread::sleep_for(milliseconds(pause_ms(random)));
    server->Signal(SIGKILL);
    server->Wait();
    start();
  }
  for (const auto& job : jobs) {
    job->thread.join();
    EXPECT_TRUE(job->status.ok()) << job->status;
    EXPECT_EQ(testing::WhatIsWrongWithJobEvents(job->events), "") << job->name;
    const auto ended = client->Get(job->name, limits);
    ASSERT_TRUE(ended.ok()) << ended.status();
    EXPECT_EQ(ended->state(), v1::JOB_STATE_SUCCEEDED) << ended->error().message();
    testing::ExpectSameTrajectory(testing::ReadAll(*client, job->name), testing::SolveHere(job->request));
  }
  const auto all = client->List({}, 1000, limits);
  ASSERT_TRUE(all.ok());
  EXPECT_EQ(all->size(), jobs.size()) << "a job twice";
}

}  // namespace
}  // namespace dlcs
