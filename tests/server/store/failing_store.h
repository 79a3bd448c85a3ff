// SPDX-License-Identifier: Apache-2.0
// A store that a test can make fail.

#ifndef DLCS_TESTS_SERVER_STORE_FAILING_STORE_H_
#define DLCS_TESTS_SERVER_STORE_FAILING_STORE_H_

#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/store/job_store.h"

namespace dlcs::jobs::testing {

// Forwards all calls. While `broken`, writes fail as on a full disk.
class FailingStore final : public JobStore {
 public:
  explicit FailingStore(JobStore& store) : store_(store) {}
  std::atomic<bool> broken = false;
  // The response is lost: the write is done, and an error is returned.
  std::atomic<bool> answers_lost = false;

  absl::StatusOr<Created> Create(const NewJob& job) override {
    return Write<Created>([&] { return store_.Create(job); });
  }
  absl::StatusOr<std::optional<Job>> FindRequest(const std::string& owner, const std::string& request_id,
                                                 const std::string& body_hash) override {
    return store_.FindRequest(owner, request_id, body_hash);
  }
  absl::StatusOr<Job> Get(const std::optional<std::string>& owner, const JobId& id) override {
    return store_.Get(owner, id);
  }
  absl::StatusOr<JobPage> List(const JobFilter& filter, int page_size, const std::string& page_token) override {
    return store_.List(filter, page_size, page_token);
  }
  absl::StatusOr<Job> RequestCancel(const std::optional<std::string>& owner, const JobId& id) override {
    return Write<Job>([&] { return store_.RequestCancel(owner, id); });
  }
  absl::Status Delete(const std::optional<std::string>& owner, const JobId& id) override {
    return Write([&] { return store_.Delete(owner, id); });
  }
  std::atomic<bool> cannot_list = false;
  absl::StatusOr<std::vector<Job>> ListClaimable(int limit) override {
    if (cannot_list) return absl::UnavailableError("not reached");
    return store_.ListClaimable(limit);
  }
  absl::StatusOr<QueueDepth> MeasureQueue() override {
    if (cannot_list) return absl::UnavailableError("not reached");
    return store_.MeasureQueue();
  }
  absl::StatusOr<std::optional<ClaimedJob>> Claim(const std::string& worker, Duration lease,
                                                  std::span<const JobId> candidates) override {
    return Write<std::optional<ClaimedJob>>([&] { return store_.Claim(worker, lease, candidates); });
  }
  absl::StatusOr<int> ReleaseLeases(const std::string& worker) override {
    return Write<int>([&] { return store_.ReleaseLeases(worker); });
  }
  absl::StatusOr<bool> RenewLease(const Lease& lease, Duration duration) override {
    return Write<bool>([&] { return store_.RenewLease(lease, duration); });
  }
  absl::Status Append(const Lease& lease, const Progress& progress) override {
    return Write([&] { return store_.Append(lease, progress); });
  }
  // Called before a job is finished, and may block. Set it before a manager uses the store.
  std::function<void(const Lease& lease)> before_finish;
  absl::Status Finish(const Lease& lease, const Outcome& outcome) override {
    if (before_finish) before_finish(lease);
    return Write([&] { return store_.Finish(lease, outcome); });
  }
  absl::Status FinishShard(const Lease& lease, const ShardResult& result) override {
    return Write([&] { return store_.FinishShard(lease, result); });
  }
  absl::Status Release(const Lease& lease, std::int64_t through, bool in_vain) override {
    return Write([&] { return store_.Release(lease, through, in_vain); });
  }
  absl::StatusOr<std::vector<Event>> ReadEvents(const JobId& id, std::int64_t after, int limit) override {
    return store_.ReadEvents(id, after, limit);
  }
  absl::StatusOr<std::vector<Chunk>> ReadChunks(const JobId& id, std::int64_t from, std::int64_t max_bytes) override {
    return store_.ReadChunks(id, from, max_bytes);
  }
  absl::StatusOr<int> Expire(const Expiry& expiry) override {
    return Write<int>([&] { return store_.Expire(expiry); });
  }
  bool Healthy() const override { return !broken && store_.Healthy(); }
  absl::Status Probe() override {
    return Write([&] { return store_.Probe(); });
  }

 private:
  static absl::Status Full() { return absl::UnavailableError("full"); }
  template <typename Result, typename Body>
  absl::StatusOr<Result> Write(Body body) {
    if (broken) return Full();
    return body();
  }
  template <typename Body>
  absl::Status Write(Body body) {
    if (broken) return Full();
    const absl::Status status = body();
    return status.ok() && answers_lost ? absl::UnavailableError("answer lost") : status;
  }

  JobStore& store_;
};

}  // namespace dlcs::jobs::testing

#endif  // DLCS_TESTS_SERVER_STORE_FAILING_STORE_H_
