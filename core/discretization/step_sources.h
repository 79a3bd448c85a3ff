// SPDX-License-Identifier: Apache-2.0
// The sources f and g on one step, as polynomials.

#ifndef DLCS_CORE_DISCRETIZATION_STEP_SOURCES_H_
#define DLCS_CORE_DISCRETIZATION_STEP_SOURCES_H_

#include <optional>
#include <utility>
#include <vector>

#include "core/discretization/legendre.h"
#include "core/discretization/sources.h"
#include "core/problem/problem.h"
#include "core/problem/time_function.h"

namespace dlcs {

// f, g and g' on a step, from `begin`, through their values at the nodes, and how far they are from the truth
// at one more time, where a source that the nodes happen to miss shows itself.
struct StepSources {
  double begin = 0;
  double length = 0;
  LegendreSeries f;
  LegendreSeries g;
  LegendreSeries slope;           // dg/dt
  double check_s = 0;             // the position of that time, in (-1, 1)
  Vector f_at_check, g_at_check;  // the true values there
  Vector f_error, g_error;        // |polynomial - true value| there, beyond rounding
  Vector f_size, g_size;          // max |f_i|, |g_i| over the nodes
  Vector f_noise, g_noise;        // what the rounding of values and of their times may be
  bool finite = false;            // every value was
};

class SourceSampler {
 public:
  // Keeps a reference to `sources`. `probes` are times, increasing, at which Probe() looks.
  explicit SourceSampler(Sources& sources, std::vector<double> probes = {})
      : sources_(sources), probes_(std::move(probes)) {}

  // Fills `step` for [begin, end]: K + 2 values of f and g, the first a right limit, the last a left one.
  void Sample(double begin, double end, StepSources& step);

  // Raises the errors of `step` to those at the probes inside of it, and sees whether it is finite there; returns
  // whether anything changed. Nodes may see nothing of a pulse that lies between them.
  bool Probe(StepSources& step);

  // A time in (begin, end] where f or g has a kink or a jump, where both are smooth on the rest of it; the roughest,
  // where there are several. None where they are smooth, or nowhere smooth. Found by bisection, to an ulp for a jump,
  // to the rounding of the source for a kink; some thousand values.
  std::optional<double> FindKink(double begin, double end);

  // Looks at the sources of `step` at the position `s` instead of check_s; the errors found before stay.
  void MoveCheck(double s, StepSources& step);

  // The limit of f or g at `t` from `side`, of formulas their value at the next number on that side: (t <
  // 0.3) has both its limits at a break point 0.3.
  void F(double t, Side side, Eigen::Ref<Vector> value) { sources_.F(Beside(t, side), side, value); }
  void G(double t, Side side, Eigen::Ref<Vector> value) { sources_.G(Beside(t, side), side, value); }

  Index evaluations() const { return evaluations_; }  // times of all steps

 private:
  static double Beside(double t, Side side);

  Sources& sources_;
  std::vector<double> probes_;
  void LookAhead();
  double WhereTheyMeet(double begin, double from, double to, double end);

  // The largest values seen so far, at the probes first: a formula may be a small difference of numbers of that size.
  Vector f_largest_, g_largest_;
  LegendreSeries values_, f_slope_;
  Vector true_value_;
  Index evaluations_ = 0;
};

// The times at which steps have to see f and g whatever their length: of every interval of (0, T) that is longer than a
// 64th of T at least one, in no rhythm that a source could have. None where no source is a formula: what is constant or
// linear between KnownKinks() has no pulses there.
std::vector<double> ProbeTimes(const Problem& problem);

// The times in (0, T), increasing, where f or g may be anything but smooth: the break points, and every time
// of samples between which they are linear.
std::vector<double> KnownKinks(const Problem& problem);

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_STEP_SOURCES_H_
