// SPDX-License-Identifier: Apache-2.0
#include "tests/server/solve_jobs/ensemble_runs.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "server/session/ensemble_session.h"
#include "tests/server/test_requests.h"

namespace dlcs::testing {

v1::CreateEnsembleJobRequest SwitchingEnsemble(int members, std::int64_t steps, int shard_members) {
  const v1::SolveRequest solve = SwitchingRequest(steps);
  v1::CreateEnsembleJobRequest request;
  *request.mutable_ensemble()->mutable_problem() = solve.problem();
  *request.mutable_ensemble()->mutable_options() = solve.options();
  for (int k = 0; k < members; ++k) request.mutable_ensemble()->add_members()->add_x0(0.01 * k);
  request.set_shard_members(shard_members);
  return request;
}

EnsembleRows SolveEnsembleHere(const v1::SolveEnsembleRequest& request) {
  EnsembleRows rows;
  const SolveControl control;
  const absl::Status solved =
      RunEnsembleToEnd(request, SessionLimits(), "here", control, [&](const v1::EnsembleEvent& event) {
        if (event.has_trajectory()) {
          const v1::TrajectoryChunk& chunk = event.trajectory().chunk();
          std::vector<double>& row = rows[event.trajectory().member()];
          row = {chunk.times(chunk.times_size() - 1), std::numeric_limits<double>::quiet_NaN()};
          for (const auto* values : {&chunk.x(), &chunk.y(), &chunk.w()}) {
            row.insert(row.end(), values->end() - values->size() / chunk.times_size(), values->end());
          }
        }
        if (event.has_member() && event.member().summary().accuracy().has_error()) {
          rows[event.member().member()][1] = event.member().summary().accuracy().error();
        }
      });
  EXPECT_TRUE(solved.ok()) << solved;
  return rows;
}

void AddShard(const v1::EnsembleShard& shard, EnsembleRows& rows) {
  const int columns = shard.values_size() / shard.outcomes_size();
  for (int k = 0; k < shard.outcomes_size(); ++k) {
    const auto begin = shard.values().begin() + k * columns;
    const bool is_new = rows.try_emplace(shard.first_member() + k, begin, begin + columns).second;
    EXPECT_TRUE(is_new) << "member " << shard.first_member() + k << " came twice";
  }
}

void ExpectSameRows(const EnsembleRows& found, const EnsembleRows& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (const auto& [member, row] : expected) {
    const auto other = found.find(member);
    ASSERT_NE(other, found.end()) << member;
    ASSERT_EQ(other->second.size(), row.size()) << member;
    EXPECT_EQ(std::memcmp(other->second.data(), row.data(), sizeof(double) * row.size()), 0) << member;
  }
}

}  // namespace dlcs::testing
