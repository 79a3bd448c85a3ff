// SPDX-License-Identifier: Apache-2.0
// What every method works on: the problem with what is known about it, and where results go.

#ifndef DLCS_CORE_CONTEXT_SOLVE_CONTEXT_H_
#define DLCS_CORE_CONTEXT_SOLVE_CONTEXT_H_

#include <chrono>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/context/certificate.h"
#include "core/context/limit_watch.h"
#include "core/context/recorder.h"
#include "core/discretization/grid.h"
#include "core/discretization/sources.h"
#include "core/format_number.h"
#include "core/lcp/lcp.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/parallel/parallel.h"
#include "core/parallel/team.h"
#include "core/problem/observer.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"
#include "core/propagator/propagator.h"

namespace dlcs {

class SetupCache;

// What the driver decided for the method.
struct MethodChoices {
  // How x0, f and y are carried to N x where that is not by dense matrices.
  Propagator* propagator = nullptr;
  SetupCache* setups = nullptr;  // may be null: core/context/shared_setup.h
  // The largest slope of y as a function of q (LargestSlope()), set if that function may jump and the method needs it
  // to be continuous.
  std::optional<double> largest_slope = std::nullopt;
  // The error tolerance is the default one: event_driven may miss it, and does no more work than
  // Options::MaxDefaultSteps() steps take.
  bool error_by_default = false;
  // time_stepping: in two stages of second order (core/discretization/sparse_step.h) instead of what the options say.
  bool two_stages = false;
  // wu_chen_iteration: all of A by φ-functions, none of it by contours.
  bool without_contours = false;
};

// What StartInterval() (core/context/consistency.h) keeps from one smooth interval to the next.
struct IntervalStarts {
  // For each row of N x + g the largest size so far of the terms that it is the sum of; empty before the first start.
  Vector row_size = {};
  // With options.keep_flow: of the last jump of the state, the derivative of the state after it by that before.
  Matrix jump_derivative = {};
  // Solvers of LCP(q, M) at the starts, of which a circuit has thousands; kept if they are small.
  std::unique_ptr<LcpSolver> selecting_solver = {}, any_solver = {};
  Basis last_basis = {};  // of any_solver
  BasisSuccessors successors = {};
};

// Constraints of relative degree two and more, and the first time at which y of one of them is positive.
struct Impulses {
  std::vector<Index> rows = {};
  std::optional<double> first = {};

  // Records the first positive y of those rows in the steps (begin, end] of the segment.
  void Note(const Grid& grid, const Segment& segment, Index begin, Index end);
};

// What a solve resumes from, and which checkpoints it has made (core/context/checkpointing.h).
struct CheckpointRecord {
  const ResumePoint* resume = nullptr;  // null if the solve begins at 0; must outlive this object
  bool makes = false;                   // checkpoints may be made
  bool resumed = false;
  bool refused = false;  // the resume point does not fit
  Index parted = 0;      // columns of the trajectory that earlier checkpoints hold
};

struct SolveContext {
  const Problem& problem;
  const Options& options;
  const MatrixClass& matrix_class;
  Selection selection;
  const Grid& grid;
  Sources sources;

  Workers& workers;
  Observer& observer;
  std::stop_token stop;
  std::chrono::steady_clock::time_point started;

  Recorder recorder;
  CertificateBuilder certificate;
  Solution& solution;
  // Set if the solve ended because there is no least element, although the system may have a solution beyond: M is a
  // Z-matrix, and LCP(N x + g, M) has no solution where a coupled step has one.
  bool lost_least_element = false;

  MethodChoices choices = {};
  CheckpointRecord checkpoints = {};
  Impulses impulses = {};
  IntervalStarts starts = {};
  std::optional<LimitWatch> limit_watch = {};  // of a problem with limits of outputs

  // Set where `problem` holds the rows of this process alone, of a system that is distributed over the processes of
  // `team`; then with the most states and pairs of one of them, so that all take as many steps at once.
  struct Distribution {
    Team& team;
    Index most_states, most_pairs;
  };
  std::optional<Distribution> distribution = {};

  Index most_states() const { return distribution ? distribution->most_states : problem.num_states(); }
  Index most_pairs() const { return distribution ? distribution->most_pairs : problem.num_constraints(); }
  // Whether it is so in any process that holds rows.
  bool Any(bool value) const { return distribution ? distribution->team.Any(value) : value; }

  SolutionChoice choice() const { return {selection, problem.selector, matrix_class}; }

  // y = SOL(N x + g, M) is a function of x: one solution is meant at every state.
  bool y_is_function() const { return selection != Selection::kAny && selection != Selection::kHistory; }
  // It is a Lipschitz function, so states never jump and y may be interpolated linearly.
  bool y_is_lipschitz() const { return IsAlwaysLipschitz(selection); }

  double Seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count(); }

  // Ends the solve: sets termination, time and message. Returns false, so that a method can write
  // `return context.Fail(...)`.
  bool Fail(Termination termination, double time, std::string message) {
    solution.termination = termination;
    solution.failure_time = time;
    solution.message = std::move(message);
    return false;
  }
  bool FailNonFinite(const Sources::NonFinite& where) {
    return Fail(Termination::kNonFinite, where.time, where.message + "; every value must be finite");
  }
  bool FailLostLeastElement(double time) {
    lost_least_element = true;
    return Fail(Termination::kInfeasible, time,
                "LCP(N x + g, M) at t = " + FormatNumber(time) +
                    " has no least-element solution: the state has reached the edge of what M can answer. With the "
                    "rule auto, exponential-integrator continues with coupled steps.");
  }
  // The selected solution jumps between neighboring times although x does not: no interpolation of y is right.
  bool FailJump(double time, const std::string& why) {
    return Fail(Termination::kUnsupported, time,
                std::string("Near t = ") + FormatNumber(time) + " " + SelectionName(selection) +
                    " is no Lipschitz function of x (" + why +
                    "), as an iteration needs it to be (Remark 3.1 of Wu & Chen). Use exponential-integrator or "
                    "time-stepping, which solve each step coupled.");
  }
  bool FailCancelled(double time) {
    return Fail(Termination::kCancelled, time, "Stopped on request before the end was reached.");
  }

  // Adds a finished segment to certificate and output. Checks for a stop about every ten milliseconds
  // (core/parallel/stop_scope.h); what was added before the stop is kept.
  void Add(const Segment& segment, const Scheme& scheme);
};

// Ends the solve with the termination that belongs to a failed LCP at `time`; `which` names the LCP ("LCP(N x + g,
// M)"). Returns false.
bool FailLcp(SolveContext& context, LcpStatus verdict, double time, const std::string& which);

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_SOLVE_CONTEXT_H_
