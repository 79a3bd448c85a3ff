// SPDX-License-Identifier: Apache-2.0
// Requests about jobs: names, pages, tokens, parts of trajectories, times; with a real store that holds a few jobs.
#include <optional>
#include <string>

#include "dlcs/v1/jobs.pb.h"
#include "server/solve_jobs/convert_job.h"
#include "server/solve_jobs/job_trajectory.h"
#include "server/solve_jobs/resource_names.h"
#include "server/store/sqlite/sqlite_job_store.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/message_text.h"
#include "tests/server/store/job_samples.h"
#include "tests/server/store/temporary_folder.h"

namespace dlcs::fuzz {
namespace {

using jobs::JobId;

constexpr int kJobs = 5;
constexpr int kParts = 3;
constexpr int kTimesOfPart = 4;

// Two states and a pair, with y that jumps at the second time.
std::string ChunkOf(int part) {
  v1::TrajectoryChunk chunk;
  chunk.set_first(part * kTimesOfPart);
  for (int k = 0; k < kTimesOfPart; ++k) {
    const double time = part * kTimesOfPart + k;
    chunk.add_times(time);
    for (const double value : {time, -time}) chunk.add_x(value);
    chunk.add_y(2 * time);
    chunk.add_w(3 * time);
  }
  v1::LeftLimit& limit = *chunk.add_left_limits();
  limit.set_index(chunk.first() + 1);
  limit.add_y(-1);
  limit.add_w(-2);
  return chunk.SerializeAsString();
}

// Jobs of two owners; the first has run and has a trajectory.
class Store {
 public:
  Store() {
    for (int k = 0; k < kJobs; ++k) {
      const auto created = store.Create(jobs::testing::SampleJob(k % 2 == 0 ? "" : "ada"));
      Require(created.ok(), "the store takes jobs");
      if (k == 0) first = created->job.id;
    }
    const auto claimed = store.Claim("worker", std::chrono::hours(1), std::span(&first, 1));
    Require(claimed.ok() && claimed->has_value(), "and hands them out");
    for (int part = 0; part < kParts; ++part) {
      jobs::Progress progress = jobs::testing::SampleWindow(part, part + 3);
      progress.reserve_through = part + 3;
      progress.chunks[0].data = ChunkOf(part);
      Require(store.Append((*claimed)->lease, progress).ok(), "and takes parts");
    }
  }

 private:
  jobs::testing::TemporaryFolder folder_;

 public:
  jobs::SqliteJobStore store{{.path = folder_.File("jobs.db")}, jobs::SystemClock()};
  JobId first;
};

void RequireRefused(const absl::Status& status) {
  const bool refused = absl::IsInvalidArgument(status) || absl::IsNotFound(status);
  Require(status.ok() || refused, "what a client says is never a fault of the store");
}

void TryList(jobs::JobStore& store, const v1::ListSolveJobsRequest& request) {
  jobs::JobFilter filter;
  for (const int state : request.states()) {
    const auto known = FromProto(static_cast<v1::JobState>(state));
    if (known) filter.states.push_back(*known);
  }
  const auto page = store.List(filter, request.page_size(), request.page_token());
  if (!page.ok()) return RequireRefused(page.status());
  Require(static_cast<int>(page->jobs.size()) <= request.page_size(), "a page is no longer than asked for");
  if (page->next_page_token.empty()) return;
  Require(store.List(filter, request.page_size(), page->next_page_token).ok(), "a page's token is taken");
}

// The job that has a trajectory, whatever the request says: names are tried by themselves.
void TryRead(jobs::JobStore& store, const JobId& id, const v1::ReadTrajectoryRequest& request) {
  RequireRefused(JobIdOf(request.name()).status());
  auto reader = TrajectoryReader::Create(store, std::nullopt, id, request);
  if (!reader.ok()) return RequireRefused(reader.status());
  for (int pages = 0; pages <= kParts + 1; ++pages) {
    const auto page = reader->Next();
    if (!page.ok()) return RequireRefused(page.status());
    if (!page->has_value()) return;
    v1::ReadTrajectoryRequest rest = request;
    rest.set_resume_token((*page)->resume_token());
    Require(TrajectoryReader::Create(store, std::nullopt, id, rest).ok(), "a page's token is taken");
  }
  Require(false, "a trajectory ends");
}

// Times survive the conversion in both directions if they are in the range of timestamps.
void TryTime(const google::protobuf::Timestamp& time) {
  const jobs::Time read = FromProto(time);
  const bool in_range =
      time.seconds() >= 0 && time.seconds() < 253'402'300'800 && time.nanos() >= 0 && time.nanos() < 1'000'000'000;
  if (in_range) Require(ToProto(read).seconds() == time.seconds(), "a time is kept to the microsecond");
}

}  // namespace

void TryJobRequest(const std::string& input) {
  static Store held;
  const auto message = MessageOf(input);
  if (const auto* list = dynamic_cast<const v1::ListSolveJobsRequest*>(message.get())) TryList(held.store, *list);
  if (const auto* read = dynamic_cast<const v1::ReadTrajectoryRequest*>(message.get()))
    TryRead(held.store, held.first, *read);
  if (const auto* get = dynamic_cast<const v1::GetSolveJobRequest*>(message.get())) {
    const absl::StatusOr<JobId> id = JobIdOf(get->name());
    RequireRefused(id.ok() ? held.store.Get(std::nullopt, *id).status() : id.status());
  }
  if (const auto* create = dynamic_cast<const v1::CreateSolveJobRequest*>(message.get())) TryTime(create->deadline());
}

}  // namespace dlcs::fuzz
