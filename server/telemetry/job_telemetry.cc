// SPDX-License-Identifier: Apache-2.0
#include "server/telemetry/job_telemetry.h"

#include <cctype>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "dlcs/v1/solver.pb.h"
#include "server/log.h"
#include "server/telemetry/job_trace.h"

namespace dlcs {
namespace {

using std::chrono::steady_clock;

const char* OutcomeOf(const absl::Status& status, jobs::StopCause cause) {
  if (status.ok()) return "succeeded";
  if (absl::IsAborted(status)) return "interrupted";
  if (!absl::IsCancelled(status)) return "failed";
  switch (cause) {
    case jobs::StopCause::kNone:
      return "failed";
    case jobs::StopCause::kCancelled:
      return "cancelled";
    case jobs::StopCause::kDeadline:
      return "deadline";
    case jobs::StopCause::kDrain:
    case jobs::StopCause::kLeaseLost:
      return "interrupted";
  }
  return "failed";
}

Cost CostOf(const v1::Cost& cost) {
  Cost result;
  result.steps = cost.steps();
  result.iterations = cost.iterations();
  result.lcps = cost.lcps();
  result.seconds_setup = cost.seconds_setup();
  result.seconds_lcp = cost.seconds_lcp();
  result.seconds_linear = cost.seconds_linear();
  result.seconds_certificate = cost.seconds_certificate();
  result.seconds_total = cost.seconds_total();
  return result;
}

// The name of METHOD_LAPLACE_ITERATION as in MethodName(), laplace-iteration.
std::string NameOf(v1::Method method) {
  std::string name = v1::Method_Name(method).substr(std::string("METHOD_").size());
  for (char& c : name) c = c == '_' ? '-' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return name;
}

void Record(Metrics& metrics, const jobs::JobRun& run, const jobs::JobEnd& end, std::chrono::duration<double> took) {
  const std::string outcome = OutcomeOf(end.status, run.cause());
  metrics.JobEnded(outcome);
  v1::Summary summary;
  const bool solved = !end.summary.empty() && summary.ParseFromString(end.summary);
  const std::string method = solved ? NameOf(summary.method()) : "";
  const std::string termination = solved ? TerminationLabel(summary.termination()) : "";
  if (solved) metrics.Solved("job", method, termination, CostOf(summary.cost()));
  const std::string error = end.status.ok() || absl::IsCancelled(end.status) ? "" : std::string(end.status.message());
  const std::string what = run.is_shard() ? "shard" : "job";
  LogFields facts = {{"job", "jobs/" + run.id()}};
  if (run.is_shard()) facts.push_back({"shard", *run.lease().shard});
  facts.insert(facts.end(), {{"user", run.job().owner},
                             {"outcome", outcome},
                             {"method", method},
                             {"termination", termination},
                             {"error", error},
                             {"attempt", std::int64_t{run.job().attempts}},
                             {"seconds", took.count()},
                             {"trace_id", TraceIdIn(run.body())}});
  Log(spdlog::level::info, what + (outcome == "interrupted" ? " interrupted" : " finished"), facts);
}

}  // namespace

std::string TerminationLabel(v1::Termination termination) {
  const std::string name = v1::Termination_Name(termination);
  constexpr std::string_view kPrefix = "TERMINATION_";
  return name.starts_with(kPrefix) ? name.substr(kPrefix.size()) : name;
}

jobs::SolveFunction WithTelemetry(Metrics& metrics, jobs::SolveFunction solve) {
  return [&metrics, solve = std::move(solve)](jobs::JobRun& run) {
    const auto begin = steady_clock::now();
    jobs::JobEnd end{absl::InternalError("an exception; see the log"), ""};
    try {
      end = solve(run);
    } catch (...) {
      Record(metrics, run, end, steady_clock::now() - begin);
      throw;
    }
    Record(metrics, run, end, steady_clock::now() - begin);
    return end;
  };
}

}  // namespace dlcs
