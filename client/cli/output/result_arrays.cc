// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/result_arrays.h"

#include <utility>

#include "client/cli/output/message_json.h"

namespace dlcs::client {
namespace {

// Appends the limit from the left, or where it is not given the value at the time.
void AppendLimit(const google::protobuf::RepeatedField<double>& limit, std::span<const double> otherwise,
                 std::vector<double>& rows) {
  if (static_cast<std::size_t>(limit.size()) == otherwise.size()) {
    rows.insert(rows.end(), limit.begin(), limit.end());
  } else {
    rows.insert(rows.end(), otherwise.begin(), otherwise.end());
  }
}

}  // namespace

ResultArrays ArraysOf(const std::string& title, const SolveResult& result) {
  ResultArrays all;
  for (const v1::SwitchingTime& switching : result.summary.switching_times()) {
    all.switching_times.push_back(switching.time());
  }
  for (const v1::LeftLimit& limit : result.left_limits) {
    const auto k = static_cast<std::size_t>(limit.index());
    if (k >= result.times.size()) continue;
    all.left_times.push_back(result.times[k]);
    AppendLimit(limit.y(), result.y_at(k), all.left_y);
    AppendLimit(limit.w(), result.w_at(k), all.left_w);
    AppendLimit(limit.outputs(), result.outputs_at(k), all.left_outputs);
  }
  std::vector<std::string> states, pairs;
  for (std::size_t i = 0; i < result.states; ++i) states.push_back(result.names.OfX(i));
  for (std::size_t i = 0; i < result.constraints; ++i) pairs.push_back(result.names.OfY(i));
  all.names = {{"state_names", std::move(states)}, {"pair_names", std::move(pairs)}};
  if (result.has_outputs()) all.names.push_back({"output_names", result.names.outputs});

  const auto list = [&all](const char* name, std::span<const double> values) {
    all.arrays.push_back({.name = name, .values = values, .rows = values.size(), .is_list = true});
  };
  const auto matrix = [&all](const char* name, std::span<const double> values, std::size_t rows, std::size_t columns) {
    all.arrays.push_back({.name = name, .values = values, .rows = rows, .columns = columns});
  };
  const std::size_t times = result.times.size(), limits = all.left_times.size();
  list("t", result.times);
  matrix("x", result.x, times, result.states);
  matrix("y", result.y, times, result.constraints);
  if (ShowsW(result)) matrix("w", result.w, times, result.constraints);
  list("switching_times", all.switching_times);
  list("left_times", all.left_times);
  matrix("left_y", all.left_y, limits, result.constraints);
  if (ShowsW(result)) matrix("left_w", all.left_w, limits, result.constraints);
  if (result.has_outputs()) {
    matrix("outputs", result.outputs, times, result.names.outputs.size());
    matrix("left_outputs", all.left_outputs, limits, result.names.outputs.size());
  }

  v1::SolveResult document;
  document.set_title(title);
  document.set_job(result.job);
  *document.mutable_analysis() = result.analysis;
  *document.mutable_summary() = result.summary;
  all.summary = JsonLine(document);
  return all;
}

}  // namespace dlcs::client
