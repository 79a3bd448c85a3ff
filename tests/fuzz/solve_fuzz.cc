// SPDX-License-Identifier: Apache-2.0
// Requests of a few states and steps, solved: by every method, LCPs and DCPs, analyzed, in ensembles.
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "dlcs/v1/solver.pb.h"
#include "server/session/call_session.h"
#include "server/session/ensemble_session.h"
#include "server/session/solve_session.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/message_text.h"
#include "tests/fuzz/small_limits.h"

namespace dlcs::fuzz {
namespace {

// Some tiny problems ask for hundreds of thousands of steps (a tolerance, events without end): as a caller with a
// deadline would, this stops them.
class Deadline {
 public:
  Deadline() : timer_([this](const std::stop_token& over) { Wait(over); }) {}

  SolveControl control;

 private:
  void Wait(const std::stop_token& over) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, over, std::chrono::milliseconds(500), [] { return false; }) && !over.stop_requested())
      control.Stop(StopCause::kDeadline);
  }

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::jthread timer_;
};

bool AllFinite(const google::protobuf::RepeatedField<double>& values) {
  for (const double value : values) {
    if (!std::isfinite(value)) return false;
  }
  return true;
}

class CheckingSink final : public SolveSink {
 public:
  void Accept(v1::SolveEvent event) override {
    Require(event.sequence() == ++last_, "events are numbered from 1");
    if (event.has_trajectory()) {
      finite_ = finite_ && AllFinite(event.trajectory().x()) && AllFinite(event.trajectory().y());
    }
    if (event.has_summary())
      Require(finite_ || event.summary().termination() != v1::TERMINATION_REACHED_END, "no silent NaN");
    ended_ = event.has_summary();
  }
  bool ended() const { return ended_; }

 private:
  std::int64_t last_ = 0;
  bool finite_ = true;
  bool ended_ = false;
};

void SolveToEnd(const v1::SolveRequest& request) {
  Deadline deadline;
  CheckingSink sink;
  const absl::Status status = RunSolveToEnd(request, TinyLimits(), "fuzz", deadline.control, sink);
  Require(status.ok() == sink.ended(), "a solve ends with a summary or an error");
  Require(!absl::IsInternal(status), "no request is a fault of the server");
}

void SolveLcp(const v1::SolveLcpRequest& request) {
  Deadline deadline;
  const auto response = RunLcp(request, TinyLimits(), deadline.control.token());
  if (!response.ok() || response->verdict() != v1::LCP_STATUS_SOLVED) return;
  Require(AllFinite(response->y()) && AllFinite(response->w()), "no silent NaN");
}

}  // namespace

void TrySolve(const std::string& input) {
  const auto message = MessageOf(input);
  if (const auto* solve = dynamic_cast<const v1::SolveRequest*>(message.get())) return SolveToEnd(*solve);
  if (const auto* lcp = dynamic_cast<const v1::SolveLcpRequest*>(message.get())) return SolveLcp(*lcp);
  Deadline deadline;
  if (const auto* dcp = dynamic_cast<const v1::SolveDcpRequest*>(message.get())) {
    (void)RunDcp(*dcp, TinyLimits(), deadline.control.token());
  } else if (const auto* analysis = dynamic_cast<const v1::AnalyzeProblemRequest*>(message.get())) {
    (void)RunAnalysis(*analysis, TinyLimits(), deadline.control.token());
  } else if (const auto* ensemble = dynamic_cast<const v1::SolveEnsembleRequest*>(message.get())) {
    (void)RunEnsembleToEnd(*ensemble, TinyLimits(), "fuzz", deadline.control, [](const v1::EnsembleEvent&) {});
  }
}

}  // namespace dlcs::fuzz
