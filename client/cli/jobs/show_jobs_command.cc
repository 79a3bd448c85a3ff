// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/commands/command_support.h"
#include "client/cli/commands/interrupt.h"
#include "client/cli/jobs/job_commands.h"
#include "client/cli/jobs/job_support.h"
#include "client/cli/options/solve_option_table.h"
#include "client/cli/output/atomic_file.h"
#include "client/cli/output/ensemble_output.h"
#include "client/cli/output/message_json.h"
#include "client/cli/terminal/terminal.h"
#include "client/cli/terminal/words.h"
#include "client/cli/terminal/wrapped_text.h"
#include "client/result/names.h"
#include "proto/shared/truncate_text.h"

namespace dlcs::client {
namespace {

// Prints rows below their headers, each column as wide as its widest cell. The column TITLE is cut if the line would be
// too long.
void PrintRows(const std::vector<std::vector<std::string>>& rows) {
  const auto width_of = [&rows](std::size_t column) {
    std::size_t width = 0;
    for (const auto& row : rows) width = std::max(width, LetterCount(row[column]));
    return width;
  };
  const std::size_t columns = rows.front().size();
  std::vector<std::size_t> widths(columns);
  std::size_t total = 2 * (columns - 1);
  for (std::size_t i = 0; i < columns; ++i) total += widths[i] = width_of(i);
  const auto title = std::find(rows.front().begin(), rows.front().end(), "TITLE") - rows.front().begin();
  const auto room = static_cast<std::size_t>(std::max(WidthOf(stdout), 60));
  constexpr std::size_t kShortestTitle = 8;
  std::size_t& of_title = widths[static_cast<std::size_t>(title)];
  if (total > room)
    of_title = std::max(std::min(of_title, kShortestTitle), of_title - std::min(of_title, total - room));
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < columns; ++i) {
      const bool is_title = static_cast<std::ptrdiff_t>(i) == title;
      const std::string cell = is_title && LetterCount(row[i]) > widths[i] ? TruncateUtf8(row[i], widths[i]) : row[i];
      line += i + 1 < columns ? Padded(cell, widths[i] + 2) : cell;
    }
    fmt::print("{}\n", line);
  }
}

// How the job ended, in a word or two: "SOLVED", "reached T", "inaccurate", "INFEASIBLE"; "2 failed" of an ensemble.
std::string VerdictCell(const v1::SolveJob& job) {
  if (const auto failed = job.ensemble().counts().failed(); failed > 0) return fmt::format("{} failed", failed);
  if (!job.has_summary()) return "-";
  const v1::Summary& summary = job.summary();
  if (summary.termination() != v1::TERMINATION_REACHED_END) return VerdictText(summary);
  if (!Succeeded(summary)) return "inaccurate";
  return summary.verdict().kind() == v1::VERDICT_KIND_SOLVED ? "SOLVED" : "reached T";
}

void PrintTable(const std::vector<v1::SolveJob>& jobs) {
  if (jobs.empty()) return;
  const bool owners = std::ranges::any_of(jobs, [](const v1::SolveJob& job) { return !job.owner().empty(); });
  std::vector<std::vector<std::string>> rows = {{"NAME", "TITLE", "STATE", "VERDICT", "PROGRESS", "AGE", "METHOD"}};
  if (owners) rows.front().push_back("OWNER");
  for (const v1::SolveJob& job : jobs) {
    rows.push_back({job.name(), job.title().empty() ? "-" : WithoutControlCharacters(job.title()),
                    JobStateWord(job.state()), VerdictCell(job), fmt::format("{:.0f} %", 100 * job.progress()),
                    AgeText(job.create_time()), job.has_options() ? Word(job.options().method()) : "-"});
    if (owners) rows.back().push_back(job.owner());
  }
  PrintRows(rows);
}

// The options as typed on a command line: "--method time-stepping --steps 100".
std::string OptionsText(const v1::SolveOptions& options) {
  const std::vector<std::string> words = AsTyped(options, "");
  return words.empty() ? "none" : fmt::format("{}", fmt::join(words, " "));
}

void PrintWhole(const v1::SolveJob& job) {
  fmt::print("{}\n", job.name());
  if (!job.title().empty()) fmt::print("  title      {}\n", WithoutControlCharacters(job.title()));
  if (job.states() > 0) {
    fmt::print("  system     {}{}, {}, T = {:g}\n", job.nonlinear() ? "nonlinear, " : "", Count(job.states(), "state"),
               Count(job.constraints(), "pair"), job.horizon());
  }
  if (!job.problem_name().empty()) fmt::print("  problem    {}\n", job.problem_name());
  if (job.has_options()) fmt::print("  options    {}\n", OptionsText(job.options()));
  if (!job.owner().empty()) fmt::print("  owner      {}\n", job.owner());
  fmt::print("  state      {}, {:.0f} % done\n", JobStateWord(job.state()), 100 * job.progress());
  if (!job.waiting_for().empty()) fmt::print("  waits for  {}\n", WithoutControlCharacters(job.waiting_for()));
  if (job.has_ensemble()) {
    const v1::EnsembleProgress& ensemble = job.ensemble();
    fmt::print("  members    {}, in {} of up to {}, {} done\n", ensemble.members(), Count(ensemble.shards(), "shard"),
               ensemble.shard_members(), ensemble.shards_done());
    if (ensemble.shards_done() > 0) fmt::print("  outcomes   {}\n", CountText(ensemble.counts()));
  }
  fmt::print("  submitted  {}, {} ago\n", TimeText(job.create_time()), AgeText(job.create_time()));
  fmt::print("  started    {}\n", TimeText(job.start_time()));
  fmt::print("  ended      {}\n", TimeText(job.end_time()));
  if (job.has_deadline()) fmt::print("  deadline   {}\n", TimeText(job.deadline()));
  if (job.priority() != 0) fmt::print("  priority   {}\n", job.priority());
  fmt::print("  predicted  {:.3g} core-seconds, {:.3g} MB\n", job.predicted_core_seconds(),
             1e-6 * static_cast<double>(job.predicted_memory_bytes()));
  if (job.attempts() > 1) fmt::print("  attempts   {} since the last progress\n", job.attempts());
  fmt::print("  stored     {} bytes, {} events\n", job.stored_bytes(), job.last_sequence());
  if (job.has_error()) fmt::print("  error      {}\n", job.error().message());
  if (!job.has_summary()) return;
  fmt::print("  verdict    {}: {}\n", VerdictText(job.summary()), job.summary().message());
  for (const std::string& warning : job.summary().warnings()) fmt::print("  warning    {}\n", warning);
}

void PrintTable(const std::vector<v1::StoredProblem>& problems) {
  if (problems.empty()) return;
  std::vector<std::vector<std::string>> rows = {{"NAME", "TITLE", "BYTES", "AGE"}};
  for (const v1::StoredProblem& problem : problems) {
    rows.push_back({problem.name(), problem.title().empty() ? "-" : WithoutControlCharacters(problem.title()),
                    fmt::format("{}", problem.bytes()), AgeText(problem.create_time())});
  }
  PrintRows(rows);
}

template <typename Message>
void Print(const std::vector<Message>& messages, OutputFormat format) {
  if (format == OutputFormat::kTable) return PrintTable(messages);
  for (const Message& message : messages) {
    fmt::print("{}\n", format == OutputFormat::kName ? message.name() : JsonLine(message));
  }
}

void PrintWhole(const v1::StoredProblem& problem) {
  fmt::print("{}\n", problem.name());
  if (!problem.title().empty()) fmt::print("  title      {}\n", WithoutControlCharacters(problem.title()));
  fmt::print("  system     {}{}, {}, T = {:g}\n", problem.nonlinear() ? "nonlinear, " : "",
             Count(problem.states(), "state"), Count(problem.constraints(), "pair"), problem.horizon());
  fmt::print("  stored     {} bytes\n", problem.bytes());
  fmt::print("  uploaded   {}\n", TimeText(problem.create_time()));
  fmt::print("  expires    {}, unless it is used before\n", TimeText(problem.expire_time()));
}

ExitCode Printed() {
  const absl::Status printed = FlushStream(stdout, "standard output");
  return printed.ok() ? kSolved : PrintError(printed, kServiceFailed);
}

// One of them in full.
template <typename Message>
ExitCode PrintOne(const absl::StatusOr<Message>& message, OutputFormat format) {
  if (!message.ok()) return PrintError(message.status(), ExitCodeOf(message.status()));
  format == OutputFormat::kTable ? PrintWhole(*message) : Print(std::vector{*message}, format);
  return Printed();
}

ExitCode ShowProblem(const ShowJobsCommand& command, const CallLimits& limits) {
  const auto client = Connect(command.target);
  if (!client.ok()) return PrintError(client.status(), kBadInput);
  const auto name = FindProblem((*client)->problems(), command.name, limits);
  if (!name.ok()) return PrintError(name.status(), ExitCodeOf(name.status()));
  return PrintOne((*client)->problems().Get(*name, limits), command.format);
}

ExitCode DeleteProblem(const EndJobCommand& command, const CallLimits& limits) {
  const auto client = Connect(command.target);
  if (!client.ok()) return PrintError(client.status(), kBadInput);
  const auto name = FindProblem((*client)->problems(), command.name, limits);
  const absl::Status deleted = name.ok() ? (*client)->problems().Delete(*name, limits) : name.status();
  return deleted.ok() ? kSolved : PrintError(deleted, ExitCodeOf(deleted));
}

// Deletes every job that has ended and is in one of the given states.
ExitCode DeleteJobs(const EndJobCommand& command, const CallLimits& limits) {
  const auto client = Connect(command.target);
  if (!client.ok()) return PrintError(client.status(), kBadInput);
  std::vector<v1::JobState> states = command.states;
  std::erase_if(states, [](v1::JobState state) { return !HasEnded(state); });
  if (states.empty() && !command.states.empty()) {
    return PrintError(
        absl::InvalidArgumentError("--state: only jobs that have ended can be deleted: succeeded, failed, cancelled"),
        kBadInput);
  }
  if (states.empty()) states = {v1::JOB_STATE_SUCCEEDED, v1::JOB_STATE_FAILED, v1::JOB_STATE_CANCELLED};
  const auto jobs = (*client)->jobs().List(states, kAllJobs, limits);
  if (!jobs.ok()) return PrintError(jobs.status(), ExitCodeOf(jobs.status()));
  std::int64_t deleted = 0;
  for (const v1::SolveJob& job : *jobs) {
    const absl::Status status = (*client)->jobs().Delete(job.name(), limits);
    if (!status.ok() && !absl::IsNotFound(status)) return PrintError(status, ExitCodeOf(status));
    ++deleted;
  }
  fmt::print(stderr, "dlcs: deleted {}\n", Count(deleted, "job"));
  return kSolved;
}

}  // namespace

ExitCode Run(const ListProblemsCommand& command) {
  const Interrupt interrupt;
  const auto client = Connect(command.target);
  if (!client.ok()) return PrintError(client.status(), kBadInput);
  const auto problems = (*client)->problems().List(LimitsFor(command.target, interrupt));
  if (!problems.ok()) return PrintError(problems.status(), ExitCodeOf(problems.status()));
  Print(*problems, command.format);
  return Printed();
}

ExitCode Run(const ShowJobsCommand& command) {
  const Interrupt interrupt;
  if (command.name.starts_with("problems/")) return ShowProblem(command, LimitsFor(command.target, interrupt));
  if (!command.name.empty()) {
    const auto found = ConnectToJob(command.target, command.name, interrupt);
    if (!found.ok()) return PrintError(found.status(), ExitCodeOf(found.status()));
    return PrintOne(found->jobs().Get(found->name, found->limits), command.format);
  }
  const auto client = Connect(command.target);
  if (!client.ok()) return PrintError(client.status(), kBadInput);
  const CallLimits limits = LimitsFor(command.target, interrupt);
  const auto jobs = (*client)->jobs().List(command.states, static_cast<std::size_t>(command.most), limits);
  if (!jobs.ok()) return PrintError(jobs.status(), ExitCodeOf(jobs.status()));
  Print(*jobs, command.format);
  return Printed();
}

ExitCode Run(const EndJobCommand& command) {
  const Interrupt interrupt;
  if (command.deletes && command.name.starts_with("problems/")) {
    return DeleteProblem(command, LimitsFor(command.target, interrupt));
  }
  if (command.all) return DeleteJobs(command, LimitsFor(command.target, interrupt));
  const auto found = ConnectToJob(command.target, command.name, interrupt);
  if (!found.ok()) return PrintError(found.status(), ExitCodeOf(found.status()));
  if (command.deletes) {
    const absl::Status deleted = found->jobs().Delete(found->name, found->limits);
    return deleted.ok() ? kSolved : PrintError(deleted, ExitCodeOf(deleted));
  }
  const auto job = found->jobs().Cancel(found->name, found->limits);
  if (!job.ok()) return PrintError(job.status(), ExitCodeOf(job.status()));
  const bool ended_before = job->state() == v1::JOB_STATE_SUCCEEDED || job->state() == v1::JOB_STATE_FAILED;
  fmt::print(stderr, "dlcs: {} {}\n", job->name(),
             ended_before
                 ? fmt::format("has {} already: there is nothing to cancel", JobStateWord(job->state()))
                 : fmt::format("is {}", job->state() == v1::JOB_STATE_CANCELLING ? "being cancelled" : "cancelled"));
  return kSolved;
}

}  // namespace dlcs::client
