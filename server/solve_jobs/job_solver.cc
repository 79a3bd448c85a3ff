// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/job_solver.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "server/session/problem_reference.h"
#include "server/solve_jobs/job_trajectory.h"
#include "server/solve_jobs/rank_attempt.h"

namespace dlcs {
namespace {

// Forwards to a run in this process.
class RunSink final : public AttemptSink {
 public:
  explicit RunSink(jobs::JobRun& run) : run_(run) {}

  void Emit(jobs::EventKind kind, std::string payload) override { run_.Emit(kind, std::move(payload)); }
  void Accept(jobs::AcceptedWindow window) override { run_.Accept(std::move(window)); }
  std::shared_ptr<const jobs::EventDetail> WantedDetail() override { return run_.WantedDetail(); }
  jobs::StopCause cause() const override { return run_.cause(); }

 private:
  jobs::JobRun& run_;
};

double CountSteps(const PreparedSolve& prepared) {
  const double bytes_per_time = sizeof(double) * static_cast<double>(NumbersPerTime(prepared.system));
  const Options& options = prepared.options;
  const double horizon = std::visit([](const auto& problem) { return problem.horizon; }, prepared.system);
  const double compared = WillCompare(options) ? kWorkOfComparedSolve : 1;
  if (options.step > 0) return compared * std::ceil(horizon / options.step);
  if (options.num_steps > 0) return compared * static_cast<double>(options.num_steps);
  return std::max<double>(Options::kMaxDefaultSteps, static_cast<double>(prepared.result_bytes) / bytes_per_time);
}

// Floating-point operations, or what takes as long.
struct Work {
  double setup = 0;  // which solves of equal matrices share
  double solve = 0;
};

// The default method of a small system without steps: few steps of high order, in modes whose Schur forms are kept.
// More of them where the sources have break points; how often pairs switch is not known before.
std::optional<Work> WorkOfEvents(const PreparedSolve& prepared) {
  constexpr double kMostStates = 200, kMostModes = 40;
  constexpr double kSteps = 60, kPerBreakPoint = 6;
  const auto* linear = std::get_if<Problem>(&prepared.system);
  const Options& options = prepared.options;
  const double m = static_cast<double>(prepared.num_states()), n = static_cast<double>(prepared.num_constraints());
  const bool takes_steps = options.method != Method::kAuto && options.method != Method::kEventDriven;
  if (linear == nullptr || takes_steps || options.has_grid() || options.period != 0 || m > kMostStates) return {};
  const double mode = 60 * m * m * m + 20 * n * n * m;
  const double step = 30'000 + 400 * m * m + 40 * m * n + 10 * n * n;
  const double steps = kSteps + kPerBreakPoint * static_cast<double>(linear->break_points.size());
  const double outputs = static_cast<double>(prepared.result_bytes) / sizeof(double);
  return Work{mode, std::min(n, kMostModes) * mode + steps * step + 20 * outputs};
}

// The request that was stored, with its problem.
absl::StatusOr<v1::SolveRequest> ReadRequest(const std::string& body, const ProblemResolver& find) {
  v1::SolveRequest request;
  if (!request.ParseFromString(body)) return absl::DataLossError("The stored request cannot be read.");
  return NamesProblem(request) ? ResolveProblem(request, find) : request;
}

}  // namespace

jobs::Demand PredictDemand(const PreparedSolve& prepared, double solves) {
  const double m = static_cast<double>(prepared.num_states()), n = static_cast<double>(prepared.num_constraints());
  const auto* linear = std::get_if<Problem>(&prepared.system);
  const bool dense = linear == nullptr || linear->A.is_dense();
  // A step multiplies with the propagator and solves an LCP from a warm start; a set-up exponentiates or factors.
  const double step = (dense ? 2 * m * m : 100 * m) + 4 * m * std::min(n, 100.0) + 10 * n * n + 1000;
  const Work by_steps{dense ? 60 * m * m * m : 2000 * m, CountSteps(prepared) * step};
  const Work work = WorkOfEvents(prepared).value_or(by_steps);
  constexpr double kFlopsPerSecond = 1e9;
  constexpr double kSecondsOfJob = 0.005, kSecondsOfSolve = 1e-4;
  constexpr double kLargeSeconds = 1;  // below, a second thread has nothing to do
  jobs::Demand demand;
  demand.core_seconds =
      kSecondsOfJob + work.setup / kFlopsPerSecond + solves * (kSecondsOfSolve + work.solve / kFlopsPerSecond);
  demand.threads = demand.core_seconds < kLargeSeconds ? 1 : std::max(prepared.options.num_threads, 1);
  // The trajectory, a copy of it on its way to the store, and matrices.
  const double matrices = sizeof(double) * ((dense ? 10 * m * m : 100 * m) + 10 * n * n);
  demand.memory_bytes = 2 * prepared.result_bytes + static_cast<std::int64_t>(matrices) + (std::int64_t{1} << 20);
  return demand;
}

absl::StatusOr<jobs::Demand> JobSolver::Predict(const std::string& owner, const std::string& body) const {
  const absl::StatusOr<v1::SolveRequest> request = ReadRequest(body, library_.Of(owner));
  if (!request.ok()) return request.status();
  const absl::StatusOr<PreparedSolve> prepared = PrepareSolve(*request, limits_);
  if (!prepared.ok()) return prepared.status();
  jobs::Demand demand = PredictDemand(*prepared);
  if (const int ranks = request->options().ranks(); ranks > 0) {
    // Each rank reads the whole problem.
    demand.threads = ranks * std::max(request->options().threads(), 1);
    demand.memory_bytes *= ranks;
  }
  return demand;
}

absl::StatusOr<EarlierAttempts> JobSolver::ReadEarlier(const jobs::JobRun& run, const PreparedSolve& prepared) const {
  EarlierAttempts earlier{.state = run.resume_state(), .trajectory = {}};
  if (run.num_accepted() == 0) return earlier;
  absl::StatusOr<StoredTrajectory> trajectory =
      ReadStoredTrajectory(store_, run.id(), run.num_accepted(), prepared.num_states(), prepared.num_constraints());
  if (!trajectory.ok()) return trajectory.status();
  earlier.trajectory = *std::move(trajectory);
  return earlier;
}

jobs::JobEnd JobSolver::Solve(jobs::JobRun& run) const {
  jobs::JobEnd end = Attempt(run);
  if (v1::Summary summary; !end.summary.empty() && summary.ParseFromString(end.summary)) {
    v1::Summary brief;
    brief.set_termination(summary.termination());
    if (summary.has_verdict()) brief.mutable_verdict()->Swap(summary.mutable_verdict());
    end.tally = brief.SerializeAsString();
  }
  return end;
}

jobs::JobEnd JobSolver::Attempt(jobs::JobRun& run) const {
  if (const auto summary = EarlierAttempts::SummaryIn(run.resume_state())) return {absl::OkStatus(), *summary};
  absl::StatusOr<v1::SolveRequest> request = ReadRequest(run.body(), library_.Of(run.job().owner));
  if (!request.ok()) return {request.status(), ""};
  absl::StatusOr<PreparedSolve> prepared = PrepareSolve(*request, limits_);
  if (!prepared.ok()) return {prepared.status(), ""};
  absl::StatusOr<EarlierAttempts> earlier = ReadEarlier(run, *prepared);
  if (!earlier.ok()) return {earlier.status(), ""};
  // From here on only one of the two is needed, and the other may use much memory.
  if (request->options().ranks() > 0) {
    *prepared = {};
    return SolveOnRanks(ranks_, *std::move(request), *std::move(earlier), checkpoint_every_, limits_, run);
  }
  *request = {};
  prepared->options.num_threads = run.threads();
  RunSink sink(run);
  return SolveAttempt(*prepared, *std::move(earlier), &sink, run.stop(), setups_, checkpoint_every_);
}

}  // namespace dlcs
