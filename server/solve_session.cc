// SPDX-License-Identifier: Apache-2.0
#include "server/solve_session.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>
#include <vector>

#include "core/analysis/matrix_class.h"
#include "core/analyze.h"
#include "core/lcp/lcp.h"
#include "core/observer.h"
#include "core/solve.h"
#include "fmt/format.h"
#include "server/convert.h"
#include "server/errors.h"

namespace dlcs {
namespace {

// A chunk stays below 1 MB: a quarter of what receivers accept by default, with room for the other fields.
constexpr Index kMaxChunkDoubles = (1'000'000 - 1'000) / sizeof(double);

Index DoublesPerTime(const Problem& problem) { return 1 + problem.num_states() + problem.num_constraints(); }

// An upper bound of the number of steps, as a double because T / step may be anything.
double CountSteps(const Problem& problem, const Options& options) {
  double steps = static_cast<double>(options.num_steps > 0 ? options.num_steps : Options::kDefaultSteps);
  if (options.step > 0) steps = std::ceil(problem.horizon / options.step);
  if (!options.grid_times.empty()) steps = static_cast<double>(options.grid_times.size()) + 1;
  return steps + static_cast<double>(BreakPoints(problem).size() + options.output_times.size());
}

absl::Status CheckLimit(const char* name, double asked, std::int64_t limit) {
  if (asked <= static_cast<double>(limit)) return absl::OkStatus();
  return LimitExceeded(name, limit, static_cast<std::int64_t>(std::min(asked, 9e18)));
}

// What the engine will find wrong when it is asked to run, named as on the wire.
std::vector<Violation> AllViolations(const Problem& problem, const Options& options) {
  std::vector<Violation> violations = Validate(problem);
  for (Violation& violation : Validate(options, problem.horizon)) {
    violations.push_back({WireOptionName(violation.field), std::move(violation.description)});
  }
  return violations;
}

// Converts and checks what every call about a problem brings.
absl::StatusOr<PreparedSolve> ReadSound(const v1::Problem& problem, const v1::SolveOptions& options,
                                        const SessionLimits& limits) {
  PreparedSolve read;
  std::vector<Violation> violations;
  read.problem = ProblemFromProto(problem, violations);
  read.options = OptionsFromProto(options, violations);
  if (!violations.empty()) return InvalidRequest(violations);

  absl::Status limit =
      CheckLimit("max_states", static_cast<double>(read.problem.num_states()), limits.max_states);
  limit.Update(CheckLimit("max_constraints", static_cast<double>(read.problem.num_constraints()),
                          limits.max_constraints));
  if (!limit.ok()) return limit;

  violations = AllViolations(read.problem, read.options);
  if (!violations.empty()) return InvalidRequest(violations);
  return read;
}

// The engine's own InvalidArgument ("field: description", one per line) with its violations singly.
absl::Status FromEngine(const absl::Status& status) {
  if (status.code() != absl::StatusCode::kInvalidArgument) return status;
  std::vector<Violation> violations;
  std::istringstream lines{std::string(status.message())};
  for (std::string line; std::getline(lines, line);) {
    const std::size_t colon = std::min(line.find(": "), line.size());
    violations.push_back({WireOptionName(line.substr(0, colon)),
                          colon < line.size() ? line.substr(colon + 2) : std::string()});
  }
  return InvalidRequest(violations);
}

// Numbers the events of one solve and turns what the engine reports into them.
class EventWriter final : public Observer {
 public:
  explicit EventWriter(SolveSink& sink) : sink_(sink) {}

  void Accept(const std::string& solve_id) {
    Send([&](v1::SolveEvent& event) { event.mutable_accepted()->set_solve_id(solve_id); });
  }
  void OnAnalysis(const AnalysisReport& report) override {
    Send([&](v1::SolveEvent& event) { *event.mutable_analysis() = ToProto(report); });
  }
  void OnWindowStarted(const WindowReport& report) override {
    Send([&](v1::SolveEvent& event) { *event.mutable_window_started() = ToProto(report); });
  }
  void OnIterate(const IterateReport& report) override {
    Send([&](v1::SolveEvent& event) { *event.mutable_iterate() = ToProto(report); });
  }
  void OnWindowFinished(const WindowOutcome& outcome) override {
    Send([&](v1::SolveEvent& event) { *event.mutable_window_finished() = ToProto(outcome); });
  }

  std::int64_t next_sequence() const { return next_sequence_; }

 private:
  template <typename Fill>
  void Send(Fill fill) {
    v1::SolveEvent event;
    event.set_sequence(next_sequence_++);
    fill(event);
    sink_.Accept(std::move(event));
  }

  SolveSink& sink_;
  std::int64_t next_sequence_ = 1;
};

// What a caller who knows the cause is told in addition to what the engine knows.
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

}  // namespace

void SolveControl::Stop(StopCause cause) {
  StopCause none = StopCause::kNone;
  cause_.compare_exchange_strong(none, cause);
  source_.request_stop();
}

absl::StatusOr<PreparedSolve> PrepareSolve(const v1::SolveRequest& request, const SessionLimits& limits) {
  absl::StatusOr<PreparedSolve> sound = ReadSound(request.problem(), request.options(), limits);
  if (!sound.ok()) return sound.status();
  PreparedSolve& prepared = *sound;
  const Problem& problem = prepared.problem;
  Options& options = prepared.options;

  const double steps = CountSteps(problem, options);
  const double bytes = (steps + 1) * static_cast<double>(DoublesPerTime(problem)) * sizeof(double);
  absl::Status limit = CheckLimit("max_steps", steps, limits.max_steps);
  limit.Update(CheckLimit("max_result_bytes", bytes, limits.max_result_bytes));
  if (!limit.ok()) return limit;

  prepared.result_bytes = static_cast<std::int64_t>(std::min(bytes, 9e18));
  if (limits.max_threads > 0 && (options.num_threads == 0 || options.num_threads > limits.max_threads)) {
    options.num_threads = limits.max_threads;
  }
  return sound;
}

FinishedSolve::FinishedSolve(Solution solution, StopCause cause, std::int64_t next_sequence)
    : solution_(std::move(solution)), cause_(cause), next_sequence_(next_sequence) {}

v1::Termination FinishedSolve::termination() const {
  if (solution_.termination == Termination::kCancelled && cause_ == StopCause::kDeadline) return v1::DEADLINE;
  return ToProto(solution_.termination);
}

std::optional<v1::SolveEvent> FinishedSolve::NextEvent() {
  if (summary_made_) return std::nullopt;
  v1::SolveEvent event;
  const auto num_times = static_cast<Index>(solution_.times.size());
  if (next_time_ < num_times) {
    const Index per_time = 1 + solution_.x.rows() + solution_.y.rows();
    const Index count = std::clamp<Index>(kMaxChunkDoubles / per_time, 1, num_times - next_time_);
    *event.mutable_trajectory() = ChunkToProto(solution_, next_time_, count);
    next_time_ += count;
  } else {
    v1::Summary& summary = *event.mutable_summary();
    summary = SummaryToProto(solution_);
    summary.set_termination(termination());
    if (solution_.termination == Termination::kCancelled) {
      summary.set_message(fmt::format("{} {}", solution_.message, StopAdvice(cause_)));
    }
    summary_made_ = true;
  }
  event.set_sequence(next_sequence_++);
  return event;
}

absl::StatusOr<FinishedSolve> RunSolve(const PreparedSolve& prepared, const std::string& solve_id,
                                       const SolveControl& control, SolveSink& sink) {
  EventWriter writer(sink);
  writer.Accept(solve_id);
  absl::StatusOr<Solution> solution = Solve(prepared.problem, prepared.options, writer, control.token());
  if (!solution.ok()) return FromEngine(solution.status());
  return FinishedSolve(*std::move(solution), control.cause(), writer.next_sequence());
}

absl::Status RunSolveToEnd(const v1::SolveRequest& request, const SessionLimits& limits,
                           const std::string& solve_id, const SolveControl& control, SolveSink& sink) {
  const absl::StatusOr<PreparedSolve> prepared = PrepareSolve(request, limits);
  if (!prepared.ok()) return prepared.status();
  absl::StatusOr<FinishedSolve> finished = RunSolve(*prepared, solve_id, control, sink);
  if (!finished.ok()) return finished.status();
  while (std::optional<v1::SolveEvent> event = finished->NextEvent()) sink.Accept(*std::move(event));
  return absl::OkStatus();
}

absl::StatusOr<v1::AnalyzeProblemResponse> RunAnalysis(const v1::AnalyzeProblemRequest& request,
                                                       const SessionLimits& limits, std::stop_token stop) {
  const absl::StatusOr<PreparedSolve> read = ReadSound(request.problem(), request.options(), limits);
  if (!read.ok()) return read.status();
  const absl::StatusOr<Analysis> analysis = Analyze(read->problem, read->options, std::move(stop));
  if (!analysis.ok()) return FromEngine(analysis.status());
  return ToProto(*analysis);
}

absl::StatusOr<v1::SolveLcpResponse> RunLcp(const v1::SolveLcpRequest& request, const SessionLimits& limits,
                                            const std::stop_token& stop) {
  std::vector<Violation> violations;
  const Matrix M = MatrixFromProto(request.m(), "M", violations);
  const SolutionRule rule = RuleFromProto(request.rule(), violations);
  const Vector q = Eigen::Map<const Vector>(request.q().data(), request.q_size());
  if (!violations.empty()) return InvalidRequest(violations);
  if (absl::Status limit =
          CheckLimit("max_constraints", static_cast<double>(M.rows()), limits.max_constraints);
      !limit.ok()) {
    return limit;
  }

  const absl::StatusOr<LcpResult> result = SolveLcp(M, q, LcpRequest{.rule = rule}, stop);
  if (!result.ok()) return FromEngine(result.status());
  v1::SolveLcpResponse response = ToProto(*result);
  response.set_matrix_class(result->matrix_class);
  return response;
}

}  // namespace dlcs
