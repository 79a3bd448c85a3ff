// SPDX-License-Identifier: Apache-2.0
// Assembles the result of a solve from its events.

#ifndef DLCS_CLIENT_RESULT_SOLVE_RESULT_H_
#define DLCS_CLIENT_RESULT_SOLVE_RESULT_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/result/display_names.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

struct SolveResult {
  v1::Analysis analysis;  // empty when the solve ended before it
  v1::Summary summary;
  std::size_t states = 0;
  std::size_t constraints = 0;
  DisplayNames names;
  std::vector<double> times;
  std::vector<double> x;                   // `states` values per time
  std::vector<double> y;                   // `constraints` values per time; at 0 and at break points the right limit
  std::vector<double> w;                   // as y; empty from servers that do not send it
  std::vector<v1::LeftLimit> left_limits;  // where they differ, in the order of time
  std::vector<double> outputs;             // names.outputs.size() values per time
  std::string job;                         // the job on the server that keeps this result; empty if there is none

  std::span<const double> x_at(std::size_t k) const { return {x.data() + k * states, states}; }
  std::span<const double> y_at(std::size_t k) const { return {y.data() + k * constraints, constraints}; }
  std::span<const double> outputs_at(std::size_t k) const {
    return {outputs.data() + k * names.outputs.size(), names.outputs.size()};
  }
  bool has_outputs() const { return !names.outputs.empty(); }
  bool has_w() const { return !w.empty(); }
  std::span<const double> w_at(std::size_t k) const {
    return has_w() ? std::span(w.data() + k * constraints, constraints) : std::span<const double>();
  }
};

// Takes the events of one solve in their order. Not thread-safe.
class ResultCollector {
 public:
  // Without `keep_trajectory` the chunks are checked and counted, and the result holds none of them.
  explicit ResultCollector(const v1::SolveRequest& request, bool keep_trajectory = true);
  // The same where `states` and `constraints` are known.
  ResultCollector(std::size_t states, std::size_t constraints, DisplayNames names, bool keep_trajectory = true);

  // From now on chunks have times but no components, which are in other processes.
  void ExpectTimesAlone() { result_.states = result_.constraints = 0; }

  void Add(const v1::SolveEvent& event);
  void AddChunk(const v1::TrajectoryChunk& chunk);
  void AddSummary(v1::Summary summary);

  bool accepted() const { return accepted_; }
  bool has_summary() const { return has_summary_; }

  // The result; call it once. Errors: DataLoss if there was no summary, or if the chunks do not form the trajectory
  // that the summary describes.
  absl::StatusOr<SolveResult> Finish() &&;

  // The result of a solve that ended without a summary because its caller stopped it or ran out of time (`termination`
  // CANCELLED or DEADLINE) after `seconds`: the parts received so far, and a message with the time reached.
  SolveResult FinishIncomplete(v1::Termination termination, double seconds) &&;

 private:
  void Reserve();
  std::string Progress() const;

  SolveResult result_;
  bool keep_trajectory_;
  std::size_t received_times_ = 0;
  std::int64_t asked_times_ = 0;  // 0: all nodes
  bool accepted_ = false;
  bool has_summary_ = false;
  bool sends_w_ = false;  // whether the server sends w, from the first chunk
  std::string fault_;     // the first chunk that did not fit
  double reached_ = 0;    // the time up to which windows, or steps, were accepted
  v1::WindowStarted window_;
  v1::Iterate iterate_;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RESULT_SOLVE_RESULT_H_
