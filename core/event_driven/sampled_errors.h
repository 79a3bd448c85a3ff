// SPDX-License-Identifier: Apache-2.0
// Errors of the state that are followed from step to step.

#ifndef DLCS_CORE_EVENT_DRIVEN_SAMPLED_ERRORS_H_
#define DLCS_CORE_EVENT_DRIVEN_SAMPLED_ERRORS_H_

#include <array>
#include <tuple>

#include "core/discretization/error_bounds.h"
#include "core/event_driven/mode.h"
#include "core/event_driven/smooth_step.h"

namespace dlcs {

// What guards do that are below zero but not below their levels: errors of x', of x where the mode holds x back, of y
// and of w.
struct Overlooked {
  Vector slope;
  Vector x;
  Vector y;
  Vector w;
};
struct OverlookedByCause {
  Overlooked truncation, rounding;
  Overlooked with_signs;  // truncation with the signs that it has
  Vector y_size;          // that y may have had where an event was overlooked
  Vector y_hidden;        // that it may have where rounding hides it
};

// What a time is off by in each of the columns of SampledErrors.
using TimeErrors = std::array<double, 5>;

// Errors of x, each integrated by the steps of the solution: in a mode an error e obeys e' = Â e + d.
//
// - rounding: d holds an ulp of every term of x', including one of every entry of the data, whose signs are not known.
//   Three samples are taken, with the signs of e, constant ones, and pseudo-random ones in each step.
// - truncation: d is the interpolation error of the sources, and what events that were overlooked do. A bound has the
//   signs of e, so that all contributions add up.
// - the truncation with the signs that it has inside each step, which adds up over the steps.
//
// To these come the local errors of the steps.
class SampledErrors {
 public:
  static constexpr Index kOfRounding = 3;
  // The columns behind them.
  static constexpr Index kTruncation = kOfRounding, kWithSigns = kOfRounding + 1;
  static constexpr Index kCount = kOfRounding + 2;
  static_assert(kCount == std::tuple_size_v<TimeErrors>);

  // An ulp of each x0, with signs.
  explicit SampledErrors(const Vector& x0);

  // Begins the signs of another step.
  void BeginStep() { ++steps_; }
  // Over `step` up to the position `s_end`. Cost: five solves of a step without refinement.
  void Propagate(const SmoothStep& step, const OverlookedByCause& overlooked, double s_end);
  // What they are at the position `s` inside `step`, which they are at the start of, without what the step adds.
  SampledErrors Inside(const SmoothStep& step, double s) const;
  // Adds errors of these sizes, with the signs that add to each sample.
  void AddRounding(const Vector& amount);
  void AddTruncation(const Vector& amount);
  void Add(Index error, const Vector& change) { values_.col(error) += change; }
  // The state x becomes J x, by a reset.
  void Reset(const Matrix& J) { values_ = J * values_; }
  // Rounding that is `change` or -`change`, where components are compared by `size`.
  void AddRoundingOfOneSign(const Vector& change, const Vector& size);

  // One error a column.
  const Matrix& values() const { return values_; }
  // In a linear function of the state, and of x'.
  Matrix In(const LinearOutput& output) const;
  // The same of one row, for one error.
  double In(const LinearOutput& output, Index row, Index error) const;
  // The sizes of errors in columns; rounding is the largest sample.
  static SignedErrorBounds SizesOf(const Matrix& errors);

 private:
  // The signs that an error is given, where it has those of `values`.
  Vector Signs(Index error, const Eigen::Ref<const Vector>& values) const;
  void AddTo(Index error, const Vector& amount) {
    values_.col(error) += Signs(error, values_.col(error)).cwiseProduct(amount);
  }
  // Puts what a step makes of them in their place.
  void Become(ModeStepper::Response response, const SmoothStep& step);
  // What acts on the rows of the mode on a step. Sets `sign`, of the truncation with signs on all of the step.
  Matrix InRows(const SmoothStep& step, const OverlookedByCause& overlooked, double& sign) const;

  Matrix values_;
  Matrix slopes_;  // their derivatives at that place of the step, if its mode is not explicit
  unsigned steps_ = 0;
  Matrix signs_;    // for the first two samples
  Matrix of_data_;  // the parts that each sample has of the rounding of the data, which stays the same
};

// The part of the error inside a step that it has at `s`. It behaves as P_{K+1} - P_{K-1}, which vanishes at the end
// with the slope 2K + 1 and is at most 2 √(2/(π K)).
double PartOfTail(double s);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_SAMPLED_ERRORS_H_
