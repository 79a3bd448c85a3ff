// SPDX-License-Identifier: Apache-2.0
#include "client/result/solve_result.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "proto/wire/matrix_shape.h"

namespace dlcs::client {
namespace {

// Through pointers, which copy as one block.
void Append(const google::protobuf::RepeatedField<double>& values, std::vector<double>& all) {
  all.insert(all.end(), values.data(), values.data() + values.size());
}

bool LimitsFit(const v1::TrajectoryChunk& chunk, std::size_t constraints, std::size_t outputs) {
  for (const v1::LeftLimit& limit : chunk.left_limits()) {
    const bool is_inside = limit.index() >= chunk.first() && limit.index() < chunk.first() + chunk.times_size();
    if (!is_inside || static_cast<std::size_t>(limit.y_size()) != constraints) return false;
    if (!limit.w().empty() && limit.w_size() != limit.y_size()) return false;
    if (static_cast<std::size_t>(limit.outputs_size()) != outputs) return false;
  }
  return true;
}

}  // namespace

ResultCollector::ResultCollector(const v1::SolveRequest& request, bool keep_trajectory)
    : keep_trajectory_(keep_trajectory) {
  asked_times_ = request.options().output_times_size();
  // From the request and not from the analysis: an unsupported problem may end before its analysis.
  const v1::Problem& linear = request.problem();
  const v1::NonlinearProblem& nonlinear = request.nonlinear();
  result_.states = static_cast<std::size_t>(request.has_nonlinear() ? nonlinear.x0_size() : linear.x0_size());
  result_.constraints =
      static_cast<std::size_t>(request.has_nonlinear() ? nonlinear.g_size() : ShapeOf(linear.m()).rows);
}

ResultCollector::ResultCollector(std::size_t states, std::size_t constraints, DisplayNames names, bool keep_trajectory)
    : keep_trajectory_(keep_trajectory) {
  result_.names = std::move(names);
  result_.states = states;
  result_.constraints = constraints;
}

void ResultCollector::AddSummary(v1::Summary summary) {
  result_.summary = std::move(summary);
  has_summary_ = true;
}

void ResultCollector::Add(const v1::SolveEvent& event) {
  switch (event.kind_case()) {
    case v1::SolveEvent::kAccepted:
      accepted_ = true;
      // Of a problem that the request names, the server knows the shape.
      if (result_.states == 0) {
        result_.states = static_cast<std::size_t>(event.accepted().states());
        result_.constraints = static_cast<std::size_t>(event.accepted().constraints());
      }
      break;
    case v1::SolveEvent::kAnalysis:
      result_.analysis = event.analysis();
      result_.names = NamesIn(event.analysis());
      if (keep_trajectory_) Reserve();
      break;
    case v1::SolveEvent::kWindowStarted:
      window_ = event.window_started();
      break;
    case v1::SolveEvent::kIterate:
      iterate_ = event.iterate();
      break;
    case v1::SolveEvent::kTrajectory:
      AddChunk(event.trajectory());
      break;
    case v1::SolveEvent::kSummary:
      AddSummary(event.summary());
      break;
    case v1::SolveEvent::kWindowFinished:
      if (event.window_finished().accepted()) reached_ = event.window_finished().end();
      break;
    case v1::SolveEvent::kState:
    case v1::SolveEvent::kCheckpointed:
    case v1::SolveEvent::kLog:
    case v1::SolveEvent::kGap:
    case v1::SolveEvent::kHeartbeat:
    case v1::SolveEvent::KIND_NOT_SET:  // an event of a newer server
      break;
  }
}

// Reserves memory for the trajectory, so that it is not copied as it grows; unused pages cost nothing.
void ResultCollector::Reserve() {
  constexpr std::size_t kMaxBytes = std::size_t{1} << 30;  // even if the server announces more
  const std::size_t outputs = result_.names.outputs.size();
  const std::size_t most = kMaxBytes / (sizeof(double) * (1 + result_.states + 2 * result_.constraints + outputs));
  const std::int64_t announced = asked_times_ > 0 ? asked_times_ : result_.analysis.steps() + 1;
  const std::size_t times = std::min(static_cast<std::size_t>(std::max(announced, std::int64_t{0})), most);
  result_.times.reserve(times);
  result_.x.reserve(times * result_.states);
  result_.y.reserve(times * result_.constraints);
  result_.w.reserve(times * result_.constraints);
  result_.outputs.reserve(times * outputs);
}

void ResultCollector::AddChunk(const v1::TrajectoryChunk& chunk) {
  const auto count = static_cast<std::size_t>(chunk.times_size());
  sends_w_ = received_times_ > 0 ? sends_w_ : !chunk.w().empty();
  const bool fits = static_cast<std::size_t>(chunk.first()) == received_times_ &&
                    static_cast<std::size_t>(chunk.x_size()) == count * result_.states &&
                    static_cast<std::size_t>(chunk.y_size()) == count * result_.constraints &&
                    chunk.w_size() == (sends_w_ ? chunk.y_size() : 0) &&
                    static_cast<std::size_t>(chunk.outputs_size()) == count * result_.names.outputs.size() &&
                    LimitsFit(chunk, result_.constraints, result_.names.outputs.size());
  if (!fits && fault_.empty()) {
    fault_ = fmt::format("the chunk of the trajectory at index {} does not continue it at {}", chunk.first(),
                         received_times_);
  }
  if (!fault_.empty()) return;
  received_times_ += count;
  if (!keep_trajectory_) return;
  Append(chunk.times(), result_.times);
  Append(chunk.x(), result_.x);
  Append(chunk.y(), result_.y);
  Append(chunk.w(), result_.w);
  Append(chunk.outputs(), result_.outputs);
  result_.left_limits.insert(result_.left_limits.end(), chunk.left_limits().begin(), chunk.left_limits().end());
}

absl::StatusOr<SolveResult> ResultCollector::Finish() && {
  if (!fault_.empty()) return absl::DataLossError(fault_);
  if (!has_summary_) return absl::DataLossError("the events of the solve ended without a summary");
  if (static_cast<std::size_t>(result_.summary.times()) != received_times_) {
    return absl::DataLossError(
        fmt::format("the trajectory has {} times; {} were announced", received_times_, result_.summary.times()));
  }
  return std::move(result_);
}

std::string ResultCollector::Progress() const {
  if (window_.steps() == 0) return reached_ > 0 ? fmt::format("at t = {:.6g}", reached_) : "before its first step";
  std::string progress =
      fmt::format("in window {} (t from {:.6g} to {:.6g})", window_.window(), window_.begin(), window_.end());
  if (iterate_.iteration() > 0 && iterate_.window() == window_.window()) {
    progress += fmt::format(" at iteration {}, where the change was {:.1e}", iterate_.iteration(), iterate_.change());
  }
  return progress;
}

SolveResult ResultCollector::FinishIncomplete(v1::Termination termination, double seconds) && {
  v1::Summary& summary = result_.summary;
  summary.set_termination(termination);
  summary.set_message(
      termination == v1::TERMINATION_CANCELLED
          ? fmt::format("Cancelled after {:.1f} s, {}. The server has stopped the solve.", seconds, Progress())
          : fmt::format("The deadline passed after {:.1f} s, {}. Allow more time or ask for fewer steps.", seconds,
                        Progress()));
  summary.set_method(result_.analysis.method());
  summary.set_reason(result_.analysis.reason());
  *summary.mutable_warnings() = result_.analysis.warnings();
  summary.set_step(result_.analysis.step());
  summary.set_times(static_cast<std::int64_t>(received_times_));
  summary.mutable_cost()->set_seconds_total(seconds);
  return std::move(result_);
}

}  // namespace dlcs::client
