// SPDX-License-Identifier: Apache-2.0
// What tests of ensembles that are jobs look at.

#ifndef DLCS_TESTS_SERVER_SOLVE_JOBS_ENSEMBLE_RUNS_H_
#define DLCS_TESTS_SERVER_SOLVE_JOBS_ENSEMBLE_RUNS_H_

#include <cstdint>
#include <map>
#include <vector>

#include "dlcs/v1/jobs.pb.h"

namespace dlcs::testing {

// SwitchingRequest() with `steps` for `members` initial states.
v1::CreateEnsembleJobRequest SwitchingEnsemble(int members, std::int64_t steps, int shard_members);

// The values that are kept of each member: t, error, x, y and w.
using EnsembleRows = std::map<std::int64_t, std::vector<double>>;

// Those of the engine in this process, without any job.
EnsembleRows SolveEnsembleHere(const v1::SolveEnsembleRequest& request);

// Adds those of `shard`. The test fails where a member comes twice.
void AddShard(const v1::EnsembleShard& shard, EnsembleRows& rows);

// The same members with the same bits.
void ExpectSameRows(const EnsembleRows& found, const EnsembleRows& expected);

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SERVER_SOLVE_JOBS_ENSEMBLE_RUNS_H_
