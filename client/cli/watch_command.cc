// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include "client/cli/interrupt.h"
#include "client/cli/job_commands.h"
#include "client/cli/job_support.h"
#include "client/cli/live_view.h"
#include "client/cli/run_support.h"
#include "proto/job_event.h"

namespace dlcs::client {
namespace {

// What LiveView is to show of an event. An accepted window is shown when it is stored.
std::optional<v1::SolveEvent> Shown(const v1::JobEvent& event) {
  const bool of_solve = event.has_analysis() || event.has_window_started() || event.has_iterate() ||
                        (event.has_window_finished() && !event.window_finished().accepted());
  return of_solve ? AsSolveEvent(event) : std::nullopt;
}

class JobView {
 public:
  explicit JobView(const WatchCommand& command) : command_(command), view_(stderr, {.width = WidthOf(stderr)}) {}

  void Show(const v1::JobEvent& event) {
    if (command_.format == OutputFormat::kJson) return PrintJsonLine(event);
    if (command_.quiet) return;
    if (const auto shown = Shown(event)) return view_.OnEvent(*shown);
    switch (event.kind_case()) {
      case v1::JobEvent::kState:
        return fmt::print(stderr, "{} {}\n", TimeText(event.time()), JobStateWord(event.state()));
      case v1::JobEvent::kCheckpointed:
        return fmt::print(stderr, "stored up to t = {:.6g} ({:.0f} %)\n", event.checkpointed().time(),
                          100 * event.checkpointed().progress());
      case v1::JobEvent::kGap:
        skipped_ += event.gap().last_sequence() - event.gap().first_sequence() + 1;
        return;
      case v1::JobEvent::kFinished:
        view_.Finish();
        if (skipped_ > 0) fmt::print(stderr, "({} iterates and windows passed unseen)\n", skipped_);
        return;
      default:
        return;
    }
  }

 private:
  static void PrintJsonLine(const v1::JobEvent& event) {
    std::string line;
    const auto status = google::protobuf::util::MessageToJsonString(event, &line);
    if (status.ok()) fmt::print("{}\n", line);
    std::fflush(stdout);
  }

  const WatchCommand& command_;
  LiveView view_;
  std::int64_t skipped_ = 0;
};

v1::WatchSolveJobRequest RequestOf(const WatchCommand& command) {
  v1::WatchSolveJobRequest request;
  request.set_name(command.name);
  request.set_after_sequence(command.after);
  if (command.interval_s > 0) {
    const double whole = std::floor(command.interval_s);
    request.mutable_min_interval()->set_seconds(static_cast<std::int64_t>(whole));
    request.mutable_min_interval()->set_nanos(static_cast<int>(1e9 * (command.interval_s - whole)));
  }
  if (command.quiet) request.set_view(v1::WATCH_VIEW_PROGRESS);
  if (command.values) request.set_view(*command.values);
  request.mutable_y_components()->Add(command.components.begin(), command.components.end());
  return request;
}

}  // namespace

ExitCode Run(const WatchCommand& command) {
  if (command.values && command.format != OutputFormat::kJson) {
    return Complain(absl::InvalidArgumentError("--values: a table has no room for them; add --format json"), kBadInput);
  }
  const Interrupt interrupt;
  const auto client = ConnectToJobs(command.target);
  if (!client.ok()) return Complain(client.status(), kBadInput);
  const v1::WatchSolveJobRequest request = RequestOf(command);
  JobView view(command);
  const CallLimits limits = LimitsFor(command.target, interrupt);
  const absl::Status watched = (*client)->Watch(
      request, [&](const v1::JobEvent& event) { view.Show(event); }, limits);
  if (!watched.ok()) return Complain(watched, ExitCodeOf(watched));
  const auto job = (*client)->Get(command.name, limits);
  if (!job.ok()) return Complain(job.status(), ExitCodeOf(job.status()));
  return ConcludeJob(*job);
}

}  // namespace dlcs::client
