// SPDX-License-Identifier: Apache-2.0
// Jobs that are watched from their beginning to their end while servers are killed, and what must be true of them then.

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
  // Of the server at `address`, which has no other jobs and answers within `patience`.
  FollowedJobs(const std::string& address, std::chrono::seconds patience);

  // From now on a thread watches the job, with a connection of its own. The test fails where the job is not taken.
  void Submit(v1::SolveRequest request);

  std::size_t size() const { return jobs_.size(); }
  // Those whose watch has not ended.
  std::size_t unfinished() const;

  // Waits for all of them. The test fails unless each has succeeded, was told with no event twice or missing, and has
  // the bits of a solve that nobody disturbed; and unless the server has these jobs and no others.
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
