// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

#include "client/cli/analysis_output.h"
#include "client/cli/atomic_file.h"
#include "client/cli/commands.h"
#include "client/cli/interrupt.h"
#include "client/cli/run_support.h"
#include "client/json_text.h"
#include "client/problem_file.h"

namespace dlcs::client {
namespace {

void Print(const AnalyzeCommand& command, const std::string& name, const v1::AnalyzeProblemResponse& analysis,
           std::FILE* out) {
  if (command.format == OutputFormat::kJson) {
    PrintAnalysisJson(name, analysis, out);
  } else {
    const Asked asked = {.source = command.problem_path, .rule = command.rule, .grid = command.grid};
    PrintAnalysisTable(name, asked, analysis, command.verbose ? Detail::kWhole : Detail::kBrief, WidthOf(out),
                       out);
  }
}

}  // namespace

ExitCode Run(const AnalyzeCommand& command) {
  const auto file = ReadProblemFile(command.problem_path);
  if (!file.ok()) return Complain(file.status(), kBadInput);
  if (file->nonlinear) {
    return Complain(absl::InvalidArgumentError(
                        fmt::format("{}: holds a nonlinear problem, and dlcs analyze knows linear ones only; "
                                    "dlcs solve takes it and says what it finds about g",
                                    SourceName(command.problem_path))),
                    kBadInput);
  }
  std::unique_ptr<AtomicFile> output;
  if (!command.output.empty()) {
    auto created = AtomicFile::Create(command.output);
    if (!created.ok()) return Complain(created.status(), kBadInput);
    output = *std::move(created);
  }
  const Interrupt interrupt;  // before gRPC starts its threads, so that signals come here
  const auto backend = MakeBackend(command.server);
  if (!backend.ok()) return Complain(backend.status(), kBadInput);

  v1::AnalyzeProblemRequest request;
  *request.mutable_problem() = file->problem;
  *request.mutable_options() = command.options;
  if (command.rule) request.mutable_problem()->set_rule(*command.rule);
  const auto analysis = (*backend)->AnalyzeProblem(
      request, {.deadline = std::chrono::duration<double>(command.deadline_s), .stop = interrupt.token()});
  const std::string source = SourceName(command.problem_path);
  if (!analysis.ok()) return ComplainAboutCall(analysis.status(), source);

  Print(command, file->name.empty() ? source : file->name, *analysis, output ? output->stream() : stdout);
  const absl::Status printed = output ? output->Commit() : FlushStream(stdout, "standard output");
  if (!printed.ok()) return Complain(printed, kServiceFailed);
  return analysis->recommendation().refusal().empty() ? kSolved : kNoAnswer;
}

}  // namespace dlcs::client
