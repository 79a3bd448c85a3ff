// SPDX-License-Identifier: Apache-2.0
// The sources f and g on one step, as polynomials.

#ifndef DLCS_CORE_DISCRETIZATION_STEP_SOURCES_H_
#define DLCS_CORE_DISCRETIZATION_STEP_SOURCES_H_

#include <optional>
#include <utility>
#include <vector>

#include "core/discretization/error_bounds.h"
#include "core/discretization/legendre.h"
#include "core/discretization/resolved_cells.h"
#include "core/discretization/sources.h"
#include "core/problem/problem.h"
#include "core/problem/time_function.h"

namespace dlcs {

// f or g on a step, interpolated at the nodes.
struct StepSource {
  LegendreSeries values;
  bool is_steady = false;  // known to be constant: the first coefficient is all there is
  Vector size;             // the largest |value| over the nodes
  Vector at_check;         // the true value at StepSources::check_s
  // Of the polynomial, at that time and in cells of formulas: rounding is that of values and of their times, and
  // truncation what is missed beyond it. That with signs holds rounding too, since what symmetric sources miss adds up
  // to no more than that.
  SignedErrorBounds error;
  // The derivative from the source itself, with a bound of its rounding errors: the polynomial has those of the values
  // over the length. Empty where it was not asked for, as always of f.
  LegendreSeries slope;
  Vector slope_rounding;
};

// f and g on a step from `begin`, and what their polynomials miss at one more time, where a source that vanishes at the
// nodes is noticed.
struct StepSources {
  double begin = 0;
  double length = 0;
  double check_s = 0;  // the position of that time, in (-1, 1)
  StepSource f, g;
  bool finite = false;  // all of these are, and every value
};

class SourceSampler {
 public:
  // Keeps a reference to `sources`. `cells`, those of the same problem, are what Reach() and Probe() use.
  explicit SourceSampler(Sources& sources, ResolvedCells cells = {}) : sources_(sources), cells_(std::move(cells)) {}

  // Where a step from `begin` that should end at `end` has to end for Probe() to see all of f and g: at `end`, or
  // before.
  double Reach(double begin, double end) { return cells_.Reach(begin, end); }
  // The cells that this has taken until `t`.
  std::size_t CellsUntil(double t) const { return cells_.CountUntil(t); }

  // Fills `step` for [begin, end] from K + 2 values of f and g, the first a right limit, the last a left limit.
  void Sample(double begin, double end, StepSources& step);

  // Raises the errors of `step` to those in the cells inside it that are shorter than the step (ResolvedCells), and
  // checks that the values are finite there. Returns whether anything changed. This finds short pulses between the
  // nodes.
  bool Probe(StepSources& step);

  // Sets the slope of g and its rounding, which is infinite where g' is not known. Cost: some ten times that of g at
  // the nodes.
  void SampleSlope(StepSources& step);

  // A time inside `step`, or its end, at which f or g has a kink or a jump, if both are smooth elsewhere in it; of
  // several, the strongest one. None if they are smooth, or smooth nowhere. Found by bisection with about a thousand
  // values: a jump to one ulp, a kink to the rounding of the source.
  std::optional<double> FindKink(const StepSources& step);

  // Checks the sources of `step` at the position `s` instead of check_s; errors found before are kept.
  void MoveCheck(double s, StepSources& step);

  // The limit of f or g at `t` from `side`. For formulas this is the value at the next double on that side, so that (t
  // < 0.3) has both its limits at a break point 0.3.
  void F(double t, Side side, Eigen::Ref<Vector> value) { sources_.F(Beside(t, side), side, value); }
  void G(double t, Side side, Eigen::Ref<Vector> value) { sources_.G(Beside(t, side), side, value); }

  // The sizes of the terms that f and g are summed from at `t`: what their rounding is an ulp of, so at least |f_i|.
  void TermsOfF(double t, Eigen::Ref<Vector> terms);
  void TermsOfG(double t, Eigen::Ref<Vector> terms);

  // Whether some g_i jumps at `time` by more than `allowed` of it and than what the rounding of `time` makes of it,
  // which is much where g is steep.
  bool GJumps(double time, const Vector& allowed);

  // Why a step for which `step` is not finite is not: the value that is not finite; or f or g is so large that the
  // slope of its polynomial overflows.
  Sources::NonFinite WhyNonFinite(const StepSources& step);

  Index evaluations() const { return evaluations_; }  // number of times at which f and g were evaluated

 private:
  static double Beside(double t, Side side);

  Sources& sources_;
  ResolvedCells cells_;
  double WhereTheyMeet(double begin, double from, double to, double end);

  LegendreSeries values_, slope_;
  Vector true_f_, true_g_, rounding_;
  Index evaluations_ = 0;
};

// The increasing times in (0, T) at which f or g may fail to be smooth: the break points, and the sample times of
// sampled sources.
std::vector<double> KnownKinks(const Problem& problem);

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_STEP_SOURCES_H_
