// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "client/cli/commands/command_support.h"
#include "client/cli/commands/interrupt.h"
#include "client/cli/jobs/job_commands.h"
#include "client/cli/jobs/job_support.h"
#include "client/cli/output/message_json.h"
#include "client/cli/terminal/live_view.h"
#include "client/cli/terminal/progress_ticker.h"
#include "client/cli/terminal/terminal.h"

namespace dlcs::client {
namespace {

class JobView {
 public:
  JobView(const WatchCommand& command, const v1::SolveJob& job)
      : command_(command),
        members_(job.ensemble().members()),
        terminal_(!command.quiet && command.format != OutputFormat::kJson && members_ == 0 && job.horizon() > 0 &&
                  CanRedraw(stderr)),
        view_(stderr, {.terminal = terminal_,
                       .color = UsesColor(stderr),
                       .utf8 = UsesUtf8(),
                       .width = WidthOf(stderr),
                       .horizon = job.horizon() > 0 ? job.horizon() : 1,
                       .nonlinear = job.nonlinear()}) {}

  void Show(const v1::SolveEvent& event) {
    if (command_.format == OutputFormat::kJson) return PrintJsonLine(event);
    if (command_.quiet) return;
    switch (event.kind_case()) {
      case v1::SolveEvent::kWindowFinished:
        if (!terminal_ && event.window_finished().accepted()) return;  // shown when it is stored
        return view_.OnEvent(event);
      case v1::SolveEvent::kState:
        return view_.OnText(fmt::format("{} {}", TimeText(event.time()), JobStateWord(event.state())));
      case v1::SolveEvent::kCheckpointed:
        if (members_ > 0) return ShowMembers(event.checkpointed());
        view_.OnReached(event.checkpointed().time());
        if (terminal_) return;  // the panel shows it
        return view_.OnText(fmt::format("stored up to t = {:.6g} ({:.0f} %)", event.checkpointed().time(),
                                        100 * event.checkpointed().progress()));
      case v1::SolveEvent::kGap:
        skipped_ += event.gap().last_sequence() - event.gap().first_sequence() + 1;
        return;
      case v1::SolveEvent::kSummary:
        view_.Finish();
        if (skipped_ > 0) fmt::print(stderr, "({} iterates and windows not shown)\n", skipped_);
        return;
      default:
        return view_.OnEvent(event);
    }
  }

 private:
  // A line for each percent, since there may be thousands of shards.
  void ShowMembers(const v1::Checkpointed& stored) {
    const int percent = static_cast<int>(100 * stored.progress());
    if (percent <= std::exchange(percent_, std::max(percent, percent_))) return;
    view_.OnText(fmt::format("{} of {} members ({} %)", stored.times(), members_, percent));
  }

  static void PrintJsonLine(const v1::SolveEvent& event) {
    fmt::print("{}\n", JsonLine(event));
    std::fflush(stdout);
  }

  const WatchCommand& command_;
  const std::int64_t members_;  // 0 for a solve
  const bool terminal_;
  int percent_ = 0;
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

ExitCode FollowJob(JobClient& client, const WatchCommand& command, const CallLimits& limits) {
  absl::StatusOr<v1::SolveJob> job = client.Get(command.name, limits);
  if (job.ok()) {
    JobView view(command, *job);
    const absl::Status watched = client.Watch(
        RequestOf(command), [&](const v1::SolveEvent& event) { view.Show(event); }, limits);
    job = watched.ok() ? client.Get(command.name, limits) : absl::StatusOr<v1::SolveJob>(watched);
  }
  if (job.ok()) return ConcludeJob(*job);
  if (!limits.stop.stop_requested()) return PrintError(job.status(), ExitCodeOf(job.status()));
  fmt::print(stderr, "dlcs: {0} continues; dlcs watch {0} follows it, dlcs cancel {0} stops it\n", command.name);
  return kServiceFailed;
}

ExitCode Run(const WatchCommand& command) {
  if (command.values && command.format != OutputFormat::kJson) {
    return PrintError(absl::InvalidArgumentError("--values: a table does not show them; add --format json"), kBadInput);
  }
  const Interrupt interrupt;
  const auto found = ConnectToJob(command.target, command.name, interrupt);
  if (!found.ok()) return PrintError(found.status(), ExitCodeOf(found.status()));
  WatchCommand named = command;
  named.name = found->name;
  return FollowJob(found->jobs(), named, found->limits);
}

}  // namespace dlcs::client
