// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/solve_attempt.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "core/nonlinear/solve_nonlinear.h"
#include "core/problem/observer.h"
#include "core/solve.h"
#include "dlcs/v1/jobs.pb.h"
#include "server/solve_jobs/watch_view.h"
#include "server/wire/convert.h"

namespace dlcs {
namespace {

using jobs::EventKind;
using std::chrono::steady_clock;

// The resume state of a job is one letter and its data:
constexpr char kEngineState = 'e';  // a checkpoint of the engine
constexpr char kSummary = 's';      // everything is stored except the end of the job

std::string Tagged(char tag, const std::string& content) { return tag + content; }

std::optional<std::string> ContentOf(const std::optional<std::string>& state, char tag) {
  if (!state.has_value() || state->empty() || state->front() != tag) return std::nullopt;
  return state->substr(1);
}

// Writes the events of the engine into the sink.
class RunObserver final : public Observer {
 public:
  // Columns below `stored` of the trajectory are in the store; `resumed` if this attempt resumes. `share`: the part of
  // the work up to the end of the trajectory.
  RunObserver(AttemptSink& sink, double horizon, double share, const ComponentNames& names,
              std::optional<OutputEvaluator> outputs, Index stored, bool resumed,
              std::chrono::milliseconds checkpoint_every)
      : sink_(sink),
        horizon_(horizon),
        share_(share),
        names_(names),
        outputs_(std::move(outputs)),
        stored_(stored),
        resumed_(resumed),
        checkpoint_every_(checkpoint_every) {}

  void OnAnalysis(const AnalysisReport& report) override {
    if (resumed_) return;  // the first attempt emitted it
    v1::SolveEvent event;
    *event.mutable_analysis() = ToProto(report, names_);
    Emit(EventKind::kAnalysis, event);
  }
  void OnWindowStarted(const WindowReport& report) override {
    v1::SolveEvent event;
    *event.mutable_window_started() = ToProto(report);
    Emit(EventKind::kWindowStarted, event);
  }
  void OnIterate(const IterateReport& report, const IterateValues& values) override {
    v1::SolveEvent event;
    *event.mutable_iterate() = ToProto(report);
    std::string bytes = event.SerializeAsString();
    AppendValues(values, *sink_.WantedDetail(), bytes);
    sink_.Emit(EventKind::kIterate, std::move(bytes));
  }
  void OnWindowFinished(const WindowOutcome& outcome) override {
    v1::SolveEvent event;
    *event.mutable_window_finished() = ToProto(outcome);
    Emit(outcome.accepted ? EventKind::kWindowFinished : EventKind::kWindowRejected, event);
  }

  bool WantsCheckpoint() override { return steady_clock::now() - last_checkpoint_ >= checkpoint_every_; }
  void OnCheckpoint(const Checkpoint& checkpoint) override {
    last_checkpoint_ = steady_clock::now();
    Store(checkpoint.solution, checkpoint.first + checkpoint.count, checkpoint.time,
          Tagged(kEngineState, checkpoint.state()));
  }

  // Stores the columns of `solution` below `end` that are not stored yet, in chunks; `state` is the state after the
  // last of them.
  void Store(const Solution& solution, Index end, double time, const std::optional<std::string>& state) {
    const Index per_chunk = MostTimesInChunk(solution.x.rows(), solution.y.rows(), outputs_ ? outputs_->shown() : 0);
    do {
      const Index count = std::clamp<Index>(end - stored_, 0, per_chunk);
      v1::TrajectoryChunk chunk;
      if (count > 0) chunk = ChunkToProto(solution, stored_, count, outputs_ ? &*outputs_ : nullptr);
      chunk.set_first(stored_);
      stored_ += count;
      const bool is_last = stored_ >= end;
      jobs::AcceptedWindow window;
      window.begin = count > 0 ? chunk.times(0) : time;
      window.end = count > 0 ? chunk.times(static_cast<int>(count) - 1) : time;
      window.trajectory = chunk.SerializeAsString();
      if (is_last) window.state = state;
      // If only some times are kept, the solve is further than the last of them. Reported progress never decreases.
      reached_ = std::max(reached_, is_last ? time : window.end);
      window.progress = share_ * std::clamp(reached_ / horizon_, 0.0, 1.0);
      v1::SolveEvent event;
      event.mutable_checkpointed()->set_time(reached_);
      event.mutable_checkpointed()->set_times(stored_);
      event.mutable_checkpointed()->set_progress(window.progress);
      window.event = event.SerializeAsString();
      sink_.Accept(std::move(window));
    } while (stored_ < end);
  }

  // Number of columns of the trajectory that are stored or about to be stored.
  Index stored() const { return stored_; }
  // The solve has ended: from now on progress is that of storing the trajectory.
  void FinishWork() { share_ = 1; }

 private:
  void Emit(EventKind kind, const v1::SolveEvent& event) { sink_.Emit(kind, event.SerializeAsString()); }

  AttemptSink& sink_;
  const double horizon_;
  double share_;
  const ComponentNames& names_;
  std::optional<OutputEvaluator> outputs_;
  Index stored_;
  double reached_ = 0;  // in the time of the problem
  const bool resumed_;
  const std::chrono::milliseconds checkpoint_every_;
  steady_clock::time_point last_checkpoint_ = steady_clock::now();
};

v1::Summary SummaryOf(const Solution& solution, jobs::StopCause cause) {
  v1::Summary summary = SummaryToProto(solution);
  summary.mutable_cost()->set_process_peak_bytes(PeakResidentBytes());
  if (solution.termination != Termination::kCancelled) return summary;
  const bool late = cause == jobs::StopCause::kDeadline;
  if (late) summary.set_termination(v1::TERMINATION_DEADLINE);
  summary.set_message(solution.message + (late ? " The deadline of the job passed." : " The job was cancelled."));
  return summary;
}

absl::StatusOr<Solution> SolveSystem(const PreparedSolve& prepared, Observer& observer, const std::stop_token& stop,
                                     SetupCache* setups, const ResumePoint* resume) {
  if (const auto* problem = std::get_if<Problem>(&prepared.system)) {
    return SolveValidated(*problem, prepared.options, observer, stop, setups, resume);
  }
  return SolveNonlinearValidated(std::get<NonlinearProblem>(prepared.system), prepared.options, observer, stop);
}

}  // namespace

bool WillCompare(const Options& options) {
  return options.has_grid() && options.error_tolerance == 0 && options.estimate_error &&
         options.method != Method::kEventDriven;
}

std::optional<std::string> EarlierAttempts::SummaryIn(const std::optional<std::string>& state) {
  return ContentOf(state, kSummary);
}

jobs::JobEnd SolveAttempt(const PreparedSolve& prepared, EarlierAttempts earlier, AttemptSink* sink,
                          std::stop_token stop, SetupCache* setups, std::chrono::milliseconds checkpoint_every) {
  const std::optional<std::string> state = ContentOf(earlier.state, kEngineState);
  const Index stored = earlier.trajectory.x.cols();
  ResumePoint point{.state = state.value_or(""),
                    .x = std::move(earlier.trajectory.x),
                    .y = std::move(earlier.trajectory.y),
                    .w = std::move(earlier.trajectory.w)};
  const ResumePoint* const resume = state ? &point : nullptr;
  if (!sink) {
    Observer nobody;
    return {SolveSystem(prepared, nobody, stop, setups, resume).status(), ""};
  }

  const double horizon = std::visit([](const auto& problem) { return problem.horizon; }, prepared.system);
  const double share = WillCompare(prepared.options) ? 1 / kWorkOfComparedSolve : 1;
  absl::StatusOr<std::optional<OutputEvaluator>> outputs = std::optional<OutputEvaluator>();
  if (const auto* linear = std::get_if<Problem>(&prepared.system)) outputs = OutputsOf(*linear, prepared.options);
  if (!outputs.ok()) return {outputs.status(), ""};
  RunObserver observer(*sink, horizon, share, prepared.names, *std::move(outputs), stored, state.has_value(),
                       checkpoint_every);
  absl::StatusOr<Solution> solution = SolveSystem(prepared, observer, stop, setups, resume);
  if (!solution.ok()) return {FromEngine(solution.status(), prepared.system), ""};
  AddNames(prepared.names, *solution);
  observer.FinishWork();

  const auto columns = static_cast<Index>(solution->times.size());
  const bool stopped = solution->termination == Termination::kCancelled;
  const jobs::StopCause cause = sink->cause();
  const bool will_be_resumed = cause == jobs::StopCause::kDrain || cause == jobs::StopCause::kLeaseLost;
  if (stopped && will_be_resumed) return {absl::CancelledError(), ""};
  const double reached = columns > 0 ? solution->times.back() : 0;
  v1::Summary summary = SummaryOf(*solution, cause);
  if (stopped) {
    // An attempt that was stopped before it resumed does not have the results of earlier ones.
    if (columns >= observer.stored()) observer.Store(*solution, columns, reached, std::nullopt);
    summary.set_times(observer.stored());
    return {absl::CancelledError(), summary.SerializeAsString()};
  }
  observer.Store(*solution, columns, reached, Tagged(kSummary, summary.SerializeAsString()));
  return {absl::OkStatus(), summary.SerializeAsString()};
}

}  // namespace dlcs
