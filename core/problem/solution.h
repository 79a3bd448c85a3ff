// SPDX-License-Identifier: Apache-2.0
// What a solve returns: a trajectory with its certificate, or the reason why there is none.

#ifndef DLCS_CORE_PROBLEM_SOLUTION_H_
#define DLCS_CORE_PROBLEM_SOLUTION_H_

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/problem/options.h"
#include "core/types.h"

namespace dlcs {

enum class Termination {
  kNotSolved,          // Solve() was not called
  kReachedEnd,         // the trajectory covers [0, T]; core/problem/verdict.h says how good it is
  kInfeasible,         // an LCP has no solution
  kDiverged,           // the iteration diverged where it was not allowed to shrink its window
  kIterationLimit,     // iterations or pivots ran out
  kInconsistentState,  // N x + g has no complementary y at 0 or at a break point, and no jump was asked for
  kUnsupported,        // the class of the system or the method's conditions
  kNonFinite,          // an infinity or NaN appeared
  kCancelled,          // the stop token was triggered
};

// How well the returned trajectory satisfies the system, measured after the fact. With w = N x + g + M y:
struct Certificate {
  // max over nodes, and over the midpoints of all steps, of ‖min(y, w)‖_∞ and of |yᵀw|. At midpoints x follows
  // the method's own interpolant, y is linear between nodes or constant on the step as in the method.
  double node_residual = std::numeric_limits<double>::quiet_NaN();
  double midpoint_residual = std::numeric_limits<double>::quiet_NaN();
  double node_complementarity = std::numeric_limits<double>::quiet_NaN();
  double midpoint_complementarity = std::numeric_limits<double>::quiet_NaN();
  // max over midpoints of ‖x' - (A x + B y + f)‖_∞ for the method's interpolant of x.
  double ode_defect = std::numeric_limits<double>::quiet_NaN();
  // What the residuals are to be compared with: max over nodes of max(‖y‖_∞, ‖w‖_∞), and max of ‖x'‖_∞.
  double lcp_scale = std::numeric_limits<double>::quiet_NaN();
  double ode_scale = std::numeric_limits<double>::quiet_NaN();
  // The largest ‖x‖_∞.
  double x_scale = std::numeric_limits<double>::quiet_NaN();

  // Row by row, each in its own size: units do not matter. NaN where states are not kept, or a method does not measure
  // them. max over pairs of |min(y_i / size of y_i, w_i / size of w_i)|; sizes are the largest |y_i|, and the largest
  // sum of absolute values that w_i is summed from, over the solve.
  double node_residual_of_rows = std::numeric_limits<double>::quiet_NaN();
  double midpoint_residual_of_rows = std::numeric_limits<double>::quiet_NaN();
  // max over states and nodes of |x_i(t) - x_i(0) - ∫ (A x + B y + f)_i| / max |x_i|, jumps left out, the integral by
  // Simpson's rule on each step: independent of how the steps were made. Of the states that the steps resolve: fast
  // ones, and those that follow others at once, are left out.
  double drift_of_rows = std::numeric_limits<double>::quiet_NaN();
};

// How the error of a trajectory was found.
enum class AccuracySource {
  kNotEstimated,
  kCompared,    // with solves on other grids, for steps that were given
  kControlled,  // steps were chosen by it
};

// How far the trajectory is from the solution, as far as that is known. Errors are the largest over the times, relative
// to the largest value of the component on [0, T], and at least kLeastError.
struct Accuracy {
  static constexpr double kLeastError = 16 * std::numeric_limits<double>::epsilon();

  AccuracySource source = AccuracySource::kNotEstimated;
  double error = std::numeric_limits<double>::quiet_NaN();  // the largest of those below; NaN where it is not known
  // What the steps were chosen for; 0 where they were given. By default: nobody asked for it
  // (Options::error_tolerance).
  double asked = 0;
  bool asked_by_default = false;
  Vector errors_x;   // of each state; empty where `error` alone is known
  Vector errors_By;  // of each component of B y, where y is a Lipschitz function of x
  Vector errors_w;   // of each w_i there, relative to the largest sum of absolute values that it is summed from
  std::string note;  // one sentence: what was compared, or why there is no estimate
};

// The state jumped by `dx` = B p at `time`, with multiplier p >= 0.
struct StateJump {
  double time = 0;
  Vector dx;
  Vector multiplier;
};

// How the method means x and y between two consecutive nodes; core/event_driven/interpolant.h evaluates them.
struct DenseOutput {
  // x: linear; or the exact solution of x' = A x + B y + f for f linear between nodes and y as below.
  bool x_is_linear = false;
  // y: linear; or constant, equal to y_j on (t_{j-1}, t_j].
  bool y_is_linear = false;
};

// y(t⁻) and w(t⁻) at times[column], where the limits of y differ, or at a break point those of w: the trajectory itself
// holds the limits from the right there.
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

// Where indices enter or leave the active set (w_i = 0 while y_i may be positive); at 0 those enter that are active at
// the start.
struct SwitchingTime {
  double time = 0;
  std::vector<Index> entering;  // active from here on, increasing; none is during coupled steps
  std::vector<Index> leaving;   // y_i = 0 from here on
  SwitchingKind kind = SwitchingKind::kSwitch;
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

// How x0, f and y were carried to N x.
struct PropagatorRecord {
  PropagatorKind used = PropagatorKind::kDense;
  std::string reason;
  Index terms = 0;           // exponentials for each slow mode, or nodes of all contours; 0 for dense matrices
  Index factorizations = 0;  // sparse ones
  double error = 0;  // what replacing the transfer function by them may change in N x, relative to its largest value
};

struct Cost {
  Index steps = 0;
  Index windows = 0;       // of the iterations, rejected ones included; 0 for marches
  Index iterations = 0;    // of all windows, rejected ones included
  Index lcps = 0;
  Index marched_steps = 0; // steps of laplace_iteration that had to be marched with LCP(M + K_0)
  Index newton_iterations = 0;       // of all steps
  Index most_newton_iterations = 0;  // of one step
  Index substituted_steps = 0;       // that Newton's method could not solve
  double seconds_setup = 0;
  double seconds_lcp = 0;     // LCPs and propagation overlap in marching methods: then all of it is here
  double seconds_linear = 0;
  double seconds_total = 0;
  double predicted_bytes = 0;  // of everything allocated at the same time, the trajectory included
};

// The step that took Newton's method most iterations: its rate. ‖F(u^k)‖_∞ falls superlinearly for 3hκ < 1; F is
// piecewise linear, so that the last iteration lands on the solution (rounding remains).
struct NewtonRecord {
  double time = 0;                // the end of the step
  std::vector<double> residuals;  // ‖F(u^k)‖_∞, k = 0, 1, ..., F as in core/stepping/newton_step.h
  // hκ for the longest step: H of (3.1) contracts with this rate (Lemma 3.1). Absent where no κ is known.
  std::optional<double> contraction;

  // ‖F(u^{k+1})‖ / ‖F(u^k)‖, k = 0, 1, ..., as long as ‖F(u^k)‖ > 0; superlinear convergence is quotients that fall to
  // 0.
  std::vector<double> Quotients() const;
};

// How laplace_iteration made its kernel, for all lengths of steps together.
struct KernelRecord {
  Index blocks_by_recursion = 0;  // from φ-functions
  Index blocks_by_contour = 0;
  Index contours = 0;
  Index factorizations = 0;       // of zI - A, one for each node of a contour
  double contour_error = 0;  // largest difference between contours and recursion found, relative to the largest block
  std::string fallback;           // why contours were given up; empty where they were not
};

// How wu_chen_iteration integrated.
struct ContourRecord {
  Index nodes = 0;  // P; 0 where no eigenvalue was left to a contour
  double gamma = 0;
  double mu = 0;
  double step = 0;  // Δv
  std::string choice;          // whose parameters: "Theorem 2.2", "Remark 2.4", "given"
  double sector_angle = 0;     // α of the eigenvalues that the contour serves
  double log10_error = 0;      // the error to expect of the source term, as a power of ten
  Index separated = 0;         // eigenvalues outside the sector, integrated by φ-functions instead (Remark 2.1)
};

struct Solution {
  Termination termination = Termination::kNotSolved;
  // One or two sentences: what happened, where, and what to do about it.
  std::string message = "Solve() was not called.";
  // The time where the mathematics stopped; NaN when it did not.
  double failure_time = std::numeric_limits<double>::quiet_NaN();

  Method method = Method::kAuto;  // the one that ran
  std::string reason;             // why that one
  std::vector<std::string> warnings;

  // Trajectory up to T, or up to the failure: column k is at times[k]. y and w at time 0 and at break points are the
  // right limits, at T the left ones; x at a jump is the state after it. w = N x + g + M y (nonlinear: g(t, x, y)) of
  // this x and y; of event_driven what its step has, with w_i = 0 for the active i and y_i = 0 for the others, bit for
  // bit.
  std::vector<double> times;
  Matrix x;  // m × times
  Matrix y;  // n × times
  Matrix w;  // n × times
  std::vector<StateJump> jumps;
  std::vector<LeftLimit> left_limits;  // in the order of time; none at 0
  // Absent where the trajectory is not dense: output times only, a nonlinear problem, or wu_chen_iteration with
  // splines; and of event_driven, whose polynomials between the nodes are in `pieces`.
  std::optional<DenseOutput> dense_output;
  std::vector<TrajectoryPiece> pieces;  // one after the other from 0 on; with Options::keep_pieces

  double step = 0;  // the longest step of the grid
  Accuracy accuracy;
  Certificate certificate;
  Cost cost;
  std::optional<NewtonRecord> newton;  // with StepSolver::kNewton
  std::vector<SwitchingTime> switching_times;  // of event_driven, in order
  PropagatorRecord propagator;
  std::optional<KernelRecord> kernel;    // of laplace_iteration
  std::optional<ContourRecord> contour;  // of wu_chen_iteration
};

// "REACHED_END", "INFEASIBLE", ...
const char* TerminationName(Termination termination);
// "laplace-iteration", "time-stepping", ...
const char* MethodName(Method method);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_SOLUTION_H_
