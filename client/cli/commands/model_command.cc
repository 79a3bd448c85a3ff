// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <utility>

#include "client/cli/commands/command_support.h"
#include "client/cli/commands/commands.h"
#include "client/cli/output/analysis_output.h"
#include "client/cli/output/atomic_file.h"
#include "client/cli/terminal/terminal.h"
#include "client/files/json_text.h"
#include "client/local/model.h"

namespace dlcs::client {

namespace {

absl::StatusOr<nlohmann::ordered_json> MakeFile(const ModelCommand& command) {
  if (command.path.empty()) return ModelOnGrid(command.options);
  const auto text = ReadTextFile(command.path);
  if (!text.ok()) return text.status();
  if (command.options.kind == ModelKind::kHeat) return ModelOnMesh(command.options, *text, SourceName(command.path));
  auto model = ModelInputOutput(*text, SourceName(command.path));
  if (!model.ok()) return model.status();
  PrintSection(model->section, Detail::kBrief, WidthOf(stderr), stderr);
  for (const std::string& warning : model->section.warnings()) fmt::print(stderr, "dlcs: {}\n", warning);
  return std::move(model->file);
}

}  // namespace

ExitCode Run(const ModelCommand& command) {
  const auto output = OpenOutput(command.output, {command.path});
  if (!output.ok()) return PrintError(output.status(), kBadInput);
  const auto file = MakeFile(command);
  if (!file.ok()) return PrintError(file.status(), kBadInput);
  PrintProblemFile(*file, *output ? (*output)->stream() : stdout);
  const absl::Status printed = *output ? (*output)->Commit() : FlushStream(stdout, "standard output");
  return printed.ok() ? kSolved : PrintError(printed, kServiceFailed);
}

}  // namespace dlcs::client
