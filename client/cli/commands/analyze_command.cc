// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

#include "client/cli/commands/command_support.h"
#include "client/cli/commands/commands.h"
#include "client/cli/commands/interrupt.h"
#include "client/cli/commands/problem_input.h"
#include "client/cli/output/analysis_output.h"
#include "client/cli/output/atomic_file.h"
#include "client/cli/output/message_json.h"
#include "client/cli/terminal/progress_ticker.h"
#include "client/cli/terminal/terminal.h"

namespace dlcs::client {
namespace {

void Print(const AnalyzeCommand& command, const std::string& name, const v1::AnalyzeProblemResponse& analysis,
           std::FILE* out) {
  if (command.format == OutputFormat::kJson) {
    fmt::print(out, "{}\n", JsonLine(analysis));
  } else {
    const bool there = IsProblemName(command.problem_path);
    const Asked asked = {.source = command.problem_path,
                         .server = there && command.server.typed ? command.server.address : "",
                         .rule = command.rule,
                         .grid = command.grid};
    PrintAnalysisTable(name, asked, analysis, command.verbose ? Detail::kWhole : Detail::kBrief, WidthOf(out), out);
  }
}

ExitCode PrintNonlinearError(const ProblemInput& input) {
  return PrintError(absl::InvalidArgumentError(
                        fmt::format("{}: holds a nonlinear problem, but dlcs analyze accepts only linear ones; "
                                    "dlcs solve accepts it and reports the class of the Jacobian of g",
                                    input.source())),
                    kBadInput);
}

}  // namespace

ExitCode Run(const AnalyzeCommand& command) {
  auto reading = command.problem_path != "-" ? std::make_unique<WaitView>("reads " + command.problem_path) : nullptr;
  absl::StatusOr<ProblemInput> input = ProblemInput::Read(command.problem_path, command.server, command.rule);
  reading.reset();
  if (!input.ok()) return PrintError(input.status(), kBadInput);
  input->PrintNotes();
  if (input->is_nonlinear()) return PrintNonlinearError(*input);
  const auto output = OpenOutput(command.output, {command.problem_path});
  if (!output.ok()) return PrintError(output.status(), kBadInput);
  const Interrupt interrupt;
  const auto backend = MakeBackend(command.server);
  if (!backend.ok()) return PrintError(backend.status(), kBadInput);

  const CallLimits limits{.deadline = std::chrono::duration<double>(command.deadline_s), .stop = interrupt.token()};
  const absl::Status fetched = input->FetchUploaded(limits);
  if (!fetched.ok()) return PrintError(fetched, ExitCodeOf(fetched));
  if (input->is_nonlinear()) return PrintNonlinearError(*input);
  auto wait = std::make_unique<WaitView>("analyzes " + input->title());
  const auto analysis = (*backend)->AnalyzeProblem(input->AnalyzeRequest(command.options), limits);
  wait.reset();
  if (!analysis.ok()) return PrintCallError(analysis.status(), input->source());

  Print(command, input->title(), *analysis, *output ? (*output)->stream() : stdout);
  const absl::Status printed = *output ? (*output)->Commit() : FlushStream(stdout, "standard output");
  if (!printed.ok()) return PrintError(printed, kServiceFailed);
  return analysis->recommendation().refusal().empty() ? kSolved : kNoAnswer;
}

}  // namespace dlcs::client
