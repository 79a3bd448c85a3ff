// SPDX-License-Identifier: Apache-2.0
// The results of an ensemble that is a job.
#include <fmt/format.h>

#include <cstdio>
#include <optional>
#include <string>

#include "client/cli/commands/array_output.h"
#include "client/cli/commands/command_support.h"
#include "client/cli/jobs/job_support.h"
#include "client/cli/output/atomic_file.h"
#include "client/cli/output/ensemble_values.h"
#include "client/cli/terminal/terminal.h"

namespace dlcs::client {

ExitCode PrintEnsemble(JobClient& client, const ResultCommand& command, const v1::SolveJob& job,
                       const CallLimits& limits) {
  if (!command.at.empty() || command.stride != 1 || command.from != 0 || command.to) {
    return PrintError(
        absl::InvalidArgumentError("--at, --stride, --from and --to select times of a solve; an ensemble keeps the "
                                   "end of each member"),
        kBadInput);
  }
  if (command.format == OutputFormat::kNpy || command.format == OutputFormat::kRaw) {
    return PrintError(absl::InvalidArgumentError("the results of an ensemble are a table, csv, json, npz, hdf5 or mat"),
                      kBadInput);
  }
  const auto output = OpenOutput(command.output);
  if (!output.ok()) return PrintError(output.status(), kBadInput);
  std::FILE* const out = *output ? (*output)->stream() : stdout;
  std::optional<EnsembleValues> values;  // where all of them are needed at once
  if (command.format == OutputFormat::kTable || IsOfArrays(command.format)) values.emplace(job.ensemble());
  if (command.format == OutputFormat::kCsv) PrintShardCsvHeader(job.ensemble(), out);
  v1::ReadEnsembleRequest request;
  request.set_name(job.name());
  request.set_follow(true);
  const absl::Status read = client.ReadEnsemble(
      request,
      [&](const v1::EnsembleShard& shard) {
        if (values) values->Add(shard);
        if (command.format == OutputFormat::kCsv) PrintShardCsvLines(shard, out);
        if (command.format == OutputFormat::kJson) PrintShardJsonLines(job.ensemble(), shard, out);
      },
      limits);
  if (!read.ok() && limits.stop.stop_requested()) {
    fmt::print(stderr, "dlcs: {0} continues; dlcs result {0} reads it, dlcs cancel {0} stops it\n", job.name());
    return kServiceFailed;
  }
  if (!read.ok()) return PrintError(read, ExitCodeOf(read));
  const auto ended = client.Get(job.name(), limits);
  if (!ended.ok()) return PrintError(ended.status(), ExitCodeOf(ended.status()));
  if (command.format == OutputFormat::kTable) values->PrintTable(TitleOf(*ended), WidthOf(out), out);
  if (IsOfArrays(command.format)) {
    const absl::Status status = WriteArrays(command.format, values->Arrays(*ended), out);
    if (!status.ok()) {
      return PrintError(*output ? WithFile(status, (*output)->path()) : status, kServiceFailed);
    }
  }
  const absl::Status written = *output ? (*output)->Commit() : FlushStream(stdout, "standard output");
  if (!written.ok()) return PrintError(written, kServiceFailed);
  return ConcludeJob(*ended);
}

}  // namespace dlcs::client
