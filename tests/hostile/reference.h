// SPDX-License-Identifier: Apache-2.0
// An independent reference: integrates from event to event with exact exponentials of the modes, in 106 bits, from the
// stored doubles exactly. It uses no code of the engine.
//
// In a mode x and the sources obey one linear equation z' = A z; its exponential, without the identity, is doubled from
// a short series, all powers kept, so that z is known at every dyadic fraction of a step. A step is accepted where
// polynomials through 17 values agree with 16 others to 1e-18 of the numbers that were summed (exponential sums that
// are that smooth hide nothing between); what must stay nonnegative is searched for its first zero by Bernstein
// coefficients, and the zero is refined on exact values. The mode behind an event, at 0 and behind a kink of the
// sources is the first, in the order of changes to the one before, whose y and w are lexicographically nonnegative with
// their derivatives. Modes are found by enumeration.

#ifndef DLCS_TESTS_HOSTILE_REFERENCE_H_
#define DLCS_TESTS_HOSTILE_REFERENCE_H_

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/hostile/system.h"

namespace dlcs::hostile {

struct Reference {
  enum class Status {
    kReached,  // [0, T] is covered
    kNoMode,   // at `end` no mode can follow: no solution without a jump, as far as modes with first derivatives know
    kGivenUp,  // no claim: too many steps or events, or a zero that could not be refined
  };
  Status status = Status::kGivenUp;
  std::string reason;
  double end = 0;
  int events = 0;
  int steps = 0;
  std::vector<double> event_times;
  std::vector<double> times;  // those asked for
  // At `times`, up to `end`: columns.
  Eigen::MatrixXd x;
  Eigen::MatrixXd y;  // the left limit at T, and else the right one
  Eigen::MatrixXd w;  // likewise
  Eigen::MatrixXd outputs;
  // The largest |x_i|, y_i, w_i and outputs on [0, end].
  Eigen::VectorXd size;
  Eigen::VectorXd size_y;
  Eigen::VectorXd size_w;
  Eigen::VectorXd size_outputs;
};

struct ReferenceLimits {
  int steps = 20000;
  int events = 600;
  double seconds = 20;
};

// Where solutions are several: of the modes that can follow at `time` (the x' of each, in `slopes`), which one is
// meant; -1 for none. Called also at the `decisions`, times where the mode may change though it need not.
struct Replay {
  std::vector<double> decisions;
  // The mode that is reported behind `time`, as bits, until the next of the decisions: it is followed unless its y or w
  // become negative before. Nothing if none is reported.
  std::function<std::optional<unsigned>(double time)> reported;
  // For each candidate, x after a while `probe` behind `time`.
  std::function<double(double time)> probe_time;
  std::function<int(double time, double probe, const std::vector<Eigen::VectorXd>& states)> choose;
};

// `times` increasing in [0, T].
Reference Refer(const System& system, const std::vector<double>& times, const ReferenceLimits& limits = {},
                const Replay* replay = nullptr);

// The largest change of x, relative to the size of each component, that was found when each nonzero number of the data
// changes by one ulp: of three with random signs, and, where these leave open whether `enough` can be reached, of the
// one with the signs that add up what the numbers do one at a time. Only the first 200 numbers have a turn, those of A
// first, and only for ten seconds; the others keep random signs. Infinite if a reference ends otherwise, but for its
// limits.
double Condition(const System& system, const std::vector<double>& times, const Reference& reference, double enough,
                 const ReferenceLimits& limits = {});

}  // namespace dlcs::hostile

#endif  // DLCS_TESTS_HOSTILE_REFERENCE_H_
