// SPDX-License-Identifier: Apache-2.0
#include "server/session/solve_session.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <string>
#include <utility>

#include "core/nonlinear/solve_nonlinear.h"
#include "core/problem/observer.h"
#include "core/problem/source_periods.h"
#include "core/solve.h"
#include "fmt/format.h"
#include "google/protobuf/util/time_util.h"
#include "server/session/request_check.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

using google::protobuf::util::TimeUtil;

// TimeUtil::GetCurrentTime() knows whole seconds only.
google::protobuf::Timestamp Now() {
  const auto since_epoch = std::chrono::system_clock::now().time_since_epoch();
  return TimeUtil::MicrosecondsToTimestamp(std::chrono::duration_cast<std::chrono::microseconds>(since_epoch).count());
}

// A chunk of 1/4 MB stays in the L2 cache while it is made, serialized and sent, and the reader processes it while the
// next is made. The contract says below 1 MB.
constexpr Index kMaxChunkDoubles = (Index{1} << 18) / sizeof(double);
// A chunk that is sent while the engine runs has at least this size, or follows the last one after this time.
constexpr Index kEarlyChunkDoubles = kMaxChunkDoubles / 4;
constexpr std::chrono::milliseconds kEarlyChunkInterval{100};

// The number of times in a chunk.
Index TimesPerChunk(const Solution& solution, const OutputEvaluator* outputs, Index doubles) {
  const Index per_time = 1 + solution.x.rows() + 2 * solution.y.rows() + (outputs != nullptr ? outputs->shown() : 0);
  return std::max<Index>(doubles / per_time, 1);
}

absl::StatusOr<Solution> SolveSystem(const Problem& problem, const Options& options, Observer& observer,
                                     std::stop_token stop, SetupCache* setups) {
  return SolveValidated(problem, options, observer, std::move(stop), setups);
}
absl::StatusOr<Solution> SolveSystem(const NonlinearProblem& problem, const Options& options, Observer& observer,
                                     std::stop_token stop, SetupCache* /*setups*/) {
  return SolveNonlinearValidated(problem, options, observer, std::move(stop));
}

absl::StatusOr<ValidSystem> ReadSystem(const v1::SolveRequest& request, const SessionLimits& limits) {
  if (request.has_nonlinear()) return ParseAndValidate(request.nonlinear(), request.options(), limits);
  return ParseAndValidate(request.problem(), request.options(), limits);
}

// Numbers the events of one solve and turns what the engine reports into them.
class EventWriter final : public Observer {
 public:
  // `outputs` is null if the problem has none.
  EventWriter(SolveSink& sink, const ComponentNames& names, OutputEvaluator* outputs)
      : sink_(sink), names_(names), outputs_(outputs) {}

  void Accept(const std::string& solve_id, const PreparedSolve& prepared) {
    Send([&](v1::SolveEvent& event) {
      event.mutable_accepted()->set_solve_id(solve_id);
      event.mutable_accepted()->set_states(static_cast<int>(prepared.num_states()));
      event.mutable_accepted()->set_constraints(static_cast<int>(prepared.num_constraints()));
    });
  }
  void OnAnalysis(const AnalysisReport& report) override {
    Send([&](v1::SolveEvent& event) { *event.mutable_analysis() = ToProto(report, names_); });
  }
  void OnWindowStarted(const WindowReport& report) override {
    Send([&](v1::SolveEvent& event) { *event.mutable_window_started() = ToProto(report); });
  }
  void OnIterate(const IterateReport& report, const IterateValues&) override {
    Send([&](v1::SolveEvent& event) { *event.mutable_iterate() = ToProto(report); });
  }
  void OnWindowFinished(const WindowOutcome& outcome) override {
    Send([&](v1::SolveEvent& event) { *event.mutable_window_finished() = ToProto(outcome); });
  }
  bool WantsCheckpoint() override { return sink_.WantsTrajectory(); }
  void OnCheckpoint(const Checkpoint& checkpoint) override {
    const Solution& solution = checkpoint.solution;
    const Index end = checkpoint.first + checkpoint.count;
    while (next_time_ < end && IsWorthAChunk(solution, end - next_time_) && sink_.WantsTrajectory()) {
      const Index count = std::min(TimesPerChunk(solution, outputs_, kMaxChunkDoubles), end - next_time_);
      Send([&](v1::SolveEvent& event) {
        *event.mutable_trajectory() = ChunkToProto(solution, next_time_, count, outputs_);
      });
      next_time_ += count;
      last_chunk_ = std::chrono::steady_clock::now();
    }
  }

  std::int64_t next_sequence() const { return next_sequence_; }
  // The number of times sent.
  Index next_time() const { return next_time_; }

 private:
  template <typename Fill>
  void Send(Fill fill) {
    v1::SolveEvent event;
    event.set_sequence(next_sequence_++);
    *event.mutable_time() = Now();
    fill(event);
    sink_.Accept(std::move(event));
  }

  bool IsWorthAChunk(const Solution& solution, Index times) const {
    return times >= TimesPerChunk(solution, outputs_, kEarlyChunkDoubles) ||
           std::chrono::steady_clock::now() - last_chunk_ >= kEarlyChunkInterval;
  }

  SolveSink& sink_;
  const ComponentNames& names_;
  OutputEvaluator* const outputs_;
  std::int64_t next_sequence_ = 1;
  Index next_time_ = 0;
  std::chrono::steady_clock::time_point last_chunk_ = std::chrono::steady_clock::now();
};

}  // namespace

double PeakResidentBytes() {
  // getrusage() also knows the peak of the process that forked this one.
  constexpr char kPeak[] = "VmHWM:";
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(kPeak)) return 1024 * std::strtod(line.c_str() + sizeof(kPeak) - 1, nullptr);
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1024.0 * static_cast<double>(usage.ru_maxrss);
}

const char* StopAdvice(StopCause cause) {
  switch (cause) {
    case StopCause::kNone:
      return "";
    case StopCause::kCancelled:
      return "The caller cancelled it.";
    case StopCause::kDeadline:
      return "The deadline was near: ask for fewer steps or allow more time.";
    case StopCause::kShutdown:
      return "The server is shutting down: submit it again.";
  }
  return "";
}

void SolveControl::Stop(StopCause cause) {
  StopCause none = StopCause::kNone;
  cause_.compare_exchange_strong(none, cause);
  source_.request_stop();
}

Index PreparedSolve::num_states() const {
  return std::visit([](const auto& problem) { return problem.num_states(); }, system);
}
Index PreparedSolve::num_constraints() const {
  return std::visit([](const auto& problem) { return problem.num_constraints(); }, system);
}

absl::StatusOr<PreparedSolve> PrepareSolve(const v1::SolveRequest& request, const SessionLimits& limits,
                                           const ProblemResolver& find) {
  if (NamesProblem(request)) {
    const absl::StatusOr<v1::SolveRequest> whole = ResolveProblem(request, find);
    return whole.ok() ? PrepareSolve(*whole, limits) : whole.status();
  }
  if (request.has_overrides()) return InvalidRequest({{"overrides", "are allowed with problem_name only"}});
  if (request.system_case() == v1::SolveRequest::SYSTEM_NOT_SET) {
    return InvalidRequest({{"problem", "is not set; one of problem, nonlinear and problem_name must be"}});
  }
  if (absl::Status ranks = CheckRanks(request.options(), limits.max_ranks); !ranks.ok()) return ranks;
  absl::StatusOr<ValidSystem> sound = ReadSystem(request, limits);
  if (!sound.ok()) return sound.status();
  PreparedSolve prepared{std::move(sound->system), std::move(sound->options), 0, std::move(sound->names)};
  const absl::StatusOr<std::int64_t> bytes = CountResultBytes(prepared.system, prepared.options, limits);
  if (!bytes.ok()) return bytes.status();
  prepared.result_bytes = *bytes;
  prepared.options.num_threads = AllowedThreads(prepared.options.num_threads, limits);
  return prepared;
}

FinishedSolve::FinishedSolve(Solution solution, std::optional<OutputEvaluator> outputs, StopCause cause,
                             std::int64_t next_sequence, Index next_time)
    : solution_(std::move(solution)),
      outputs_(std::move(outputs)),
      cause_(cause),
      next_sequence_(next_sequence),
      next_time_(next_time) {}

absl::StatusOr<std::optional<OutputEvaluator>> OutputsOf(const Problem& problem, const Options& options) {
  if (problem.outputs.shown() == 0) return std::optional<OutputEvaluator>();
  auto outputs = options.period > 0 ? OutputEvaluator::Create(ProblemOfOnePeriod(problem, options.period).problem)
                                    : OutputEvaluator::Create(problem);
  if (!outputs.ok()) return outputs.status();
  return std::optional<OutputEvaluator>(*std::move(outputs));
}

v1::Termination FinishedSolve::termination() const {
  if (solution_.termination == Termination::kCancelled && cause_ == StopCause::kDeadline)
    return v1::TERMINATION_DEADLINE;
  return ToProto(solution_.termination);
}

std::optional<v1::SolveEvent> FinishedSolve::NextEvent() {
  if (summary_made_) return std::nullopt;
  v1::SolveEvent event;
  const auto num_times = static_cast<Index>(solution_.times.size());
  if (next_time_ < num_times) {
    const Index count = std::min(TimesPerChunk(solution_, outputs(), kMaxChunkDoubles), num_times - next_time_);
    *event.mutable_trajectory() = ChunkToProto(solution_, next_time_, count, outputs());
    next_time_ += count;
  } else {
    v1::Summary& summary = *event.mutable_summary();
    summary = SummaryToProto(solution_);
    summary.set_termination(termination());
    summary.mutable_cost()->set_process_peak_bytes(PeakResidentBytes());
    if (solution_.termination == Termination::kCancelled) {
      summary.set_message(fmt::format("{} {}", solution_.message, StopAdvice(cause_)));
    }
    summary_made_ = true;
  }
  event.set_sequence(next_sequence_++);
  *event.mutable_time() = Now();
  return event;
}

absl::StatusOr<FinishedSolve> RunSolve(const PreparedSolve& prepared, const std::string& solve_id,
                                       const SolveControl& control, SolveSink& sink, SetupCache* setups) {
  absl::StatusOr<std::optional<OutputEvaluator>> outputs = std::optional<OutputEvaluator>();
  if (const auto* linear = std::get_if<Problem>(&prepared.system)) outputs = OutputsOf(*linear, prepared.options);
  if (!outputs.ok()) return outputs.status();
  EventWriter writer(sink, prepared.names, *outputs ? &**outputs : nullptr);
  writer.Accept(solve_id, prepared);
  absl::StatusOr<Solution> solution = std::visit(
      [&](const auto& problem) { return SolveSystem(problem, prepared.options, writer, control.token(), setups); },
      prepared.system);
  if (!solution.ok()) return FromEngine(solution.status(), prepared.system);
  AddNames(prepared.names, *solution);
  return FinishedSolve(*std::move(solution), *std::move(outputs), control.cause(), writer.next_sequence(),
                       writer.next_time());
}

absl::Status RunSolveToEnd(const v1::SolveRequest& request, const SessionLimits& limits, const std::string& solve_id,
                           const SolveControl& control, SolveSink& sink) {
  const absl::StatusOr<PreparedSolve> prepared = PrepareSolve(request, limits);
  if (!prepared.ok()) return prepared.status();
  absl::StatusOr<FinishedSolve> finished = RunSolve(*prepared, solve_id, control, sink);
  if (!finished.ok()) return finished.status();
  while (std::optional<v1::SolveEvent> event = finished->NextEvent()) sink.Accept(*std::move(event));
  return absl::OkStatus();
}

}  // namespace dlcs
