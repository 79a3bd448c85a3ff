// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/ensemble_results.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <utility>

#include "core/problem/verdict.h"
#include "fmt/format.h"
#include "proto/shared/truncate_text.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

using Column = v1::EnsembleColumn;
using Components = google::protobuf::RepeatedField<std::int32_t>;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMaxFailures = 10;
constexpr std::size_t kMaxFailureBytes = 300;
constexpr std::int64_t kReadAheadBytesOfShards = 4'000'000;

Column ColumnOf(Column::Quantity quantity, Index component, Column::Statistic statistic, std::string name) {
  Column column;
  column.set_quantity(quantity);
  column.set_component(static_cast<std::int32_t>(component));
  column.set_statistic(statistic);
  column.set_name(std::move(name));
  return column;
}

// Makes the columns of one quantity after another.
class ColumnMaker {
 public:
  explicit ColumnMaker(bool extrema) : extrema_(extrema) {}

  // Components `wanted` (all where it is empty) of a quantity with `size`.
  void Add(Column::Quantity quantity, const char* field, const Components& wanted, Index size,
           const std::vector<std::string>& names) {
    std::vector<Index> components(wanted.begin(), wanted.end());
    for (Index i = 0; wanted.empty() && i < size; ++i) components.push_back(i);
    for (std::size_t k = 0; k < components.size(); ++k) {
      const Index i = components[k];
      if (i < 0 || i >= size) {
        violations_.push_back(
            {fmt::format("results.{}[{}]", field, k), fmt::format("{}; must be between 0 and {}", i, size - 1)});
        continue;
      }
      if (const std::span before(components.data(), k); std::ranges::find(before, i) != before.end()) {
        violations_.push_back({fmt::format("results.{}[{}]", field, k), fmt::format("{}; is there already", i)});
        continue;
      }
      const std::string name = i < static_cast<Index>(names.size()) ? names[static_cast<std::size_t>(i)] : "";
      columns_.push_back(ColumnOf(quantity, i, Column::STATISTIC_FINAL, name));
      if (!extrema_) continue;
      columns_.push_back(ColumnOf(quantity, i, Column::STATISTIC_SMALLEST, name));
      columns_.push_back(ColumnOf(quantity, i, Column::STATISTIC_LARGEST, name));
    }
  }

  // Refuses components of what is not kept.
  void Refuse(const char* field, const Components& wanted, const char* omitted) {
    if (wanted.empty()) return;
    violations_.push_back({fmt::format("results.{}", field), fmt::format("must be empty with {}", omitted)});
  }

  absl::StatusOr<std::vector<Column>> Take() && {
    if (!violations_.empty()) return InvalidRequest(violations_);
    return std::move(columns_);
  }

 private:
  const bool extrema_;
  std::vector<Column> columns_ = {ColumnOf(Column::QUANTITY_TIME, 0, Column::STATISTIC_FINAL, ""),
                                  ColumnOf(Column::QUANTITY_ERROR, 0, Column::STATISTIC_FINAL, "")};
  std::vector<Violation> violations_;
};

// The values of one quantity in a chunk, time after time; null for those that have no components.
template <typename Chunk>
const google::protobuf::RepeatedField<double>* ValuesIn(const Chunk& chunk, Column::Quantity quantity) {
  if constexpr (requires { chunk.x(); }) {
    if (quantity == Column::QUANTITY_X) return &chunk.x();
  }
  switch (quantity) {
    case Column::QUANTITY_Y:
      return &chunk.y();
    case Column::QUANTITY_W:
      return &chunk.w();
    case Column::QUANTITY_OUTPUT:
      return &chunk.outputs();
    default:
      return nullptr;
  }
}

// The value of a component of x, y, w or an output. `chunk` ends at the time reached, and is all of the trajectory for
// the extrema.
double ValueOf(const Column& column, const v1::TrajectoryChunk& chunk) {
  const auto* values = ValuesIn(chunk, column.quantity());
  const int times = chunk.times_size();
  if (values == nullptr || values->empty() || times == 0) return kNaN;
  const int size = values->size() / times;
  const auto at = [&](int k) { return values->Get(k * size + column.component()); };
  double value = at(times - 1);
  if (column.statistic() == Column::STATISTIC_FINAL) return value;
  const bool smallest = column.statistic() == Column::STATISTIC_SMALLEST;
  const auto take = [&](double other) { value = smallest ? std::min(value, other) : std::max(value, other); };
  for (int k = 0; k < times - 1; ++k) take(at(k));
  for (const v1::LeftLimit& limit : chunk.left_limits()) {
    const auto* left = ValuesIn(limit, column.quantity());
    if (left != nullptr && column.component() < left->size()) take(left->Get(column.component()));
  }
  return value;
}

v1::MemberOutcome OutcomeOf(const Verdict& verdict) {
  if (verdict.kind == VerdictKind::kSolved) return v1::MEMBER_OUTCOME_SOLVED;
  return verdict.success ? v1::MEMBER_OUTCOME_REACHED : v1::MEMBER_OUTCOME_FAILED;
}

// A token names its job, since the token of another job would skip shards.
std::string TokenBegin(const jobs::JobId& id) { return fmt::format("{}:", id); }

void AddCounts(const v1::EnsembleCounts& part, v1::EnsembleCounts& sum) {
  sum.set_solved(sum.solved() + part.solved());
  sum.set_reached(sum.reached() + part.reached());
  sum.set_failed(sum.failed() + part.failed());
}

}  // namespace

absl::StatusOr<std::vector<v1::EnsembleColumn>> ColumnsOf(const v1::KeptResults& kept, const Problem& base,
                                                          const ComponentNames& names) {
  ColumnMaker columns(kept.extrema());
  const Index n = base.num_constraints();
  if (kept.omit_x()) {
    columns.Refuse("x_components", kept.x_components(), "omit_x");
  } else {
    columns.Add(Column::QUANTITY_X, "x_components", kept.x_components(), base.num_states(), names.states);
  }
  if (kept.omit_y() && kept.omit_w()) columns.Refuse("y_components", kept.y_components(), "omit_y and omit_w");
  if (!kept.omit_y()) columns.Add(Column::QUANTITY_Y, "y_components", kept.y_components(), n, names.pairs);
  if (!kept.omit_w()) columns.Add(Column::QUANTITY_W, "y_components", kept.y_components(), n, names.pairs);
  if (!kept.omit_outputs()) columns.Add(Column::QUANTITY_OUTPUT, "", {}, base.outputs.shown(), names.outputs);
  return std::move(columns).Take();
}

std::int64_t MemberResultBytes(std::size_t columns) { return static_cast<std::int64_t>(sizeof(double) * columns) + 1; }

ShardResults::ShardResults(std::vector<v1::EnsembleColumn> columns, std::int64_t first, Index members)
    : columns_(std::move(columns)), keeps_extrema_(std::ranges::any_of(columns_, [](const Column& column) {
        return column.statistic() != Column::STATISTIC_FINAL;
      })) {
  shard_.set_first_member(first);
  shard_.mutable_outcomes()->Resize(static_cast<int>(members), v1::MEMBER_OUTCOME_UNSPECIFIED);
  shard_.mutable_values()->Resize(static_cast<int>(members * static_cast<Index>(columns_.size())), kNaN);
}

void ShardResults::Add(Index member, FinishedSolve solve) {
  const Solution& solution = solve.solution();
  const v1::MemberOutcome outcome = OutcomeOf(JudgeSolution(solution));
  shard_.set_outcomes(static_cast<int>(member), outcome);
  if (outcome == v1::MEMBER_OUTCOME_SOLVED) counts_.set_solved(counts_.solved() + 1);
  if (outcome == v1::MEMBER_OUTCOME_REACHED) counts_.set_reached(counts_.reached() + 1);
  if (outcome == v1::MEMBER_OUTCOME_FAILED) {
    counts_.set_failed(counts_.failed() + 1);
    v1::MemberFailure& failure = failures_[member];
    failure.set_member(shard_.first_member() + member);
    failure.set_termination(solve.termination());
    failure.set_message(TruncateUtf8(solution.message, kMaxFailureBytes));
    if (failures_.size() > kMaxFailures) failures_.erase(std::prev(failures_.end()));
  }
  const auto times = static_cast<Index>(solution.times.size());
  if (times == 0) return;
  const Index from = keeps_extrema_ ? 0 : times - 1;
  const v1::TrajectoryChunk chunk = ChunkToProto(solution, from, times - from, solve.outputs());
  double* value = ValuesOf(member);
  for (const Column& column : columns_) {
    switch (column.quantity()) {
      case Column::QUANTITY_TIME:
        *value++ = solution.times.back();
        break;
      case Column::QUANTITY_ERROR:
        *value++ = solution.accuracy.error;
        break;
      default:
        *value++ = ValueOf(column, chunk);
    }
  }
}

void ShardResults::SetEnd(Index member, FinishedSolve solve) {
  const Solution& solution = solve.solution();
  const auto times = static_cast<Index>(solution.times.size());
  if (times == 0) return;
  const v1::TrajectoryChunk last = ChunkToProto(solution, times - 1, 1, solve.outputs());
  double* value = ValuesOf(member);
  for (const Column& column : columns_) {
    double& kept = *value++;
    if (column.quantity() == Column::QUANTITY_TIME) {
      kept = solution.times.back();
    } else if (column.quantity() == Column::QUANTITY_ERROR) {
      kept = solution.accuracy.error;
    } else {
      const double at_end = ValueOf(column, last);
      // fmin and fmax take the number where the other is NaN.
      kept = column.statistic() == Column::STATISTIC_SMALLEST  ? std::fmin(kept, at_end)
             : column.statistic() == Column::STATISTIC_LARGEST ? std::fmax(kept, at_end)
                                                               : at_end;
    }
  }
}

jobs::ShardResult ShardResults::Take() && {
  for (auto& [member, failure] : failures_) shard_.add_failures()->Swap(&failure);
  const std::int64_t first = shard_.first_member();
  jobs::ShardResult result;
  result.begin = static_cast<double>(first);
  result.end = static_cast<double>(first + shard_.outcomes_size());
  result.data = shard_.SerializeAsString();
  result.count = [counts = std::move(counts_)](const jobs::Job& before) {
    v1::EnsembleCounts sum;
    sum.ParseFromString(before.tally);
    AddCounts(counts, sum);
    v1::SolveEvent event;
    event.mutable_checkpointed()->set_times(static_cast<std::int32_t>(sum.solved() + sum.reached() + sum.failed()));
    event.mutable_checkpointed()->set_progress(static_cast<double>(before.chunks + 1) /
                                               static_cast<double>(before.shards));
    return jobs::ShardResult::Count{.tally = sum.SerializeAsString(), .event = event.SerializeAsString()};
  };
  return result;
}

absl::StatusOr<EnsembleReader> EnsembleReader::Create(jobs::JobStore& store, std::optional<std::string> owner,
                                                      const jobs::JobId& id, const v1::ReadEnsembleRequest& request) {
  EnsembleReader reader(store, std::move(owner), id);
  const std::string& token = request.resume_token();
  if (token.empty()) return reader;
  const std::string begin = TokenBegin(reader.id_);
  const bool of_this_job = token.starts_with(begin);
  const char* const end = token.data() + token.size();
  const auto [stop, error] = std::from_chars(of_this_job ? token.data() + begin.size() : end, end, reader.next_);
  if (error != std::errc() || stop != end || reader.next_ < 0) {
    return InvalidRequest({{"resume_token", fmt::format("{}; is not the token of a page of this job", Quoted(token))}});
  }
  return reader;
}

v1::EnsemblePage EnsembleReader::EmptyPage() const {
  v1::EnsemblePage page;
  page.set_resume_token(TokenBegin(id_) + std::to_string(next_));
  return page;
}

absl::StatusOr<std::optional<v1::EnsemblePage>> EnsembleReader::Next() {
  bool has_ended = false;
  if (read_.empty()) {
    // Read before the shards, so that a job that ends in between is not reported as complete too early.
    const absl::StatusOr<jobs::Job> job = store_->Get(owner_, id_);
    if (!job.ok()) return job.status();
    if (job->shards == 0) {
      return absl::FailedPreconditionError("The job is a solve, not an ensemble: ReadTrajectory reads its results.");
    }
    has_ended = jobs::IsFinal(job->state);
    auto chunks = store_->ReadChunks(id_, next_, kReadAheadBytesOfShards);
    if (!chunks.ok()) return chunks.status();
    read_.assign(std::make_move_iterator(chunks->begin()), std::make_move_iterator(chunks->end()));
  }
  if (read_.empty()) {
    if (!has_ended) return std::optional<v1::EnsemblePage>();
    v1::EnsemblePage page = EmptyPage();
    page.set_complete(true);
    return page;
  }
  v1::EnsemblePage page;
  if (!page.mutable_shard()->ParseFromString(read_.front().data)) {
    return absl::DataLossError(fmt::format("Result {} of the ensemble {} cannot be read.", next_, id_));
  }
  read_.pop_front();
  ++next_;
  page.set_resume_token(TokenBegin(id_) + std::to_string(next_));
  return page;
}

}  // namespace dlcs
