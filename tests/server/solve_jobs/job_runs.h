// SPDX-License-Identifier: Apache-2.0
// Helpers for tests of jobs.

#ifndef DLCS_TESTS_SERVER_SOLVE_JOBS_JOB_RUNS_H_
#define DLCS_TESTS_SERVER_SOLVE_JOBS_JOB_RUNS_H_

#include <string>
#include <vector>

#include "client/rpc/job_client.h"
#include "dlcs/v1/jobs.pb.h"
#include "tests/server/store/temporary_folder.h"

namespace dlcs::testing {

struct Trajectory {
  std::vector<double> times, x, y, w;
};

// The whole stored trajectory of a job. The test fails if a page does not continue the one before, or the last one does
// not report that the job has ended.
Trajectory ReadAll(client::JobClient& client, const std::string& name);

// The trajectory that the engine computes in this process, without a job.
Trajectory SolveHere(const v1::SolveRequest& request);

// The same bits.
void ExpectSameTrajectory(const Trajectory& found, const Trajectory& expected);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SERVER_SOLVE_JOBS_JOB_RUNS_H_
