// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/job_solver.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/nonlinear/solve_nonlinear.h"
#include "core/problem/observer.h"
#include "core/solve.h"
#include "dlcs/v1/jobs.pb.h"
#include "server/solve_jobs/job_trajectory.h"
#include "server/solve_jobs/watch_view.h"
#include "server/wire/convert.h"
#include "spdlog/spdlog.h"

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

// Writes the events of the engine into the run, and measures the time that takes.
class RunObserver final : public Observer {
 public:
  // Columns below `stored` of the trajectory are in the store; `resumed` if this attempt resumes. `share`: the part of
  // the work up to the end of the trajectory.
  RunObserver(jobs::JobRun& run, double horizon, double share, const ComponentNames& names,
              std::optional<OutputEvaluator> outputs, Index stored, bool resumed,
              std::chrono::milliseconds checkpoint_every)
      : run_(run),
        horizon_(horizon),
        share_(share),
        names_(names),
        outputs_(std::move(outputs)),
        stored_(stored),
        resumed_(resumed),
        checkpoint_every_(checkpoint_every) {}

  void OnAnalysis(const AnalysisReport& report) override {
    const EmitTimer timer(*this);
    if (resumed_) return;  // the first attempt emitted it
    v1::SolveEvent event;
    *event.mutable_analysis() = ToProto(report, names_);
    Emit(EventKind::kAnalysis, event);
  }
  void OnWindowStarted(const WindowReport& report) override {
    const EmitTimer timer(*this);
    v1::SolveEvent event;
    *event.mutable_window_started() = ToProto(report);
    Emit(EventKind::kWindowStarted, event);
  }
  void OnIterate(const IterateReport& report, const IterateValues& values) override {
    const EmitTimer timer(*this);
    v1::SolveEvent event;
    *event.mutable_iterate() = ToProto(report);
    AddValues(values, *run_.WantedDetail(), *event.mutable_iterate());
    Emit(EventKind::kIterate, event);
  }
  void OnWindowFinished(const WindowOutcome& outcome) override {
    const EmitTimer timer(*this);
    v1::SolveEvent event;
    *event.mutable_window_finished() = ToProto(outcome);
    Emit(outcome.accepted ? EventKind::kWindowFinished : EventKind::kWindowRejected, event);
  }

  bool WantsCheckpoint() override { return steady_clock::now() - last_checkpoint_ >= checkpoint_every_; }
  void OnCheckpoint(const Checkpoint& checkpoint) override {
    const EmitTimer timer(*this);
    last_checkpoint_ = steady_clock::now();
    Store(checkpoint.solution, checkpoint.first + checkpoint.count, checkpoint.time,
          Tagged(kEngineState, checkpoint.state));
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
      run_.Accept(std::move(window));
    } while (stored_ < end);
  }

  // Columns of the trajectory that the store has, or is about to get.
  Index stored() const { return stored_; }
  std::int64_t num_events() const { return num_events_; }
  // The solve has ended: from now on progress is that of storing the trajectory.
  void FinishWork() { share_ = 1; }
  double seconds_emitting() const { return seconds_emitting_; }

 private:
  // Measures one call from the engine.
  class EmitTimer {
   public:
    explicit EmitTimer(RunObserver& observer) : observer_(observer) {}
    ~EmitTimer() {
      ++observer_.num_events_;
      observer_.seconds_emitting_ += std::chrono::duration<double>(steady_clock::now() - begin_).count();
    }
    EmitTimer(const EmitTimer&) = delete;
    EmitTimer& operator=(const EmitTimer&) = delete;

   private:
    RunObserver& observer_;
    const steady_clock::time_point begin_ = steady_clock::now();
  };

  void Emit(EventKind kind, const v1::SolveEvent& event) { run_.Emit(kind, event.SerializeAsString()); }

  jobs::JobRun& run_;
  const double horizon_;
  double share_;
  const ComponentNames& names_;
  std::optional<OutputEvaluator> outputs_;
  Index stored_;
  double reached_ = 0;  // in the time of the problem
  const bool resumed_;
  const std::chrono::milliseconds checkpoint_every_;
  steady_clock::time_point last_checkpoint_ = steady_clock::now();
  std::int64_t num_events_ = 0;
  double seconds_emitting_ = 0;
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

// Solves with twice and four times the step follow for the error estimate.
bool WillCompare(const Options& options) {
  return options.has_grid() && options.error_tolerance == 0 && options.estimate_error &&
         options.method != Method::kEventDriven;
}
constexpr double kShareOfComparedSolve = 1 / 1.75;

double CountSteps(const PreparedSolve& prepared) {
  const double bytes_per_time = sizeof(double) * static_cast<double>(NumbersPerTime(prepared.system));
  const Options& options = prepared.options;
  const double horizon = std::visit([](const auto& problem) { return problem.horizon; }, prepared.system);
  const double compared = WillCompare(options) ? 1 / kShareOfComparedSolve : 1;
  if (options.step > 0) return compared * std::ceil(horizon / options.step);
  if (options.num_steps > 0) return compared * static_cast<double>(options.num_steps);
  return std::max<double>(Options::kMaxDefaultSteps, static_cast<double>(prepared.result_bytes) / bytes_per_time);
}

absl::StatusOr<PreparedSolve> Prepare(const std::string& body, const SessionLimits& limits,
                                      const ProblemResolver& find) {
  v1::SolveRequest request;
  if (!request.ParseFromString(body)) return absl::DataLossError("The stored request cannot be read.");
  return PrepareSolve(request, limits, find);
}

}  // namespace

jobs::Demand PredictDemand(const PreparedSolve& prepared) {
  const double m = static_cast<double>(prepared.num_states()), n = static_cast<double>(prepared.num_constraints());
  const auto* linear = std::get_if<Problem>(&prepared.system);
  const bool dense = linear == nullptr || linear->A.is_dense();
  // A step multiplies with the propagator and solves an LCP from a warm start; a set-up exponentiates or factors.
  const double step = (dense ? 2 * m * m : 100 * m) + 4 * m * std::min(n, 100.0) + 10 * n * n + 1000;
  const double setup = dense ? 60 * m * m * m : 2000 * m;
  constexpr double kFlopsPerSecond = 1e9;
  constexpr double kLargeSeconds = 1;  // below, a second thread has nothing to do
  jobs::Demand demand;
  demand.core_seconds = 0.005 + (setup + CountSteps(prepared) * step) / kFlopsPerSecond;
  demand.threads = demand.core_seconds < kLargeSeconds ? 1 : std::max(prepared.options.num_threads, 1);
  // The trajectory, once more of it on its way to the store, and matrices.
  const double matrices = sizeof(double) * ((dense ? 10 * m * m : 100 * m) + 10 * n * n);
  demand.memory_bytes = 2 * prepared.result_bytes + static_cast<std::int64_t>(matrices) + (std::int64_t{1} << 20);
  return demand;
}

absl::StatusOr<jobs::Demand> JobSolver::Predict(const std::string& owner, const std::string& body) const {
  const absl::StatusOr<PreparedSolve> prepared = Prepare(body, limits_, library_.Of(owner));
  if (!prepared.ok()) return prepared.status();
  return PredictDemand(*prepared);
}

jobs::JobEnd JobSolver::Solve(jobs::JobRun& run) const {
  if (const auto summary = ContentOf(run.resume_state(), kSummary)) return {absl::OkStatus(), *summary};
  absl::StatusOr<PreparedSolve> prepared = Prepare(run.body(), limits_, library_.Of(run.job().owner));
  if (!prepared.ok()) return {prepared.status(), ""};
  prepared->options.num_threads = run.threads();

  ResumePoint point;
  Index stored = 0;
  if (run.num_accepted() > 0) {
    absl::StatusOr<StoredTrajectory> trajectory =
        ReadStoredTrajectory(store_, run.id(), run.num_accepted(), prepared->num_states(), prepared->num_constraints());
    if (!trajectory.ok()) return {trajectory.status(), ""};
    stored = trajectory->x.cols();
    point.x = std::move(trajectory->x);
    point.y = std::move(trajectory->y);
    point.w = std::move(trajectory->w);
  }
  const std::optional<std::string> state = ContentOf(run.resume_state(), kEngineState);
  if (state) point.state = *state;

  const double horizon = std::visit([](const auto& problem) { return problem.horizon; }, prepared->system);
  const double share = WillCompare(prepared->options) ? kShareOfComparedSolve : 1;
  absl::StatusOr<std::optional<OutputEvaluator>> outputs = std::optional<OutputEvaluator>();
  if (const auto* linear = std::get_if<Problem>(&prepared->system)) outputs = OutputsOf(*linear, prepared->options);
  if (!outputs.ok()) return {outputs.status(), ""};
  RunObserver observer(run, horizon, share, prepared->names, *std::move(outputs), stored, state.has_value(),
                       checkpoint_every_);
  absl::StatusOr<Solution> solution = absl::UnknownError("");
  if (const auto* problem = std::get_if<Problem>(&prepared->system)) {
    solution = SolveValidated(*problem, prepared->options, observer, run.stop(), setups_, state ? &point : nullptr);
  } else {
    const auto& nonlinear = std::get<NonlinearProblem>(prepared->system);
    solution = SolveNonlinearValidated(nonlinear, prepared->options, observer, run.stop());
  }
  if (!solution.ok()) return {FromEngine(solution.status(), prepared->system), ""};
  AddNames(prepared->names, *solution);
  observer.FinishWork();
  spdlog::debug("job {}: {} events emitted in {:.1f} ms of {:.1f} ms", run.id(), observer.num_events(),
                1e3 * observer.seconds_emitting(), 1e3 * solution->cost.seconds_total);

  const auto columns = static_cast<Index>(solution->times.size());
  const bool stopped = solution->termination == Termination::kCancelled;
  const bool will_be_resumed = run.cause() == jobs::StopCause::kDrain || run.cause() == jobs::StopCause::kLeaseLost;
  if (stopped && will_be_resumed) return {absl::CancelledError(), ""};
  const double reached = columns > 0 ? solution->times.back() : 0;
  v1::Summary summary = SummaryOf(*solution, run.cause());
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
