// SPDX-License-Identifier: Apache-2.0
// An ensemble on a front and four workers that share one PostgreSQL. Two workers are killed on the way and started
// again: every result is delivered once, with the bits of an undisturbed ensemble.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "client/rpc/client.h"
#include "tests/server/solve_jobs/ensemble_runs.h"
#include "tests/server/solve_jobs/fleet_server.h"
#include "tests/server/store/postgres/postgres_server.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using client::Client;
using jobs::testing::PostgresServer;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::FleetServer;

client::CallLimits Patient() { return {.deadline = seconds(200), .stop = {}}; }

class EnsembleClusterTest : public ::testing::Test {
 protected:
  void SetUp() override {
    // The clocks differ by minutes; leases use the clock of the database.
    for (const std::string offset_s : {"0", "300", "-300", "7"}) {
      workers_.push_back(std::make_unique<FleetServer>(
          "worker", "worker" + offset_s, database_.address(), std::vector<std::string>{"--threads", "1"},
          std::vector<std::string>{"DLCS_TEST_CLOCK_OFFSET_S=" + offset_s}));
    }
    client_ = *Client::Connect(front_->address());
  }

  v1::SolveJob Submit(const v1::CreateEnsembleJobRequest& request) {
    const auto job = client_->jobs().SubmitEnsemble(request, Patient());
    EXPECT_TRUE(job.ok()) << job.status();
    return job.value_or(v1::SolveJob());
  }
  // Follows the ensemble to its end, and counts the shards that came in `arrived`.
  testing::EnsembleRows Follow(const std::string& name, std::atomic<int>& arrived) {
    v1::ReadEnsembleRequest request;
    request.set_name(name);
    request.set_follow(true);
    testing::EnsembleRows rows;
    const absl::Status read = client_->jobs().ReadEnsemble(
        request,
        [&](const v1::EnsembleShard& shard) {
          testing::AddShard(shard, rows);
          ++arrived;
        },
        Patient());
    EXPECT_TRUE(read.ok()) << read;
    return rows;
  }

  PostgresServer database_;
  std::unique_ptr<FleetServer> front_ = std::make_unique<FleetServer>("front", "front", database_.address());
  std::vector<std::unique_ptr<FleetServer>> workers_;
  std::unique_ptr<Client> client_;
};

TEST_F(EnsembleClusterTest, KilledWorkersLoseNoResultAndRepeatNone) {
  constexpr int kShards = 40;
  v1::CreateEnsembleJobRequest request = testing::SwitchingEnsemble(10 * kShards, 4000 / testing::kSlowness, 10);
  const v1::SolveJob job = Submit(request);
  EXPECT_EQ(job.ensemble().shards(), kShards);
  std::atomic<int> arrived{0};
  testing::EnsembleRows rows;
  std::thread reader([&] { rows = Follow(job.name(), arrived); });
  const auto wait_for = [&arrived](int shards) {
    while (arrived < shards) std::this_thread::sleep_for(milliseconds(1));
  };
  wait_for(3);
  workers_[0]->Kill();
  wait_for(8);
  workers_[1]->Kill();
  wait_for(15);
  workers_[0]->Start();
  front_->Kill();  // the reader resumes
  front_->Start();
  workers_[1]->Start();
  reader.join();

  EXPECT_EQ(arrived, kShards);
  request.mutable_ensemble()->mutable_options()->add_output_times(request.ensemble().problem().horizon());
  testing::ExpectSameRows(rows, testing::SolveEnsembleHere(request.ensemble()));
  const auto ended = client_->jobs().Get(job.name(), Patient());
  EXPECT_EQ(ended->state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(ended->ensemble().shards_done(), kShards);
  const v1::EnsembleCounts& counts = ended->ensemble().counts();
  EXPECT_EQ(counts.solved() + counts.reached() + counts.failed(), 10 * kShards);
}

TEST_F(EnsembleClusterTest, ACancelledEnsembleFreesAllWorkers) {
  v1::CreateEnsembleJobRequest request = testing::SwitchingEnsemble(1000, 300'000 / testing::kSlowness, 100);
  const v1::SolveJob job = Submit(request);
  std::this_thread::sleep_for(milliseconds(300));
  EXPECT_EQ(client_->jobs().Cancel(job.name(), Patient())->state(), v1::JOB_STATE_CANCELLED);
  const v1::SolveJob next = Submit(testing::SwitchingEnsemble(40, 100, 10));
  std::atomic<int> arrived{0};
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(Follow(next.name(), arrived).size(), 40u);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, seconds(20));
}

}  // namespace
}  // namespace dlcs
