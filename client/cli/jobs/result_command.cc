// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/commands/array_output.h"
#include "client/cli/commands/command_support.h"
#include "client/cli/commands/interrupt.h"
#include "client/cli/jobs/job_commands.h"
#include "client/cli/jobs/job_support.h"
#include "client/cli/output/atomic_file.h"
#include "client/cli/output/message_json.h"
#include "client/cli/output/result_output.h"
#include "client/cli/output/result_page.h"

namespace dlcs::client {
namespace {

constexpr std::size_t kTableRows = 11;

void Append(const v1::TrajectoryChunk& chunk, std::int64_t stride, SolveResult& result) {
  if (chunk.times().empty()) return;
  const auto at = static_cast<std::int64_t>(result.times.size());
  result.states = static_cast<std::size_t>(chunk.x_size() / chunk.times_size());
  result.constraints = static_cast<std::size_t>(chunk.y_size() / chunk.times_size());
  result.times.insert(result.times.end(), chunk.times().begin(), chunk.times().end());
  result.x.insert(result.x.end(), chunk.x().begin(), chunk.x().end());
  result.y.insert(result.y.end(), chunk.y().begin(), chunk.y().end());
  result.w.insert(result.w.end(), chunk.w().begin(), chunk.w().end());
  result.outputs.insert(result.outputs.end(), chunk.outputs().begin(), chunk.outputs().end());
  for (v1::LeftLimit limit : chunk.left_limits()) {
    // Counted in what is printed.
    limit.set_index(at + (limit.index() - chunk.first()) / stride);
    result.left_limits.push_back(std::move(limit));
  }
}

// Collects from the pages the stored times nearest to the requested ones, each once.
class Nearest {
 public:
  explicit Nearest(std::vector<double> asked) : asked_(std::move(asked)), found_(asked_.size()) {}

  void Add(const v1::TrajectoryChunk& chunk) {
    for (int k = 0; k < chunk.times_size(); ++k) {
      const double time = chunk.times(k);
      for (std::size_t i = 0; i < asked_.size(); ++i) {
        const bool nearer = !found_[i] || std::abs(time - asked_[i]) < std::abs(found_[i]->times(0) - asked_[i]);
        if (nearer) found_[i] = Column(chunk, k);
      }
    }
  }

  // In the order of time, as one trajectory from index 0 on.
  std::vector<v1::TrajectoryChunk> Take() {
    std::vector<v1::TrajectoryChunk> columns;
    for (std::size_t i = 0; i < asked_.size(); ++i) {
      if (!found_[i]) continue;
      const double time = found_[i]->times(0);
      if (time != asked_[i]) {
        fmt::print(stderr, "dlcs: --at {}: is not a stored time; the nearest is {}\n", asked_[i], time);
      }
      if (!columns.empty() && columns.back().times(0) == time) continue;
      v1::TrajectoryChunk& column = columns.emplace_back(*std::move(found_[i]));
      column.set_first(static_cast<std::int64_t>(columns.size()) - 1);
      for (v1::LeftLimit& limit : *column.mutable_left_limits()) limit.set_index(column.first());
    }
    return columns;
  }

 private:
  static v1::TrajectoryChunk Column(const v1::TrajectoryChunk& chunk, int k) {
    v1::TrajectoryChunk column;
    column.add_times(chunk.times(k));
    const auto copy = [&](const google::protobuf::RepeatedField<double>& from,
                          google::protobuf::RepeatedField<double>& to) {
      const int per_time = from.size() / chunk.times_size();
      to.Assign(from.begin() + k * per_time, from.begin() + (k + 1) * per_time);
    };
    copy(chunk.x(), *column.mutable_x());
    copy(chunk.y(), *column.mutable_y());
    copy(chunk.w(), *column.mutable_w());
    copy(chunk.outputs(), *column.mutable_outputs());
    for (const v1::LeftLimit& limit : chunk.left_limits()) {
      if (limit.index() == chunk.first() + k) *column.add_left_limits() = limit;
    }
    return column;
  }

  std::vector<double> asked_;
  std::vector<std::optional<v1::TrajectoryChunk>> found_;
};

// A few rows for a table, evenly spaced, with the first and the last.
void Thin(SolveResult& result) {
  const std::size_t times = result.times.size();
  if (times <= kTableRows) return;
  SolveResult few = result;
  few.times.clear();
  few.x.clear();
  few.y.clear();
  few.w.clear();
  few.outputs.clear();
  for (std::size_t k = 0; k < kTableRows; ++k) {
    const std::size_t row = k * (times - 1) / (kTableRows - 1);
    few.times.push_back(result.times[row]);
    few.x.insert(few.x.end(), result.x_at(row).begin(), result.x_at(row).end());
    few.y.insert(few.y.end(), result.y_at(row).begin(), result.y_at(row).end());
    few.w.insert(few.w.end(), result.w_at(row).begin(), result.w_at(row).end());
    few.outputs.insert(few.outputs.end(), result.outputs_at(row).begin(), result.outputs_at(row).end());
  }
  result = std::move(few);
}

// The event with the analysis.
absl::Status ReadAnalysis(const JobOnServer& job, v1::Analysis& analysis) {
  v1::WatchSolveJobRequest request;
  request.set_name(job.name);
  request.set_view(v1::WATCH_VIEW_PROGRESS);
  return job.jobs().Watch(
      request,
      [&](const v1::SolveEvent& event) {
        if (event.has_analysis()) analysis = event.analysis();
      },
      job.limits);
}

// Writes CSV to `out` as it arrives, and everything else into `result`.
absl::Status ReadPages(const JobOnServer& job, const ResultCommand& command, std::FILE* out, SolveResult& result) {
  v1::ReadTrajectoryRequest request;
  request.set_name(job.name);
  request.set_stride(command.stride);
  request.set_begin(command.from);
  if (command.to) request.set_end(*command.to);
  bool has_header = false;
  const auto take = [&](const v1::TrajectoryChunk& chunk, std::int64_t stride) {
    if (command.format != OutputFormat::kCsv) return Append(chunk, stride, result);
    if (chunk.times().empty()) return;
    const auto columns = [&](const auto& values) {
      return static_cast<std::size_t>(values.size() / chunk.times_size());
    };
    if (!std::exchange(has_header, true)) {
      PrintCsvHeader(result.names, columns(chunk.x()), columns(chunk.y()), !chunk.w().empty(), out);
    }
    PrintCsvLines(chunk, out);
  };
  Nearest nearest(command.at);
  const absl::Status read = job.jobs().ReadTrajectory(
      request,
      [&](const v1::TrajectoryPage& page) {
        command.at.empty() ? take(page.chunk(), command.stride) : nearest.Add(page.chunk());
      },
      job.limits);
  if (read.ok()) {
    for (const v1::TrajectoryChunk& column : nearest.Take()) take(column, 1);
  }
  return read;
}

}  // namespace

ExitCode Run(const ResultCommand& command) {
  const Interrupt interrupt;
  const auto found = ConnectToJob(command.target, command.name, interrupt);
  if (!found.ok()) return PrintError(found.status(), ExitCodeOf(found.status()));
  const auto job = found->jobs().Get(found->name, found->limits);
  if (!job.ok()) return PrintError(job.status(), ExitCodeOf(job.status()));
  if (job->has_ensemble()) return PrintEnsemble(found->jobs(), command, *job, found->limits);
  if (!HasEnded(job->state())) {
    return PrintError(
        absl::FailedPreconditionError(fmt::format("{} is {}, {:.0f} % done: dlcs watch {} waits for it", job->name(),
                                                  JobStateWord(job->state()), 100 * job->progress(), job->name())),
        kServiceFailed);
  }
  const auto output = OpenOutput(command.output);
  if (!output.ok()) return PrintError(output.status(), kBadInput);
  std::FILE* const out = *output ? (*output)->stream() : stdout;
  SolveResult result;
  result.summary = job->summary();
  absl::Status read = ReadAnalysis(*found, result.analysis);
  result.names = NamesIn(result.analysis);
  result.states = static_cast<std::size_t>(result.analysis.states());
  result.constraints = static_cast<std::size_t>(result.analysis.constraints());
  if (read.ok()) read = ReadPages(*found, command, out, result);
  if (!read.ok()) return PrintError(read, ExitCodeOf(read));
  const bool has_nothing = !job->has_summary() && result.times.empty();
  if (has_nothing && command.format != OutputFormat::kCsv) return ConcludeJob(*job);
  if (command.format == OutputFormat::kJson) PrintJson(TitleOf(*job), result, out);
  if (command.format == OutputFormat::kTable) {
    if (command.at.empty()) Thin(result);
    PrintPage(TitleOf(*job), result, out);
  }
  if (*output && IsOfArrays(command.format)) {
    const absl::Status status = WriteArrays(command.format, TitleOf(*job), result, out);
    if (!status.ok()) return PrintError(WithFile(status, (*output)->path()), kServiceFailed);
  }
  const absl::Status written = *output ? (*output)->Commit() : FlushStream(stdout, "standard output");
  if (!written.ok()) return PrintError(written, kServiceFailed);
  return ConcludeJob(*job);
}

}  // namespace dlcs::client
