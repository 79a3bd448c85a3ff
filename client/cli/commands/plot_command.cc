// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <string>

#include "client/cli/commands/command_support.h"
#include "client/cli/commands/commands.h"
#include "client/cli/commands/result_plot.h"
#include "client/files/json_text.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {
namespace {

// Moves the outputs by name into the trajectory, in the order of the analysis, where drawing expects them.
void TakeOutputs(v1::SolveResult& result) {
  v1::TrajectoryChunk& trajectory = *result.mutable_trajectory();
  google::protobuf::RepeatedPtrField<std::string> names;
  names.Swap(result.mutable_analysis()->mutable_output_names());
  for (std::string& name : names) {
    const auto values = result.outputs().find(name);
    if (values == result.outputs().end() || values->second.values_size() != trajectory.times_size()) continue;
    result.mutable_analysis()->add_output_names(std::move(name));
  }
  for (int k = 0; k < trajectory.times_size(); ++k) {
    for (const std::string& name : result.analysis().output_names()) {
      const google::protobuf::Value& value = result.outputs().at(name).values(k);
      trajectory.add_outputs(value.has_number_value() ? value.number_value() : std::nan(""));
    }
  }
}

absl::StatusOr<v1::SolveResult> ReadResult(const std::string& path) {
  constexpr std::size_t kAnySize = std::numeric_limits<std::size_t>::max();
  const absl::StatusOr<std::string> text = ReadTextFile(path, kAnySize);
  if (!text.ok()) return absl::InvalidArgumentError(text.status().message());
  v1::SolveResult result;
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = true;  // a newer dlcs may have written it
  const auto status = google::protobuf::util::JsonStringToMessage(*text, &result, options);
  if (!status.ok()) {
    const std::string message(status.message());  // further lines show where
    return absl::InvalidArgumentError(fmt::format("{}: is not the JSON that \"dlcs solve --format json\" prints: {}",
                                                  path, message.substr(0, message.find('\n'))));
  }
  if (result.trajectory().times_size() < 2) {
    return absl::InvalidArgumentError(fmt::format(
        "{}: has no trajectory to draw; dlcs solve PROBLEM --format json --output RESULT.json writes one, and "
        "dlcs solve PROBLEM --plot FILE.svg draws at once",
        path));
  }
  TakeOutputs(result);
  return result;
}

absl::Status Plot(const PlotCommand& command) {
  if (absl::Status name = CheckPictureName("--output", command.output); !name.ok()) return name;
  const absl::StatusOr<v1::SolveResult> result = ReadResult(command.path);
  if (!result.ok()) return result.status();
  return DrawResult(*result, {command.show, command.profile}, command.path, command.output);
}

}  // namespace

ExitCode Run(const PlotCommand& command) {
  const absl::Status status = Plot(command);
  if (status.ok()) return kSolved;
  return PrintError(status, absl::IsInvalidArgument(status) ? kBadInput : kServiceFailed);
}

}  // namespace dlcs::client
