// SPDX-License-Identifier: Apache-2.0
// Jobs that are watched from begin to end while servers are killed, and the checks of their results.

#ifndef DLCS_TESTS_SERVER_SOLVE_JOBS_FOLLOWED_JOBS_H_
#define DLCS_TESTS_SERVER_SOLVE_JOBS_FOLLOWED_JOBS_H_

#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "client/rpc/client.h"
#include "dlcs/v1/jobs.pb.h"

namespace dlcs::testing {

class FollowedJobs {
 public:
  // Jobs of the server at `address`, which has no other jobs and responds within `patience`.
  FollowedJobs(const std::string& address, std::chrono::seconds patience);

  // Submits a job, and watches it on a thread with a connection of its own. The test fails if the job is refused.
  void Submit(v1::SolveRequest request);

  std::size_t size() const { return jobs_.size(); }
  // The number of jobs whose watch has not ended.
  std::size_t unfinished() const;

  // Waits for all of them. The test fails unless each has succeeded, no event was missing or delivered twice, the
  // results have the bits of undisturbed solves, and the server has exactly these jobs.
  void ExpectAllSucceed();

 private:
  struct Job {
    std::string name;
    v1::SolveRequest request;
    std::vector<v1::SolveEvent> events;
    absl::Status status;
    std::atomic<bool> ended = false;
    std::jthread thread;  // last: it uses the others
  };
  void Follow(Job& job) const;

  const std::string address_;
  const client::CallLimits limits_;
  const std::unique_ptr<client::Client> client_;
  std::vector<std::unique_ptr<Job>> jobs_;
};

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SERVER_SOLVE_JOBS_FOLLOWED_JOBS_H_
