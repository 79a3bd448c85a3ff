// SPDX-License-Identifier: Apache-2.0
// Ensembles of the points of .step in a deck.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/commands/command_support.h"
#include "client/cli/commands/interrupt.h"
#include "client/cli/jobs/job_commands.h"
#include "client/cli/jobs/job_support.h"
#include "client/cli/output/atomic_file.h"
#include "client/cli/output/ensemble_output.h"
#include "client/cli/output/message_json.h"
#include "client/cli/terminal/terminal.h"
#include "client/files/json_text.h"
#include "client/netlist/netlist.h"
#include "client/result/ensemble_result.h"
#include "proto/shared/known_end.h"
#include "proto/shared/title_limit.h"
#include "proto/shared/truncate_text.h"

namespace dlcs::client {
namespace {

// What the members of one ensemble have in common. Points with equal matrices share their set-up.
std::string SharedPart(const Netlist& netlist) {
  v1::Problem problem = netlist.problem;
  problem.clear_x0();
  problem.clear_f();
  problem.clear_g();
  problem.clear_horizon();
  return problem.SerializeAsString() + netlist.tolerances.SerializeAsString();
}

std::vector<std::vector<std::size_t>> GroupsOf(const std::vector<SweptNetlist>& sweep) {
  std::map<std::string, std::size_t> known;
  std::vector<std::vector<std::size_t>> groups;
  for (std::size_t k = 0; k < sweep.size(); ++k) {
    const auto [group, is_new] = known.try_emplace(SharedPart(sweep[k].netlist), groups.size());
    if (is_new) groups.emplace_back();
    groups[group->second].push_back(k);
  }
  return groups;
}

v1::SolveEnsembleRequest RequestOf(const SolveCommand& command, bool detach, const std::vector<SweptNetlist>& sweep,
                                   const std::vector<std::size_t>& group) {
  v1::SolveEnsembleRequest request;
  const v1::Problem& first = sweep[group.front()].netlist.problem;
  *request.mutable_problem() = first;
  if (command.rule) request.mutable_problem()->set_rule(*command.rule);
  *request.mutable_options() = WithTolerances(command.options, sweep[group.front()].netlist.tolerances, first);
  bool same_end = true;
  for (const std::size_t k : group) {
    const v1::Problem& problem = sweep[k].netlist.problem;
    v1::EnsembleMember& member = *request.add_members();
    *member.mutable_x0() = problem.x0();
    *member.mutable_f() = problem.f();
    *member.mutable_g() = problem.g();
    member.set_label(sweep[k].label);
    if (problem.horizon() == first.horizon()) continue;
    member.set_horizon(problem.horizon());
    same_end = false;
  }
  const std::optional<double> end = KnownEnd(command.options, first.horizon());
  // A table shows the end alone; a job keeps it.
  if (!detach && command.format == OutputFormat::kTable && same_end && end && command.options.output_times().empty()) {
    request.mutable_options()->add_output_times(*end);
  }
  return request;
}

// A job for each group of points that share their matrices; prints their names.
ExitCode DetachSweep(const EnsembleCommand& command, const std::vector<SweptNetlist>& sweep,
                     const std::string& source) {
  const SolveCommand& solve = command.solve;
  const auto client = ConnectForJobs(solve.server);
  if (!client.ok()) return PrintError(client.status(), kBadInput);
  const Interrupt interrupt;
  const auto deadline = FromNow(solve.deadline_s);
  const std::string& title = sweep.front().netlist.title;
  for (const std::vector<std::size_t>& group : GroupsOf(sweep)) {
    v1::CreateEnsembleJobRequest request;
    *request.mutable_ensemble() = RequestOf(solve, /*detach=*/true, sweep, group);
    if (command.has_deadline) *request.mutable_deadline() = deadline;
    std::vector<std::string> labels;
    for (const std::size_t k : group) labels.push_back(sweep[k].label);
    const std::string labeled = fmt::format("{}: {}", title.empty() ? source : title, fmt::join(labels, "; "));
    request.set_title(TruncateUtf8(labeled, kMaxTitleBytes));
    const ExitCode code = SubmitEnsembleJob(
        command, **client, std::move(request), source,
        {.deadline = std::chrono::duration<double>(TimeToSubmit(solve.deadline_s)), .stop = interrupt.token()});
    if (code != kSolved) return code;
  }
  return kSolved;
}

}  // namespace

ExitCode RunSweep(const EnsembleCommand& command, std::unique_ptr<Backend> backend) {
  const SolveCommand& solve = command.solve;
  const auto text = ReadTextFile(solve.problem_path);
  if (!text.ok()) return PrintError(text.status(), kBadInput);
  const std::string source = SourceName(solve.problem_path);
  if (!IsDeck(*text, solve.problem_path)) {
    return PrintError(
        absl::InvalidArgumentError(
            "MEMBERS is missing: a file with what each member replaces; only a deck with .step needs none"),
        kBadInput);
  }
  const auto sweep = ReadSweep(*text, source, FolderOfDeck(solve.problem_path), {});
  if (!sweep.ok()) return PrintError(sweep.status(), kBadInput);
  if (sweep->front().label.empty()) {
    return PrintError(
        absl::InvalidArgumentError(fmt::format("{}: there is no .step; give a file with members", source)), kBadInput);
  }
  for (const std::string& note : sweep->front().netlist.notes) {
    if (!solve.quiet) PrintNotice(note);
  }
  if (command.detach) return DetachSweep(command, *sweep, source);
  const auto output = OpenOutput(solve.output, {solve.problem_path});
  if (!output.ok()) return PrintError(output.status(), kBadInput);
  std::FILE* out = *output ? (*output)->stream() : stdout;
  const Interrupt interrupt;
  const auto begin = std::chrono::steady_clock::now();
  if (absl::Status made = MakeIfAbsent(solve.server, solve.quiet, backend); !made.ok()) {
    return PrintError(made, kBadInput);
  }

  const DisplayNames names = NamesIn(sweep->front().netlist.problem);
  EnsembleTable table;
  v1::EnsembleSummary summary;
  bool has_header = solve.format != OutputFormat::kCsv;
  for (const std::vector<std::size_t>& group : GroupsOf(*sweep)) {
    const auto on_member = [&](const MemberResult& member) {
      MemberResult shown = member;
      shown.member = static_cast<std::int64_t>(group[static_cast<std::size_t>(member.member)]);
      if (solve.format == OutputFormat::kTable) table.Add(shown);
      if (solve.format == OutputFormat::kJson) PrintJson(shown, out);
      if (!std::exchange(has_header, true)) PrintMemberCsvHeader(names, 0, 0, out);
      if (solve.format == OutputFormat::kCsv) PrintMemberCsvLines(shown, out);
    };
    const auto part = backend->SolveEnsemble(
        RequestOf(solve, /*detach=*/false, *sweep, group), on_member,
        {.deadline = std::chrono::duration<double>(solve.deadline_s) - (std::chrono::steady_clock::now() - begin),
         .stop = interrupt.token()});
    if (!part.ok()) return PrintCallError(part.status(), source);
    AddSummary(*part, summary);
    if (part->stopped() + part->not_begun() > 0) break;
  }
  if (solve.format == OutputFormat::kTable) {
    const std::string& title = sweep->front().netlist.title;
    table.Print(title.empty() ? source : title, summary, WidthOf(out), out);
  }
  const bool whole = summary.stopped() + summary.not_begun() == 0;
  const absl::Status delivered = !*output ? FlushStream(stdout, "standard output")
                                 : whole  ? (*output)->Commit()
                                          : (*output)->CommitPartial();
  if (!delivered.ok()) return PrintError(delivered, kServiceFailed);
  if (!whole) return kServiceFailed;
  return summary.failed() > 0 ? kNoAnswer : kSolved;
}

}  // namespace dlcs::client
