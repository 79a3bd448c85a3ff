// SPDX-License-Identifier: Apache-2.0
// Helpers for tests of ensembles that run as jobs.

#ifndef DLCS_TESTS_SERVER_SOLVE_JOBS_ENSEMBLE_RUNS_H_
#define DLCS_TESTS_SERVER_SOLVE_JOBS_ENSEMBLE_RUNS_H_

#include <cstdint>
#include <map>
#include <vector>

#include "dlcs/v1/jobs.pb.h"

namespace dlcs::testing {

// SwitchingRequest() with `steps` for `members` initial states.
v1::CreateEnsembleJobRequest SwitchingEnsemble(int members, std::int64_t steps, int shard_members);

// The stored values of each member: t, error, x, y and w.
using EnsembleRows = std::map<std::int64_t, std::vector<double>>;

// The values that the engine computes in this process, without a job.
EnsembleRows SolveEnsembleHere(const v1::SolveEnsembleRequest& request);

// Adds the values of `shard`. The test fails if a member occurs twice.
void AddShard(const v1::EnsembleShard& shard, EnsembleRows& rows);

// The same members with the same bits.
void ExpectSameRows(const EnsembleRows& found, const EnsembleRows& expected);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SERVER_SOLVE_JOBS_ENSEMBLE_RUNS_H_
