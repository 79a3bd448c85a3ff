// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

#include "client/cli/atomic_file.h"
#include "client/cli/interrupt.h"
#include "client/cli/job_commands.h"
#include "client/cli/job_support.h"
#include "client/cli/result_output.h"
#include "client/cli/run_support.h"

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
  for (v1::LeftLimit limit : chunk.left_limits()) {
    // Counted in what is printed.
    limit.set_index(at + (limit.index() - chunk.first()) / stride);
    result.left_limits.push_back(std::move(limit));
  }
}

// A few rows, evenly spaced, with the first and the last: for people.
void Thin(SolveResult& result) {
  const std::size_t times = result.times.size();
  if (times <= kTableRows) return;
  SolveResult few = result;
  few.times.clear();
  few.x.clear();
  few.y.clear();
  few.w.clear();
  for (std::size_t k = 0; k < kTableRows; ++k) {
    const std::size_t row = k * (times - 1) / (kTableRows - 1);
    few.times.push_back(result.times[row]);
    few.x.insert(few.x.end(), result.x_at(row).begin(), result.x_at(row).end());
    few.y.insert(few.y.end(), result.y_at(row).begin(), result.y_at(row).end());
    few.w.insert(few.w.end(), result.w_at(row).begin(), result.w_at(row).end());
  }
  result = std::move(few);
}

// The kept event that says what was found out before the first step.
absl::Status ReadAnalysis(JobClient& client, const std::string& name, const CallLimits& limits,
                          v1::Analysis& analysis) {
  v1::WatchSolveJobRequest request;
  request.set_name(name);
  request.set_view(v1::WATCH_VIEW_PROGRESS);
  return client.Watch(
      request,
      [&](const v1::JobEvent& event) {
        if (event.has_analysis()) analysis = event.analysis();
      },
      limits);
}

// A CSV goes to `out` as it comes, the rest into `result`.
absl::Status ReadPages(JobClient& client, const ResultCommand& command, const CallLimits& limits, std::FILE* out,
                       SolveResult& result) {
  v1::ReadTrajectoryRequest request;
  request.set_name(command.name);
  request.set_stride(command.stride);
  request.set_start_time(command.from);
  if (command.to) request.set_end_time(*command.to);
  bool has_header = false;
  return client.ReadTrajectory(
      request,
      [&](const v1::TrajectoryPage& page) {
        const v1::TrajectoryChunk& chunk = page.chunk();
        if (command.format != OutputFormat::kCsv) return Append(chunk, command.stride, result);
        if (chunk.times().empty()) return;
        const auto columns = [&](const auto& values) {
          return static_cast<std::size_t>(values.size() / chunk.times_size());
        };
        if (!std::exchange(has_header, true)) {
          PrintCsvHeader(result.names, columns(chunk.x()), columns(chunk.y()), !chunk.w().empty(), out);
        }
        PrintCsvLines(chunk, out);
      },
      limits);
}

}  // namespace

ExitCode Run(const ResultCommand& command) {
  std::unique_ptr<AtomicFile> output;
  if (!command.output.empty()) {
    auto created = AtomicFile::Create(command.output);
    if (!created.ok()) return Complain(created.status(), kBadInput);
    output = *std::move(created);
  }
  std::FILE* const out = output ? output->stream() : stdout;
  const Interrupt interrupt;
  const auto client = ConnectToJobs(command.target);
  if (!client.ok()) return Complain(client.status(), kBadInput);
  const CallLimits limits = LimitsFor(command.target, interrupt);

  const auto job = (*client)->Get(command.name, limits);
  if (!job.ok()) return Complain(job.status(), ExitCodeOf(job.status()));
  if (!HasEnded(job->state())) {
    return Complain(
        absl::FailedPreconditionError(fmt::format("{} is {}, {:.0f} % done: dlcs watch {} waits for it", job->name(),
                                                  JobStateWord(job->state()), 100 * job->progress(), job->name())),
        kServiceFailed);
  }
  SolveResult result;
  result.summary = job->summary();
  absl::Status read = ReadAnalysis(**client, command.name, limits, result.analysis);
  result.names = NamesIn(result.analysis);
  if (read.ok()) read = ReadPages(**client, command, limits, out, result);
  if (!read.ok()) return Complain(read, ExitCodeOf(read));
  if (command.format == OutputFormat::kJson) PrintJson(command.name, result, out);
  if (command.format == OutputFormat::kTable) {
    Thin(result);
    PrintTable(command.name, result, WidthOf(out), out);
  }
  const absl::Status written = output ? output->Commit() : FlushStream(stdout, "standard output");
  if (!written.ok()) return Complain(written, kServiceFailed);
  return ConcludeJob(*job);
}

}  // namespace dlcs::client
