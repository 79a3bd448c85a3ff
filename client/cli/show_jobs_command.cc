// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <cstdio>
#include <string>

#include "client/cli/atomic_file.h"
#include "client/cli/interrupt.h"
#include "client/cli/job_commands.h"
#include "client/cli/job_support.h"
#include "client/cli/run_support.h"
#include "client/cli/words.h"
#include "client/names.h"

namespace dlcs::client {
namespace {

void PrintJson(const google::protobuf::Message& message) {
  std::string line;
  const auto status = google::protobuf::util::MessageToJsonString(message, &line);
  if (status.ok()) fmt::print("{}\n", line);
}

void PrintRow(const v1::SolveJob& job) {
  fmt::print("{:<31}  {:<10}  {:>4.0f} %  {}\n", job.name(), JobStateWord(job.state()), 100 * job.progress(),
             TimeText(job.create_time()));
}

void PrintWhole(const v1::SolveJob& job) {
  fmt::print("{}\n", job.name());
  fmt::print("  state      {}, {:.0f} % done\n", JobStateWord(job.state()), 100 * job.progress());
  fmt::print("  submitted  {}\n", TimeText(job.create_time()));
  fmt::print("  started    {}\n", TimeText(job.start_time()));
  fmt::print("  ended      {}\n", TimeText(job.end_time()));
  if (job.has_deadline()) fmt::print("  deadline   {}\n", TimeText(job.deadline()));
  if (job.priority() != 0) fmt::print("  priority   {}\n", job.priority());
  if (!job.problem_name().empty()) fmt::print("  problem    {}\n", job.problem_name());
  fmt::print("  predicted  {:.3g} core-seconds, {:.3g} MB\n", job.predicted_core_seconds(),
             1e-6 * static_cast<double>(job.predicted_memory_bytes()));
  if (job.attempts() > 1) fmt::print("  attempts   {} since it last got on\n", job.attempts());
  fmt::print("  stored     {} bytes, {} events\n", job.stored_bytes(), job.last_sequence());
  if (job.has_error()) fmt::print("  error      {}\n", job.error().message());
  if (!job.has_summary()) return;
  fmt::print("  verdict    {}: {}\n", TerminationName(job.summary().termination()), job.summary().message());
  for (const std::string& warning : job.summary().warnings()) fmt::print("  warning    {}\n", warning);
}

void PrintRow(const v1::StoredProblem& problem) {
  fmt::print("{}  {:>10}  {}  {}\n", problem.name(), problem.bytes(), TimeText(problem.create_time()), problem.title());
}

void PrintWhole(const v1::StoredProblem& problem) {
  fmt::print("{}\n", problem.name());
  if (!problem.title().empty()) fmt::print("  title      {}\n", problem.title());
  fmt::print("  system     {}{}, {}, T = {:g}\n", problem.nonlinear() ? "nonlinear, " : "",
             Count(problem.states(), "state"), Count(problem.constraints(), "pair"), problem.horizon());
  fmt::print("  stored     {} bytes\n", problem.bytes());
  fmt::print("  uploaded   {}\n", TimeText(problem.create_time()));
  fmt::print("  expires    {}, unless it is used before\n", TimeText(problem.expire_time()));
}

ExitCode Printed() {
  const absl::Status printed = FlushStream(stdout, "standard output");
  return printed.ok() ? kSolved : Complain(printed, kServiceFailed);
}

ExitCode ShowProblem(const ShowJobsCommand& command, const CallLimits& limits) {
  const auto client = ConnectToProblems(command.target);
  if (!client.ok()) return Complain(client.status(), kBadInput);
  const auto problem = (*client)->Get(command.name, limits);
  if (!problem.ok()) return Complain(problem.status(), ExitCodeOf(problem.status()));
  command.format == OutputFormat::kJson ? PrintJson(*problem) : PrintWhole(*problem);
  return Printed();
}

ExitCode ForgetProblem(const EndJobCommand& command, const CallLimits& limits) {
  const auto client = ConnectToProblems(command.target);
  if (!client.ok()) return Complain(client.status(), kBadInput);
  const absl::Status deleted = (*client)->Delete(command.name, limits);
  return deleted.ok() ? kSolved : Complain(deleted, ExitCodeOf(deleted));
}

}  // namespace

ExitCode Run(const ListProblemsCommand& command) {
  const Interrupt interrupt;
  const auto client = ConnectToProblems(command.target);
  if (!client.ok()) return Complain(client.status(), kBadInput);
  const auto problems = (*client)->List(LimitsFor(command.target, interrupt));
  if (!problems.ok()) return Complain(problems.status(), ExitCodeOf(problems.status()));
  for (const v1::StoredProblem& problem : *problems) {
    command.format == OutputFormat::kJson ? PrintJson(problem) : PrintRow(problem);
  }
  return Printed();
}

ExitCode Run(const ShowJobsCommand& command) {
  const Interrupt interrupt;
  if (command.name.starts_with("problems/")) return ShowProblem(command, LimitsFor(command.target, interrupt));
  const auto client = ConnectToJobs(command.target);
  if (!client.ok()) return Complain(client.status(), kBadInput);
  const CallLimits limits = LimitsFor(command.target, interrupt);
  const bool json = command.format == OutputFormat::kJson;
  if (!command.name.empty()) {
    const auto job = (*client)->Get(command.name, limits);
    if (!job.ok()) return Complain(job.status(), ExitCodeOf(job.status()));
    json ? PrintJson(*job) : PrintWhole(*job);
    return Printed();
  }
  const auto jobs = (*client)->List(command.states, static_cast<std::size_t>(command.most), limits);
  if (!jobs.ok()) return Complain(jobs.status(), ExitCodeOf(jobs.status()));
  for (const v1::SolveJob& job : *jobs) json ? PrintJson(job) : PrintRow(job);
  return Printed();
}

ExitCode Run(const EndJobCommand& command) {
  const Interrupt interrupt;
  if (command.forget && command.name.starts_with("problems/")) {
    return ForgetProblem(command, LimitsFor(command.target, interrupt));
  }
  const auto client = ConnectToJobs(command.target);
  if (!client.ok()) return Complain(client.status(), kBadInput);
  const CallLimits limits = LimitsFor(command.target, interrupt);
  if (command.forget) {
    const absl::Status deleted = (*client)->Delete(command.name, limits);
    return deleted.ok() ? kSolved : Complain(deleted, ExitCodeOf(deleted));
  }
  const auto job = (*client)->Cancel(command.name, limits);
  if (!job.ok()) return Complain(job.status(), ExitCodeOf(job.status()));
  fmt::print(stderr, "dlcs: {} is {}\n", job->name(), JobStateWord(job->state()));
  return kSolved;
}

}  // namespace dlcs::client
