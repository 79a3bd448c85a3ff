// SPDX-License-Identifier: Apache-2.0
// How a problem is to be solved.

#ifndef DLCS_CORE_PROBLEM_OPTIONS_H_
#define DLCS_CORE_PROBLEM_OPTIONS_H_

#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/problem/accuracy.h"
#include "core/types.h"

namespace dlcs {

enum class Method { kAuto, kLaplaceIteration, kWuChenIteration, kExponentialIntegrator, kTimeStepping, kEventDriven };
// "laplace-iteration", "time-stepping", ...
const char* MethodName(Method method);

// How time_stepping solves a step: one LCP(q, M^h) with x⁺ substituted, or the generalized Newton method (3.3) of
// Chen & Xiang with one LCP(N u + g, M) an iteration.
enum class StepSolver { kSubstitution, kNewton };

// How laplace_iteration computes the blocks of its kernel (core/laplace/kernel.h): from φ-functions of hA, or by
// inverting the transfer function N (zI - A)⁻¹ B on contours. kAuto takes the cheaper way.
enum class KernelSource { kAuto, kPhiFunctions, kContour };

// How x0, f and y are propagated to N x; core/propagator/README.md is the reference. kAuto chooses by the structure and
// the size of A. If the problem does not allow the given kind, the solve is refused (kUnsupported).
enum class PropagatorKind {
  kAuto,
  kDense,         // dense matrix functions of A: any A of moderate size
  kKroneckerSum,  // A diagonalized factor by factor, N (zI - A)⁻¹ B a short sum of exponentials for each slow mode
  kContour,  // N (zI - A)⁻¹ B inverted on contours, a sparse factorization per node: large sparse A, few constraints
  kSparseStepping,     // one sparse factorization of I - h(1-θ)A per step length; time_stepping only
  kIterativeStepping,  // Krylov iterations with multigrid instead: sparse A whose factors fill; time_stepping only
};

// How wu_chen_iteration interpolates y and f between the nodes (Remark 2.5 of [Wu & Chen]).
enum class Interpolation { kLinear, kCubicSpline };

// The parameters of the contour (2.2) of wu_chen_iteration: those of Theorem 2.2, or those optimized for the sector of
// the spectrum as in Remark 2.4. kAuto takes Theorem 2.2 if the sector allows it.
enum class ContourChoice { kAuto, kTheorem22, kRemark24 };

// The absolute tolerance of one component.
struct ComponentTolerance {
  Component component;
  double tolerance = 0;
};

struct Options {
  Method method = Method::kAuto;

  // Number of steps over [0, T] before break points and output times are added as nodes; no step of the grid is longer
  // than T / num_steps. 0: not set. A grid for which neither steps nor nodes are set has kDefaultSteps steps.
  Index num_steps = 0;
  static constexpr Index kDefaultSteps = 1000;
  // A grid of more nodes is beyond every machine; a mistyped step should not be tried.
  static constexpr Index kMaxSteps = 1'000'000'000;
  // A step length instead of a number of steps: T / step is rounded up. At most one of the two is set.
  double step = 0;
  // The nodes themselves, increasing, in [0, T], instead of a number of steps or a length. 0, T, break points and
  // output times are added. All steps of one length share one matrix function, so a grid with J different lengths costs
  // J of them.
  std::vector<double> grid_times;

  // The largest allowed error of each state, y_i, w_i and output, relative to its largest value on [0, T];
  // core/context/sizes.h has the definition. event_driven controls its steps by it. For other methods the step comes
  // from trial solves
  // (core/driver/step_control.h); the solution holds the estimated error, and says if the tolerance was not reached.
  // With a tolerance a grid only gives the output times. 0: if a grid is set, its steps are used; if not, the tolerance
  // is kDefaultErrorTolerance, with at most the work of MaxDefaultSteps() steps (eight times that for event_driven if
  // its pace is enough for T), and missing it is not a failure.
  double error_tolerance = 0;
  static constexpr double kDefaultErrorTolerance = 1e-6;
  static constexpr Index kMaxDefaultSteps = 30'000;
  // The same for a problem with break points, each of which adds a step to every grid.
  static constexpr Index MaxDefaultSteps(std::size_t break_points) {
    return kMaxDefaultSteps / kDefaultSteps * (kDefaultSteps + static_cast<Index>(break_points));
  }
  static constexpr double kMinErrorTolerance = 1e-13;  // below it rounding dominates

  // An error of a component of at most this is accepted, too: of all components (`atol` of SciPy, with error_tolerance
  // as `rtol`), and of single ones, which replaces that. Each is finite and at least 0; in the unit of the component.
  std::optional<double> absolute_tolerance;
  std::vector<ComponentTolerance> absolute_tolerances;

  // Whether steps or nodes are set.
  bool has_grid() const { return num_steps > 0 || step > 0 || !grid_times.empty(); }

  // Times in [0, T], in increasing order, that must be nodes of the grid. With output_times_only the
  // solution holds just these; otherwise every node.
  std::vector<double> output_times;
  bool output_times_only = false;

  // event_driven: keep the polynomials of its steps (Solution::pieces), 13 (m + 2n) numbers each, for dense output
  // (core/event_driven/interpolant.h). Other methods need only their nodes for it.
  bool keep_pieces = false;
  // event_driven: keep dx(T)/dx(0) (Solution::flow).
  bool keep_flow = false;

  // Find the periodic steady state with this period, x(0) = x(period), instead of following the solution from x0. The
  // search starts from x0, and the period takes the place of T (core/periodic/periodic.h). kFindPeriod: finds the
  // period too, of an autonomous oscillation. 0: solve from x0.
  double period = 0;
  static constexpr double kFindPeriod = -1;

  // time_stepping: θ of (1.3) in [Chen & Xiang 2013]: 0 is implicit, 1/2 trapezoidal in x, 1 explicit in x. (Many texts
  // call this 1 - θ.)
  double theta = 0;
  // time_stepping: how a step is solved. Newton's method needs y to be a function of x. It converges for 3hκ < 1
  // (Theorem 3.2); a step for which it does not converge is solved by substitution, and the solution says so.
  StepSolver step_solver = StepSolver::kSubstitution;
  // time_stepping: the trapezoidal rule in x, y and f, of second order, in place of (1.3); θ must be 0 or 1/2. Only if
  // y is a Lipschitz function of x: otherwise y would oscillate, y⁺ = -y + ....
  bool average_y = false;

  // laplace_iteration: steps per window. 0 chooses and adapts windows; kWholeHorizon takes the longest
  // possible (from break point to break point) and reports divergence instead of shrinking it; any other
  // value is a fixed width, reported likewise.
  Index window_steps = 0;
  static constexpr Index kWholeHorizon = -1;

  // laplace_iteration: the number of windows that are iterated at the same time, 1 to 64. A window starts from the
  // current iterate of the window before it, and is accepted after that one has converged. This needs fewer iterations
  // in sequence, with more LCPs in each. Always 1 if y is not a Lipschitz function of x, and with acceleration.
  Index windows_in_flight = 1;

  // laplace_iteration: blocks of the kernel by φ-functions or by contours. Contours are checked, and replaced by
  // φ-functions if they are not accurate for the spectrum; KernelRecord in the solution says what was done.
  KernelSource kernel = KernelSource::kAuto;

  // laplace_iteration: depth of Anderson acceleration, at most 20; 0 is the plain iteration of [Wu & Chen].
  int acceleration = 0;

  PropagatorKind propagator = PropagatorKind::kAuto;
  // The memory that a solve may allocate, in bytes, including the trajectory. If the prediction is larger, the solve is
  // refused before anything is allocated.
  double max_memory = 8e9;

  // Tolerance of the iterations: the estimated remaining change of N x + g (laplace_iteration) or x
  // (wu_chen_iteration), relative to its size.
  double iteration_tolerance = 1e-12;
  // Iterations allowed per window. 0 takes 300 for windows that can shrink and 1000 for those that cannot.
  Index max_iterations = 0;

  // wu_chen_iteration: the contour (2.2). num_contour_nodes is P >= 1 (2P + 1 nodes, P + 1 resolvents).
  // Values of 0 take the parameters of `contour`; Theorem 2.2 has γ = 0.794, μ = √P/4, Δv = 2.06/√P.
  Index num_contour_nodes = 25;
  ContourChoice contour = ContourChoice::kAuto;
  double contour_gamma = 0;
  double contour_mu = 0;
  double contour_step = 0;
  // wu_chen_iteration: e^{At} x0 by the hyperbola of Remark 2.3 instead of a matrix exponential.
  bool contour_for_initial_state = false;
  // wu_chen_iteration: cubic splines through the nodes between two break points are of fourth order where y and f are
  // smooth, and no better than straight lines across a kink of y.
  Interpolation interpolation = Interpolation::kLinear;

  // An inconsistent state, at 0 or at a break point, is projected (the state jumps) instead of refused.
  bool project_initial_state = false;

  // Systems of relative degree two (M = 0, N B = 0: y acts on N x + g through two integrations, as a contact force acts
  // on a gap) are refused, because their solutions need impulses. With this, they are solved as inelastic impacts
  // (core/stepping/inelastic_impact.h), which is an additional law, not part of the system.
  bool inelastic_impact = false;

  // If steps are given: whether to estimate the error by solves with twice and four times the step
  // (core/driver/error_control.h), for three quarters of the cost of the solve. If memory does not allow it, the
  // solution says so.
  bool estimate_error = true;

  // Upper limit of threads; 0 takes all. The bits of the result do not depend on it.
  int num_threads = 0;
};

// The rule of an option that is a number: it lies between `least` and `most`, or has its default.
struct OptionRange {
  const char* field;
  std::variant<Index Options::*, int Options::*, double Options::*> value;
  double least, most;
  const char* words;                // completes "must be"
  const char* otherwise = nullptr;  // the values that mean something else
};
inline constexpr double kAboveZero = std::numeric_limits<double>::denorm_min();
inline constexpr double kMostFinite = std::numeric_limits<double>::max();
inline constexpr double kUnlimited = std::numeric_limits<double>::infinity();
inline constexpr double kBelowOne = 1 - std::numeric_limits<double>::epsilon() / 2;

// The rules of single options, for every door. Those that concern several of them are in Validate().
inline constexpr OptionRange kOptionRanges[] = {
    {"num_steps", &Options::num_steps, 1, Options::kMaxSteps, "between 1 and 1000000000", "0 for the default"},
    {"step", &Options::step, kAboveZero, kMostFinite, "a number above 0", "0 for the default"},
    {"error_tolerance", &Options::error_tolerance, Options::kMinErrorTolerance, kBelowOne, "at least 1e-13 and below 1",
     "0 for none"},
    {"theta", &Options::theta, 0, 1, "between 0 and 1"},
    {"window_steps", &Options::window_steps, Options::kWholeHorizon, kUnlimited, "at least 1",
     "0 to adapt, or -1 for the whole horizon"},
    // More windows would be computed in vain.
    {"windows_in_flight", &Options::windows_in_flight, 1, 64, "between 1 and 64"},
    {"iteration_tolerance", &Options::iteration_tolerance, kAboveZero, 1, "above 0 and at most 1"},
    // Differences of more iterates are dependent to working precision.
    {"acceleration", &Options::acceleration, 0, 20, "between 0 and 20"},
    {"max_iterations", &Options::max_iterations, 1, kUnlimited, "at least 1", "0 for the default"},
    // The contour is exact to rounding with a few hundred nodes.
    {"num_contour_nodes", &Options::num_contour_nodes, 1, 1e4, "between 1 and 10000"},
    {"contour_gamma", &Options::contour_gamma, kAboveZero, std::numbers::pi / 2 * kBelowOne, "above 0 and below pi/2",
     "0 for the default"},
    {"contour_mu", &Options::contour_mu, kAboveZero, kMostFinite, "a number above 0", "0 for the default"},
    {"contour_step", &Options::contour_step, kAboveZero, kMostFinite, "a number above 0", "0 for the default"},
    {"max_memory", &Options::max_memory, kAboveZero, kUnlimited, "above 0 bytes"},
    {"num_threads", &Options::num_threads, 0, kUnlimited, "at least 0"},
};

// What Options::max_memory allows, in words that name its option: "the 8e+09 allowed (...)". It may be a server's.
std::string MemoryLimitText(const Options& options);

// Every rule that `options` break for a problem with this `horizon`; with a period times are checked against that, and
// core/problem/source_periods.h checks the period itself. Violations name the fields as above.
std::vector<Violation> Validate(const Options& options, double horizon);

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_OPTIONS_H_
