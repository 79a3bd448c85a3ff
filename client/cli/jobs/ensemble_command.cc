// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/match.h"
#include "client/cli/commands/command_support.h"
#include "client/cli/commands/interrupt.h"
#include "client/cli/commands/problem_input.h"
#include "client/cli/jobs/job_commands.h"
#include "client/cli/jobs/job_support.h"
#include "client/cli/output/atomic_file.h"
#include "client/cli/output/ensemble_output.h"
#include "client/cli/output/message_json.h"
#include "client/cli/terminal/live_view.h"
#include "client/cli/terminal/progress_ticker.h"
#include "client/cli/terminal/terminal.h"
#include "client/files/json_text.h"
#include "client/files/members_file.h"
#include "client/result/names.h"
#include "proto/shared/known_end.h"
#include "proto/shared/title_limit.h"
#include "proto/shared/truncate_text.h"

namespace dlcs::client {
namespace {

// Shows on standard error how many members have finished: a redrawn line on a terminal, lines from time to time in a
// log.
class MemberCount {
 public:
  MemberCount(std::int64_t members, bool quiet) : members_(members), quiet_(quiet), lines_(1, kPerSecondInLog) {
    lines_.Take(LineBudget::Clock::now());  // the first one is due after a while
    if (!quiet && CanRedraw(stderr))
      ticker_ = std::make_unique<Ticker>(stderr, WidthOf(stderr), [this](int) { return Text(); });
  }

  // From one thread at a time.
  void Add(const v1::Summary& summary) {
    ++finished_;
    if (!Succeeded(summary)) ++unsolved_;
    if (!quiet_ && !ticker_ && lines_.Take(LineBudget::Clock::now())) fmt::print(stderr, "dlcs: {}\n", Text());
  }

 private:
  static constexpr double kPerSecondInLog = 0.2;

  std::string Text() const {
    const std::string unsolved = unsolved_ > 0 ? fmt::format(", {} not solved", unsolved_.load()) : "";
    return fmt::format("{} of {} members{}", finished_.load(), members_, unsolved);
  }

  const std::int64_t members_;
  const bool quiet_;
  LineBudget lines_;
  std::atomic<std::int64_t> finished_ = 0;
  std::atomic<std::int64_t> unsolved_ = 0;
  std::unique_ptr<Ticker> ticker_;  // last: it uses the others
};

v1::SolveEnsembleRequest MakeRequest(const SolveCommand& command, const ProblemInput& input,
                                     const std::vector<v1::EnsembleMember>& members) {
  v1::SolveEnsembleRequest request = input.EnsembleRequest(command.options);
  request.mutable_members()->Add(members.begin(), members.end());
  // A table shows only the end of each member, so if all have the same end only that time is requested.
  const bool same_end =
      std::none_of(members.begin(), members.end(), [](const auto& member) { return member.has_horizon(); });
  const bool table = command.format == OutputFormat::kTable;
  const std::optional<double> end = KnownEnd(command.options, input.horizon());
  if (table && same_end && end && command.options.output_times().empty()) {
    request.mutable_options()->add_output_times(*end);
  }
  return request;
}

// Creates a job for the ensemble, and prints its name.
ExitCode Detach(const EnsembleCommand& command, const ProblemInput& input,
                const std::vector<v1::EnsembleMember>& members, const CallLimits& limits) {
  v1::CreateEnsembleJobRequest request;
  *request.mutable_ensemble() = input.EnsembleRequest(command.solve.options);
  request.mutable_ensemble()->mutable_members()->Add(members.begin(), members.end());
  if (command.has_deadline) *request.mutable_deadline() = FromNow(command.solve.deadline_s);
  if (!input.is_uploaded()) request.set_title(TruncateUtf8(input.title(), kMaxTitleBytes));
  const auto client = ConnectForJobs(command.solve.server);
  if (!client.ok()) return PrintError(client.status(), kBadInput);
  return SubmitEnsembleJob(command, **client, std::move(request), input.source(), limits);
}

ExitCode ExitCodeOfSummary(const v1::EnsembleSummary& summary) {
  if (summary.stopped() + summary.not_begun() > 0) return kServiceFailed;
  return summary.failed() > 0 ? kNoAnswer : kSolved;
}

}  // namespace

absl::StatusOr<std::unique_ptr<Client>> ConnectForJobs(const ServerTarget& server) {
  return Connect({.server = server.address.empty() ? ServerAt(kDefaultServer) : server});
}

double TimeToSubmit(double deadline_s) { return std::max(deadline_s, JobTarget().patience_s); }

ExitCode SubmitEnsembleJob(const EnsembleCommand& command, Client& client, v1::CreateEnsembleJobRequest request,
                           const std::string& source, const CallLimits& limits) {
  request.mutable_results()->set_extrema(command.extrema);
  const std::string members = command.members_path.empty() ? "" : SourceName(command.members_path);
  const auto job = client.jobs().SubmitEnsemble(std::move(request), limits);
  if (absl::IsResourceExhausted(job.status()) &&
      absl::StrContains(job.status().message(), "larger than max")) {  // in the words of gRPC
    return PrintError(absl::ResourceExhaustedError(fmt::format(
                          "{}\nthe members do not fit into one message of the server: split {} into several "
                          "jobs, or run dlcsd with a larger --max-message-bytes",
                          std::string(job.status().message()), members.empty() ? source : members)),
                      ExitCodeOf(job.status()));
  }
  if (!job.ok()) return PrintCallError(job.status(), source, members);
  fmt::print("{}\n", job->name());
  const absl::Status printed = FlushStream(stdout, "standard output");
  return printed.ok() ? kSolved : PrintError(printed, kServiceFailed);
}

ExitCode Run(const EnsembleCommand& command) { return Run(command, nullptr); }

ExitCode Run(const EnsembleCommand& command, std::unique_ptr<Backend> backend) {
  const SolveCommand& solve = command.solve;
  if (command.detach && !command.extrema && !solve.options.output_times().empty()) {
    return PrintError(absl::InvalidArgumentError("--at: with --detach only the end of each member is kept; with "
                                                 "--extrema the extrema are those of these times and the end"),
                      kBadInput);
  }
  if (command.members_path.empty()) return RunSweep(command, std::move(backend));
  absl::StatusOr<ProblemInput> input = ProblemInput::Read(solve.problem_path, solve.server, solve.rule);
  if (!input.ok()) return PrintError(input.status(), kBadInput);
  if (!solve.quiet) input->PrintNotes();
  std::optional<Interrupt> interrupt;
  const auto limits = [&] {
    const double time = command.detach ? TimeToSubmit(solve.deadline_s) : solve.deadline_s;
    return CallLimits{.deadline = std::chrono::duration<double>(time), .stop = interrupt->token()};
  };
  if (input->is_uploaded()) {
    // Its shape is needed to read the members.
    interrupt.emplace();
    const absl::Status fetched = input->FetchUploaded(limits());
    if (!fetched.ok()) return PrintError(fetched, ExitCodeOf(fetched));
  }
  if (input->is_nonlinear()) {
    return PrintError(
        absl::InvalidArgumentError("an ensemble has a linear problem; solve nonlinear ones with dlcs solve"),
        kBadInput);
  }
  const auto states = static_cast<int>(input->states());
  const auto constraints = static_cast<int>(input->constraints());
  const auto members = ReadMembersFile(command.members_path, states, constraints, input->StateNames());
  if (!members.ok()) return PrintError(members.status(), kBadInput);
  if (command.detach) {
    if (!interrupt) interrupt.emplace();
    return Detach(command, *input, *members, limits());
  }
  const auto output = OpenOutput(solve.output, {solve.problem_path, command.members_path});
  if (!output.ok()) return PrintError(output.status(), kBadInput);
  std::FILE* out = *output ? (*output)->stream() : stdout;
  // After reading, which Ctrl-C ends as always.
  if (!interrupt) interrupt.emplace();
  if (absl::Status made = MakeIfAbsent(solve.server, solve.quiet, backend); !made.ok()) {
    return PrintError(made, kBadInput);
  }

  EnsembleTable table;
  bool has_header = solve.format != OutputFormat::kCsv;
  const auto print_header = [&](const DisplayNames& names) {
    if (std::exchange(has_header, true)) return;
    PrintMemberCsvHeader(names, static_cast<std::size_t>(states), static_cast<std::size_t>(constraints), out);
  };
  auto count = std::make_unique<MemberCount>(static_cast<std::int64_t>(members->size()), solve.quiet);
  const auto summary = backend->SolveEnsemble(
      MakeRequest(solve, *input, *members),
      [&](const MemberResult& member) {
        count->Add(member.result.summary);
        if (solve.format == OutputFormat::kTable) table.Add(member);
        if (solve.format == OutputFormat::kJson) PrintJson(member, out);
        print_header(member.result.names);
        if (solve.format == OutputFormat::kCsv) PrintMemberCsvLines(member, out);
      },
      limits());
  count.reset();
  if (!summary.ok()) return PrintCallError(summary.status(), input->source(), SourceName(command.members_path));

  print_header({});
  if (solve.format == OutputFormat::kTable) {
    table.Print(input->title(), *summary, WidthOf(out), out);
  }
  const bool whole = summary->stopped() + summary->not_begun() == 0;
  const absl::Status delivered = !*output ? FlushStream(stdout, "standard output")
                                 : whole  ? (*output)->Commit()
                                          : (*output)->CommitPartial();
  if (!delivered.ok()) return PrintError(delivered, kServiceFailed);
  if (!solve.quiet && (solve.format != OutputFormat::kTable || *output)) {
    fmt::print(stderr, "dlcs: {}\n", CountText(*summary));
  }
  return ExitCodeOfSummary(*summary);
}

}  // namespace dlcs::client
