// SPDX-License-Identifier: Apache-2.0
// The result of a solve: a trajectory with its certificate, or the reason why there is none.

#ifndef DLCS_CORE_PROBLEM_SOLUTION_H_
#define DLCS_CORE_PROBLEM_SOLUTION_H_

#include <complex>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/problem/accuracy.h"
#include "core/problem/options.h"
#include "core/types.h"

namespace dlcs {

enum class Termination {
  kNotSolved,          // Solve() was not called
  kReachedEnd,         // the trajectory covers [0, T]; core/problem/verdict.h says how good it is
  kInfeasible,         // an LCP has no solution
  kDiverged,           // the iteration diverged where it was not allowed to shrink its window
  kIterationLimit,     // iterations or pivots ran out
  kInconsistentState,  // N x + g has no complementary y at 0 or at a break point, and the options allow no jump
  kUnsupported,        // the class of the system is not supported, or does not meet the method's conditions
  kNonFinite,          // an infinity or NaN appeared
  kCancelled,          // the stop token was triggered
  kNotPeriodic,        // there is no periodic solution, none that is isolated, or none was found
};

// How well the returned trajectory satisfies the system, measured after the fact. With w = N x + g + M y:
struct Certificate {
  // max over nodes, and over the midpoints of all steps, of ‖min(y, w)‖_∞ and of |yᵀw|. At midpoints x is the method's
  // interpolant, and y is linear between nodes or constant on the step, as in the method.
  double node_residual = std::numeric_limits<double>::quiet_NaN();
  double midpoint_residual = std::numeric_limits<double>::quiet_NaN();
  double node_complementarity = std::numeric_limits<double>::quiet_NaN();
  double midpoint_complementarity = std::numeric_limits<double>::quiet_NaN();
  // max over midpoints of ‖x' - (A x + B y + f)‖_∞ for the method's interpolant of x.
  double ode_defect = std::numeric_limits<double>::quiet_NaN();
  // The scales to compare the residuals with: max over nodes of max(‖y‖_∞, ‖w‖_∞), and max of ‖x'‖_∞.
  double lcp_scale = std::numeric_limits<double>::quiet_NaN();
  double ode_scale = std::numeric_limits<double>::quiet_NaN();
  // The largest ‖x‖_∞.
  double x_scale = std::numeric_limits<double>::quiet_NaN();

  // max over pairs of |min(y_i / size of y_i, w_i / size of w_i)|, which does not depend on units. The sizes are the
  // largest values during the solve of |y_i|, and of the sum of the absolute values of the terms of w_i; where y is
  // constant on steps, what it moves in one counts as a term of x_j. NaN if states are not kept or the method does not
  // measure it; so is the next field.
  double node_residual_of_rows = std::numeric_limits<double>::quiet_NaN();
  double midpoint_residual_of_rows = std::numeric_limits<double>::quiet_NaN();
  // max over states and nodes of |x_i(t) - x_i(0) - ∫ (A x + B y + f)_i| / max |x_i|, without jumps, with the integral
  // by Simpson's rule on each step, which is independent of the method. Only over the states that the steps resolve;
  // fast states, and states that follow others instantly, are left out.
  double drift_of_rows = std::numeric_limits<double>::quiet_NaN();
  // max over nodes of the part of |min(y_i, w_i)| that is of w_i, beyond the rounding of its terms. An LCP counts w_i
  // as zero where it is small beside its terms, whatever w_i itself is. Empty where node_residual_of_rows is NaN, and
  // for event-driven solves.
  Vector w_missed = {};
};

// The state jumped by `dx` = B p at `time`, with multiplier p >= 0.
struct StateJump {
  double time = 0;
  Vector dx;
  Vector multiplier;
};

// The interpolant of the method between two consecutive nodes; core/event_driven/interpolant.h evaluates it.
struct DenseOutput {
  // x: linear; or the exact solution of x' = A x + B y + f for f linear between nodes and y as below.
  bool x_is_linear = false;
  // y: linear; or constant, equal to y_j on (t_{j-1}, t_j].
  bool y_is_linear = false;
};

// The left limits y(t⁻) and w(t⁻) at times[column], where they differ from the right limits in the trajectory: wherever
// y jumps, and at break points also where only w does.
struct LeftLimit {
  Index column = 0;
  Vector y;
  Vector w;
};

// Why the active set changes.
enum class SwitchingKind {
  kStart,              // the active set at t = 0
  kSwitch,             // a component of y or w reached zero
  kJump,               // the state jumped
  kBreakPoint,         // f or g has a break point
  kCoupledStepsBegin,  // no active set lasts from here on
  kCoupledStepsEnd,
};

// A time at which indices enter or leave the active set (w_i = 0 while y_i may be positive). At 0 the initially active
// indices enter.
struct SwitchingTime {
  double time = 0;
  double error = 0;             // how far the time may be off; modes that are shorter may have been passed over
  std::vector<Index> entering;  // active from here on, increasing; during coupled steps none is active
  std::vector<Index> leaving;   // y_i = 0 from here on
  SwitchingKind kind = SwitchingKind::kSwitch;
};

// Why a discrete state flips (core/problem/switching.h).
enum class FlipCause {
  kStart,      // at t = 0
  kEdge,       // an edge or a clock time that is given
  kCondition,  // a condition of controls began to hold, or does so since another switch flipped
};

// A discrete state that flips. Those of one time are in the order in which they flip.
struct SwitchFlip {
  double time = 0;
  double error = 0;  // how far the time may be off
  Index index = 0;   // of the switch
  bool value = false;
  FlipCause cause = FlipCause::kCondition;
};

// x, y and w of event_driven on [begin, end]: column k is the coefficient of the Legendre polynomial P_k in
// s = 2 (t - begin)/length - 1, which runs from -1 to at most 1. y or w below zero, by rounding, means zero.
struct TrajectoryPiece {
  double begin = 0;
  double end = 0;
  double length = 0;  // end - begin, or more where an event cut the step short
  Matrix x;
  Matrix y;
  Matrix w;
};

// The value of a Measurement.
struct MeasurementResult {
  std::string name;
  std::optional<double> value;  // absent if there is none
  std::optional<double> time;   // of the minimum, the maximum, the value; the begin of the delay
  std::string reason;           // why there is no value
  std::string note = {};        // what was measured, where that is not what was asked for word by word
};

// The flow of event_driven from 0 to T.
struct FlowRecord {
  Matrix derivative;    // dx(T)/dx(0), m × m; empty where steps without a mode were taken
  Vector begin_slope;   // x'(0⁺)
  Vector end_slope;     // x'(T⁻)
  bool grazes = false;  // a guard only touched zero at an event: the derivative holds on one side at best
  Index work = 0;       // of the solve (EventRecord::Work)
};

// What becomes of small disturbances of a periodic solution.
enum class Stability {
  kUndetermined,  // a multiplier is 1 in size within its error, or the multipliers or their errors are not known
  kStable,        // they die out
  kUnstable,      // some grow
};

// A periodic steady state, or the state of a search that failed (core/periodic/periodic.h).
struct PeriodicRecord {
  double period = 0;
  // The eigenvalues of the derivative of x(period) with respect to x(0), the largest first. The solution is stable if
  // all are inside the unit circle. An autonomous oscillation always has one that is 1, which does not count.
  std::vector<std::complex<double>> multipliers;
  std::optional<Stability> stability;  // absent if no periodic solution was found
  // The size of the largest multiplier that counts, minus 1: by which part disturbances grow in a period. NaN if it is
  // not known.
  double growth = std::numeric_limits<double>::quiet_NaN();
  // The averages over one period, exact for the polynomials of the steps; that of y without multipliers of jumps.
  Vector mean_x, mean_y, mean_w;
  Vector mean_outputs;  // of the outputs that are not hidden; those of y in them likewise
  double residual = std::numeric_limits<double>::quiet_NaN();  // the largest |x_i(period) - x_i(0)| / max |x_i|
  // The largest error of a component, relative to its size, from the residual and the errors of one period. If a
  // multiplier is near 1, it is much larger than these.
  double error = std::numeric_limits<double>::quiet_NaN();
  Index periods = 0;            // integrated, with those that event_driven repeated
  Index newton_iterations = 0;  // accepted ones
  double phase = 0;             // the time at which the period begins, a multiple of the period
};

// How x0, f and y were propagated to N x.
struct PropagatorRecord {
  PropagatorKind used = PropagatorKind::kDense;
  std::string reason;
  Index terms = 0;              // exponentials for each slow mode, or nodes of all contours; 0 for dense matrices
  Index factorizations = 0;     // sparse ones
  Index linear_iterations = 0;  // Krylov steps, each with one V-cycle of multigrid
  Index set_changes = 0;        // active sets tried beyond the first of each LCP, with kIterativeStepping
  double error = 0;  // bound of the change of N x by approximating the transfer function, relative to its largest value
};

struct Cost {
  Index steps = 0;
  Index windows = 0;     // of the iterations, rejected ones included; 0 for time-stepping methods
  Index iterations = 0;  // of all windows, rejected ones included
  Index lcps = 0;
  Index coupled_steps = 0;      // steps of laplace_iteration that were solved by the coupled LCP(q, M + K_0) instead
  Index newton_iterations = 0;  // of all steps
  Index most_newton_iterations = 0;  // of one step
  Index substituted_steps = 0;       // that Newton's method could not solve
  Index solves = 1;                  // of event_driven: how often [0, T] was solved, with smaller errors each time
  // Times are those of all solves that the answer took, with other steps too.
  double seconds_setup = 0;
  double seconds_lcp = 0;  // includes propagation in time-stepping methods, where the two cannot be separated
  double seconds_linear = 0;
  double seconds_certificate = 0;  // if it is a separate stage; otherwise it is part of the steps
  double seconds_total = 0;
  double predicted_bytes = 0;  // of everything allocated at the same time, the trajectory included

  void AddStages(const Cost& other) {
    seconds_setup += other.seconds_setup;
    seconds_lcp += other.seconds_lcp;
    seconds_linear += other.seconds_linear;
    seconds_certificate += other.seconds_certificate;
  }
};

// The convergence of Newton's method in the step with the most iterations. ‖F(u^k)‖_∞ decreases superlinearly for 3hκ <
// 1; F is piecewise linear, so the last iteration gives the solution up to rounding.
struct NewtonRecord {
  double time = 0;                // the end of the step
  std::vector<double> residuals;  // ‖F(u^k)‖_∞, k = 0, 1, ..., F as in core/stepping/newton_step.h
  // hκ for the longest step: H of (3.1) contracts with this rate (Lemma 3.1). Absent where no κ is known.
  std::optional<double> contraction;

  // ‖F(u^{k+1})‖ / ‖F(u^k)‖, k = 0, 1, ..., as long as ‖F(u^k)‖ > 0; for superlinear convergence they tend to 0.
  std::vector<double> Quotients() const;
};

// How laplace_iteration computed its kernel, summed over all step lengths.
struct KernelRecord {
  Index blocks_by_recursion = 0;  // from φ-functions
  Index blocks_by_contour = 0;
  Index contours = 0;
  Index factorizations = 0;  // of zI - A, one for each node of a contour
  double contour_error = 0;  // largest difference between contours and recursion found, relative to the largest block
  std::string fallback;      // why contours were given up; empty if they were not
};

// How wu_chen_iteration integrated.
struct ContourRecord {
  Index nodes = 0;  // P; 0 where no eigenvalue was left to a contour
  double gamma = 0;
  double mu = 0;
  double step = 0;          // Δv
  std::string choice;       // the source of the parameters: "Theorem 2.2", "Remark 2.4", "given"
  double sector_angle = 0;  // α of the eigenvalues that the contour serves
  double log10_error = 0;   // log10 of the expected error of the source term
  Index separated = 0;      // eigenvalues outside the sector, integrated by φ-functions instead (Remark 2.1)
};

struct Solution {
  Termination termination = Termination::kNotSolved;
  // One or two sentences: what happened, where, and what to do about it.
  std::string message = "Solve() was not called.";
  // The time at which the solve failed; NaN if it did not.
  double failure_time = std::numeric_limits<double>::quiet_NaN();

  Method method = Method::kAuto;  // the one that ran
  std::string reason;             // why that one
  std::vector<std::string> warnings;

  // Trajectory up to T, or up to the failure: column k is at times[k]. y and w at time 0 and at break points are the
  // right limits, at T the left ones; x at a jump is the state after it. w = N x + g + M y (nonlinear: g(t, x, y)) of
  // this x and y; for event_driven w comes from its steps, with exactly w_i = 0 for active i and y_i = 0 for the
  // others.
  std::vector<double> times;
  Matrix x;  // m × times
  Matrix y;  // n × times
  Matrix w;  // n × times
  std::vector<StateJump> jumps;
  std::vector<LeftLimit> left_limits;  // in the order of time; none at 0
  // Absent if there is no interpolant between the nodes (output times only, a nonlinear problem, wu_chen_iteration with
  // splines), and for event_driven, whose polynomials are in `pieces`.
  std::optional<DenseOutput> dense_output;
  std::vector<TrajectoryPiece> pieces;  // one after the other from 0 on; with Options::keep_pieces

  std::vector<MeasurementResult> measurements;  // those of the problem
  // Outputs that reached their limits, one sentence each. If there are any, the solve is not a success.
  std::vector<std::string> reached_limits;

  // The largest |x_i|, |y_i| and |w_i| at all nodes, those that are not output times too; empty where that is not
  // known.
  LargestValues largest;
  double step = 0;  // the longest step of the grid
  Accuracy accuracy;
  Certificate certificate;
  Cost cost;
  std::optional<NewtonRecord> newton;          // with StepSolver::kNewton
  std::vector<SwitchFlip> flips;
  std::vector<SwitchingTime> switching_times;  // of event_driven, in order
  PropagatorRecord propagator;
  std::optional<KernelRecord> kernel;      // of laplace_iteration
  std::optional<ContourRecord> contour;    // of wu_chen_iteration
  std::optional<FlowRecord> flow;          // of event_driven, with Options::keep_flow
  std::optional<PeriodicRecord> periodic;  // with Options::period
};

// "REACHED_END", "INFEASIBLE", ...
const char* TerminationName(Termination termination);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_SOLUTION_H_
