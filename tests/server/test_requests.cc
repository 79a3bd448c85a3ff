// SPDX-License-Identifier: Apache-2.0
#include "tests/server/test_requests.h"

#include <algorithm>

#include "fmt/format.h"

namespace dlcs::testing {

v1::Matrix DenseMatrix(int rows, int columns, std::initializer_list<double> row_major_values) {
  v1::Matrix result;
  result.mutable_dense()->set_rows(rows);
  result.mutable_dense()->set_columns(columns);
  result.mutable_dense()->mutable_values()->Add(row_major_values.begin(), row_major_values.end());
  return result;
}

v1::SolveRequest SwitchingRequest(std::int64_t steps) {
  v1::SolveRequest request;
  v1::Problem& problem = *request.mutable_problem();
  *problem.mutable_a() = DenseMatrix(1, 1, {-1});
  *problem.mutable_b() = DenseMatrix(1, 1, {1});
  *problem.mutable_n() = DenseMatrix(1, 1, {1});
  *problem.mutable_m() = DenseMatrix(1, 1, {1});
  problem.mutable_f()->add_pieces()->mutable_formulas()->add_formulas("sin(2*t)");
  problem.mutable_g()->add_pieces()->mutable_formulas()->add_formulas("cos(3*t) - 0.5");
  problem.add_x0(1);
  problem.set_horizon(10);
  request.mutable_options()->set_steps(steps);
  request.mutable_options()->set_method(v1::METHOD_LAPLACE_ITERATION);  // reports iterates
  return request;
}

v1::SolveRequest ChattyRequest(std::int64_t steps) {
  v1::SolveRequest request = SwitchingRequest(steps);
  request.mutable_options()->set_window_steps(1);
  return request;
}

v1::SolveRequest SteppingRequest(std::int64_t steps) {
  v1::SolveRequest request = SwitchingRequest(steps);
  request.mutable_options()->set_method(v1::METHOD_TIME_STEPPING);
  return request;
}

v1::SolveRequest EndlessRequest() {
  constexpr int kCopies = 50;
  v1::SolveRequest request = SteppingRequest(10'000'000);
  request.mutable_options()->add_output_times(0);
  v1::Problem& problem = *request.mutable_problem();
  for (v1::Matrix* matrix : {problem.mutable_a(), problem.mutable_b(), problem.mutable_n(), problem.mutable_m()}) {
    v1::DenseMatrix& dense = *matrix->mutable_dense();
    const double value = dense.values(0);
    dense.set_rows(kCopies);
    dense.set_columns(kCopies);
    dense.mutable_values()->Resize(kCopies * kCopies, 0);
    for (int k = 1; k < kCopies; ++k) dense.set_values(k * kCopies + k, value);
  }
  for (v1::TimeFunction* function : {problem.mutable_f(), problem.mutable_g()}) {
    auto& formulas = *function->mutable_pieces(0)->mutable_formulas()->mutable_formulas();
    while (formulas.size() < kCopies) *formulas.Add() = formulas[0];
  }
  while (problem.x0_size() < kCopies) problem.add_x0(problem.x0(0));
  return request;
}

std::string WhatIsWrongWithOrder(const std::vector<v1::SolveEvent>& events) {
  if (events.empty()) return "no events";
  if (!events.front().has_accepted()) return "the first event is not `accepted`";
  if (!events.back().has_summary()) return "the last event is not the summary";
  std::int64_t expected = 1;
  std::int64_t next_time = 0;
  for (const v1::SolveEvent& event : events) {
    if (event.has_gap()) {
      const v1::Gap& gap = event.gap();
      if (gap.first_sequence() != expected || gap.last_sequence() != event.sequence() ||
          gap.iterates() + gap.window_events() != gap.last_sequence() - gap.first_sequence() + 1) {
        return "a gap where number " + std::to_string(expected) + " was due: " + event.ShortDebugString();
      }
    } else if (event.sequence() != expected) {
      return fmt::format("number {} where {} was due", event.sequence(), expected);
    }
    expected = event.sequence() + 1;
    if (event.has_trajectory()) {
      if (event.trajectory().first() != next_time) return "a chunk is missing";
      next_time += event.trajectory().times_size();
    }
    if (event.has_summary() && &event != &events.back()) return "an event after the summary";
  }
  if (next_time != events.back().summary().times()) return "the chunks are not the whole trajectory";
  return "";
}

int Count(const std::vector<v1::SolveEvent>& events, v1::SolveEvent::KindCase kind) {
  return static_cast<int>(std::count_if(events.begin(), events.end(),
                                        [kind](const v1::SolveEvent& event) { return event.kind_case() == kind; }));
}

}  // namespace dlcs::testing
