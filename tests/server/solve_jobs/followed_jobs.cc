// SPDX-License-Identifier: Apache-2.0
#include "tests/server/solve_jobs/followed_jobs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "tests/server/solve_jobs/job_events.h"
#include "tests/server/solve_jobs/job_runs.h"

namespace dlcs::testing {

using client::Client;

FollowedJobs::FollowedJobs(const std::string& address, std::chrono::seconds patience)
    : address_(address), limits_{.deadline = patience, .stop = {}}, client_(*Client::Connect(address)) {}

void FollowedJobs::Submit(v1::SolveRequest request) {
  v1::CreateSolveJobRequest create;
  *create.mutable_solve() = request;
  const auto submitted = client_->jobs().Submit(create, limits_);
  ASSERT_TRUE(submitted.ok()) << submitted.status();
  Job& job = *jobs_.emplace_back(std::make_unique<Job>());
  job.name = submitted->name();
  job.request = std::move(request);
  job.thread = std::jthread([this, &job] { Follow(job); });
}

void FollowedJobs::Follow(Job& job) const {
  const auto client = *Client::Connect(address_);
  v1::WatchSolveJobRequest watch;
  watch.set_name(job.name);
  job.status = client->jobs().Watch(
      watch, [&job](const v1::SolveEvent& event) { job.events.push_back(event); }, limits_);
  job.ended = true;
}

std::size_t FollowedJobs::unfinished() const {
  return static_cast<std::size_t>(
      std::count_if(jobs_.begin(), jobs_.end(), [](const auto& job) { return !job->ended; }));
}

void FollowedJobs::ExpectAllSucceed() {
  for (const auto& job : jobs_) {
    job->thread.join();
    EXPECT_TRUE(job->status.ok()) << job->status;
    EXPECT_EQ(WhatIsWrongWithJobEvents(job->events), "") << job->name;
    const auto ended = client_->jobs().Get(job->name, limits_);
    ASSERT_TRUE(ended.ok()) << ended.status();
    EXPECT_EQ(ended->state(), v1::JOB_STATE_SUCCEEDED) << ended->error().message();
    ExpectSameTrajectory(ReadAll(client_->jobs(), job->name), SolveHere(job->request));
  }
  const auto all = client_->jobs().List({}, 1000, limits_);
  ASSERT_TRUE(all.ok());
  EXPECT_EQ(all->size(), jobs_.size()) << "a job twice";
}

}  // namespace dlcs::testing
