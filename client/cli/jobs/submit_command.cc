// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <cstdio>

#include "client/cli/commands/command_support.h"
#include "client/cli/commands/interrupt.h"
#include "client/cli/commands/problem_input.h"
#include "client/cli/jobs/job_commands.h"
#include "client/cli/jobs/job_support.h"
#include "client/cli/output/atomic_file.h"
#include "proto/shared/title_limit.h"
#include "proto/shared/truncate_text.h"

namespace dlcs::client {

ExitCode Run(const SubmitCommand& command) {
  const auto input = ProblemInput::Read(command.solve.problem_path, command.target.server, command.solve.rule);
  if (!input.ok()) return PrintError(input.status(), kBadInput);
  if (!command.quiet) input->PrintNotes();
  v1::CreateSolveJobRequest request;
  *request.mutable_solve() = input->SolveRequest(command.solve.options);
  if (command.title.empty() && !input->is_uploaded()) {
    request.set_title(TruncateUtf8(input->title(), kMaxTitleBytes));
  } else {
    request.set_title(command.title);
  }
  request.set_request_id(command.request_id);
  request.set_priority(command.priority);
  request.set_validate_only(command.validate_only);
  if (command.within_s) *request.mutable_deadline() = FromNow(*command.within_s);

  const Interrupt interrupt;
  const auto client = Connect(command.target);
  if (!client.ok()) return PrintError(client.status(), kBadInput);
  CallLimits limits = LimitsFor(command.target, interrupt);
  const auto job = (*client)->jobs().Submit(request, limits);
  if (!job.ok()) return PrintCallError(job.status(), input->source());
  if (command.validate_only) {
    fmt::print(stderr, "dlcs: would be accepted; predicted {:.3g} core-seconds and {:.3g} MB\n",
               job->predicted_core_seconds(), 1e-6 * static_cast<double>(job->predicted_memory_bytes()));
    return kSolved;
  }
  fmt::print("{}\n", job->name());
  const absl::Status printed = FlushStream(stdout, "standard output");
  if (!printed.ok()) return PrintError(printed, kServiceFailed);
  if (!command.wait) return kSolved;
  WatchCommand watch;
  watch.name = job->name();
  watch.quiet = command.quiet;
  limits.deadline = std::chrono::duration<double>(watch.target.patience_s);
  return FollowJob((*client)->jobs(), watch, limits);
}

}  // namespace dlcs::client
