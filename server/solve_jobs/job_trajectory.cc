// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/job_trajectory.h"

#include <algorithm>
#include <charconv>
#include <iterator>
#include <utility>
#include <vector>

#include "fmt/format.h"
#include "proto/wire/trajectory_crc.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

// A quarter of what receivers accept by default, with room for the other fields.
constexpr Index kMaxChunkDoubles = (1'000'000 - 1'000) / sizeof(double);
constexpr std::int64_t kReadAheadBytes = 4'000'000;

using Values = google::protobuf::RepeatedField<double>;

absl::Status Damaged(const jobs::JobId& id, std::int64_t part) {
  return absl::DataLossError(fmt::format("Part {} of the trajectory of job {} cannot be read.", part, id));
}

bool Parse(const jobs::Chunk& part, v1::TrajectoryChunk& chunk) {
  if (!chunk.ParseFromString(part.data)) return false;
  const int times = chunk.times_size();
  // A part that an earlier version stored holds no w.
  const bool w_fits = chunk.w_size() == chunk.y_size() || chunk.w_size() == 0;
  const auto fits = [times](const Values& values) { return times > 0 ? values.size() % times == 0 : values.empty(); };
  return w_fits && fits(chunk.x()) && fits(chunk.y()) && fits(chunk.outputs());
}

// Appends components `wanted` (all where it is empty) of `size` values from `source` on.
void Take(const double* source, int size, const google::protobuf::RepeatedField<std::int32_t>& wanted, Values& out) {
  if (wanted.empty()) out.Add(source, source + size);
  for (const int component : wanted) out.Add(source[component]);
}

absl::Status CheckComponents(const char* field, const google::protobuf::RepeatedField<std::int32_t>& wanted, int size) {
  for (int k = 0; k < wanted.size(); ++k) {
    if (wanted[k] >= 0 && wanted[k] < size) continue;
    return InvalidRequest(
        {{fmt::format("{}[{}]", field, k), fmt::format("{}; must be between 0 and {}", wanted[k], size - 1)}});
  }
  return absl::OkStatus();
}

}  // namespace

Index MostTimesInChunk(Index states, Index constraints, Index outputs) {
  return std::max<Index>(kMaxChunkDoubles / (1 + states + 2 * constraints + outputs), 1);
}

absl::StatusOr<StoredTrajectory> ReadStoredTrajectory(jobs::JobStore& store, const jobs::JobId& id, std::int64_t parts,
                                                      Index states, Index constraints) {
  std::vector<double> x, y, w;
  Index times = 0;
  for (std::int64_t part = 0; part < parts;) {
    const auto chunks = store.ReadChunks(id, part, kReadAheadBytes);
    if (!chunks.ok()) return chunks.status();
    if (chunks->empty()) return Damaged(id, part);
    for (const jobs::Chunk& stored : *chunks) {
      if (part == parts) break;
      v1::TrajectoryChunk chunk;
      const bool fits = Parse(stored, chunk) && chunk.first() == times &&
                        chunk.x_size() == chunk.times_size() * states &&
                        chunk.y_size() == chunk.times_size() * constraints && chunk.w_size() == chunk.y_size();
      if (!fits) return Damaged(id, part);
      times += chunk.times_size();
      x.insert(x.end(), chunk.x().begin(), chunk.x().end());
      y.insert(y.end(), chunk.y().begin(), chunk.y().end());
      w.insert(w.end(), chunk.w().begin(), chunk.w().end());
      ++part;
    }
  }
  return StoredTrajectory{Eigen::Map<const Matrix>(x.data(), states, times),
                          Eigen::Map<const Matrix>(y.data(), constraints, times),
                          Eigen::Map<const Matrix>(w.data(), constraints, times)};
}

absl::StatusOr<TrajectoryReader> TrajectoryReader::Create(jobs::JobStore& store, std::optional<std::string> owner,
                                                          const jobs::JobId& id,
                                                          const v1::ReadTrajectoryRequest& request) {
  TrajectoryReader reader(store, std::move(owner), id, request);
  if (request.stride() < 0)
    return InvalidRequest({{"stride", fmt::format("{}; must not be negative", request.stride())}});
  const std::string& token = request.resume_token();
  if (token.empty()) return reader;
  const auto [stop, error] = std::from_chars(token.data(), token.data() + token.size(), reader.next_part_);
  if (error != std::errc() || stop != token.data() + token.size() || reader.next_part_ < 0) {
    return InvalidRequest({{"resume_token", fmt::format("{}; is not the token of a page", Quoted(token))}});
  }
  return reader;
}

absl::StatusOr<v1::TrajectoryChunk> TrajectoryReader::Select(const v1::TrajectoryChunk& chunk) const {
  v1::TrajectoryChunk selected;
  if (chunk.times().empty()) return selected;
  const int m = chunk.x_size() / chunk.times_size(), n = chunk.y_size() / chunk.times_size(),
            p = chunk.outputs_size() / chunk.times_size();
  if (absl::Status status = CheckComponents("x_components", request_.x_components(), m); !status.ok()) return status;
  if (absl::Status status = CheckComponents("y_components", request_.y_components(), n); !status.ok()) return status;
  if (absl::Status status = CheckComponents("output_components", request_.output_components(), p); !status.ok()) {
    return status;
  }
  const std::int64_t stride = std::max<std::int64_t>(request_.stride(), 1);
  const auto is_wanted = [&](std::int64_t index) {
    const double time = chunk.times(static_cast<int>(index - chunk.first()));
    const bool in_time = time >= request_.begin() && (!request_.has_end() || time <= request_.end());
    return in_time && index % stride == 0;
  };
  for (int k = 0; k < chunk.times_size(); ++k) {
    const std::int64_t index = chunk.first() + k;
    if (!is_wanted(index)) continue;
    if (selected.times().empty()) selected.set_first(index);
    selected.add_times(chunk.times(k));
    if (!request_.omit_x())
      Take(chunk.x().data() + std::ptrdiff_t{k} * m, m, request_.x_components(), *selected.mutable_x());
    if (!request_.omit_y())
      Take(chunk.y().data() + std::ptrdiff_t{k} * n, n, request_.y_components(), *selected.mutable_y());
    if (!request_.omit_w() && !chunk.w().empty())
      Take(chunk.w().data() + std::ptrdiff_t{k} * n, n, request_.y_components(), *selected.mutable_w());
    if (!request_.omit_outputs())
      Take(chunk.outputs().data() + std::ptrdiff_t{k} * p, p, request_.output_components(),
           *selected.mutable_outputs());
  }
  for (const v1::LeftLimit& limit : chunk.left_limits()) {
    const bool has_nothing = request_.omit_y() && request_.omit_w() && (request_.omit_outputs() || p == 0);
    if (has_nothing || !is_wanted(limit.index())) continue;
    v1::LeftLimit& kept = *selected.add_left_limits();
    kept.set_index(limit.index());
    if (!request_.omit_y()) Take(limit.y().data(), limit.y_size(), request_.y_components(), *kept.mutable_y());
    if (!request_.omit_w() && !limit.w().empty())
      Take(limit.w().data(), limit.w_size(), request_.y_components(), *kept.mutable_w());
    if (!request_.omit_outputs() && !limit.outputs().empty())
      Take(limit.outputs().data(), limit.outputs_size(), request_.output_components(), *kept.mutable_outputs());
  }
  return selected;
}

absl::StatusOr<std::optional<v1::TrajectoryPage>> TrajectoryReader::Next() {
  if (ended_) return std::optional<v1::TrajectoryPage>();
  for (;;) {
    v1::TrajectoryPage page;
    bool may_grow = false;
    if (read_.empty()) {
      // Read before the parts, so that a job that ends in between is not reported as complete too early.
      const absl::StatusOr<jobs::Job> job = store_->Get(owner_, id_);
      if (!job.ok()) return job.status();
      if (job->shards > 0) {
        return absl::FailedPreconditionError("The job is an ensemble: ReadEnsemble reads its results.");
      }
      may_grow = !jobs::IsFinal(job->state);
      auto chunks = store_->ReadChunks(id_, next_part_, kReadAheadBytes);
      if (!chunks.ok()) return chunks.status();
      read_.assign(std::make_move_iterator(chunks->begin()), std::make_move_iterator(chunks->end()));
    }
    if (read_.empty()) {
      page.set_resume_token(std::to_string(next_part_));
      page.set_crc32(TrajectoryCrc(page.chunk()));
      page.set_w_crc32(TrajectoryWCrc(page.chunk()));
      page.set_outputs_crc32(TrajectoryOutputsCrc(page.chunk()));
      page.set_complete(!may_grow);
      ended_ = true;
      return page;
    }
    v1::TrajectoryChunk chunk;
    if (!Parse(read_.front(), chunk)) return Damaged(id_, next_part_);
    read_.pop_front();
    ++next_part_;
    absl::StatusOr<v1::TrajectoryChunk> selected = Select(chunk);
    if (!selected.ok()) return selected.status();
    if (selected->times().empty()) continue;
    *page.mutable_chunk() = *std::move(selected);
    page.set_crc32(TrajectoryCrc(page.chunk()));
    page.set_w_crc32(TrajectoryWCrc(page.chunk()));
    page.set_outputs_crc32(TrajectoryOutputsCrc(page.chunk()));
    page.set_resume_token(std::to_string(next_part_));
    return page;
  }
}

}  // namespace dlcs
