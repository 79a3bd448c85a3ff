// SPDX-License-Identifier: Apache-2.0
#include "tests/server/solve_jobs/job_runs.h"

#include <gtest/gtest.h>

#include <cstring>

#include "server/session/solve_session.h"

namespace dlcs::testing {
namespace {

void Append(const v1::TrajectoryChunk& chunk, Trajectory& all) {
  all.times.insert(all.times.end(), chunk.times().begin(), chunk.times().end());
  all.x.insert(all.x.end(), chunk.x().begin(), chunk.x().end());
  all.y.insert(all.y.end(), chunk.y().begin(), chunk.y().end());
  all.w.insert(all.w.end(), chunk.w().begin(), chunk.w().end());
}

bool SameBits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

class ChunkSink final : public SolveSink {
 public:
  void Accept(v1::SolveEvent event) override {
    if (event.has_trajectory()) Append(event.trajectory(), all);
  }
  Trajectory all;
};

}  // namespace

Trajectory ReadAll(client::JobClient& client, const std::string& name) {
  v1::ReadTrajectoryRequest request;
  request.set_name(name);
  Trajectory all;
  bool complete = false;
  const absl::Status status =
      client.ReadTrajectory(request,
                            [&](const v1::TrajectoryPage& page) {
                              if (page.chunk().times_size() > 0) {
                                EXPECT_EQ(page.chunk().first(), static_cast<std::int64_t>(all.times.size()));
                              }
                              Append(page.chunk(), all);
                              complete = page.complete();
                            },
                            {});
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_TRUE(complete);
  return all;
}

Trajectory SolveHere(const v1::SolveRequest& request) {
  ChunkSink sink;
  SolveControl control;
  const absl::Status status = RunSolveToEnd(request, SessionLimits(), "here", control, sink);
  EXPECT_TRUE(status.ok()) << status;
  return std::move(sink.all);
}

void ExpectSameTrajectory(const Trajectory& found, const Trajectory& expected) {
  EXPECT_EQ(found.times.size(), expected.times.size());
  EXPECT_TRUE(SameBits(found.times, expected.times));
  EXPECT_TRUE(SameBits(found.x, expected.x));
  EXPECT_TRUE(SameBits(found.y, expected.y));
  EXPECT_TRUE(SameBits(found.w, expected.w));
}

}  // namespace dlcs::testing
