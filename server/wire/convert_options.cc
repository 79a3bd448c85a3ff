// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "fmt/format.h"
#include "server/wire/component_names.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

Method MethodFromProto(v1::Method method, std::vector<Violation>& violations) {
  switch (method) {
    case v1::METHOD_UNSPECIFIED:
      return Method::kAuto;
    case v1::METHOD_LAPLACE_ITERATION:
      return Method::kLaplaceIteration;
    case v1::METHOD_WU_CHEN_ITERATION:
      return Method::kWuChenIteration;
    case v1::METHOD_EXPONENTIAL_INTEGRATOR:
      return Method::kExponentialIntegrator;
    case v1::METHOD_TIME_STEPPING:
      return Method::kTimeStepping;
    case v1::METHOD_EVENT_DRIVEN:
      return Method::kEventDriven;
    default:
      break;
  }
  violations.push_back({"method", fmt::format("{}; this server does not know this method (see "
                                              "GetCapabilities)",
                                              static_cast<int>(method))});
  return Method::kAuto;
}

// The violation for an unknown enumerator, listing the known ones.
Violation Unknown(const char* field, int number, const char* known) {
  return {field, fmt::format("{}; this server does not know it ({})", number, known)};
}

StepSolver StepSolverFromProto(v1::StepSolver step_solver, std::vector<Violation>& violations) {
  switch (step_solver) {
    case v1::STEP_SOLVER_UNSPECIFIED:
    case v1::STEP_SOLVER_SUBSTITUTION:
      return StepSolver::kSubstitution;
    case v1::STEP_SOLVER_NEWTON:
      return StepSolver::kNewton;
    default:
      break;
  }
  violations.push_back(Unknown("step_solver", step_solver, "1 substitution, 2 Newton's method"));
  return StepSolver::kSubstitution;
}

v1::StepSolver ToProto(StepSolver step_solver) {
  switch (step_solver) {
    case StepSolver::kSubstitution:
      return v1::STEP_SOLVER_SUBSTITUTION;
    case StepSolver::kNewton:
      return v1::STEP_SOLVER_NEWTON;
  }
  return v1::STEP_SOLVER_UNSPECIFIED;
}

KernelSource KernelFromProto(v1::KernelSource kernel, std::vector<Violation>& violations) {
  switch (kernel) {
    case v1::KERNEL_SOURCE_UNSPECIFIED:
      return KernelSource::kAuto;
    case v1::KERNEL_SOURCE_PHI_FUNCTIONS:
      return KernelSource::kPhiFunctions;
    case v1::KERNEL_SOURCE_CONTOUR:
      return KernelSource::kContour;
    default:
      break;
  }
  violations.push_back(Unknown("kernel", kernel, "0 the cheaper, 1 phi-functions, 2 contour"));
  return KernelSource::kAuto;
}

v1::KernelSource ToProto(KernelSource kernel) {
  switch (kernel) {
    case KernelSource::kAuto:
      return v1::KERNEL_SOURCE_UNSPECIFIED;
    case KernelSource::kPhiFunctions:
      return v1::KERNEL_SOURCE_PHI_FUNCTIONS;
    case KernelSource::kContour:
      return v1::KERNEL_SOURCE_CONTOUR;
  }
  return v1::KERNEL_SOURCE_UNSPECIFIED;
}

Interpolation InterpolationFromProto(v1::Interpolation interpolation, std::vector<Violation>& violations) {
  switch (interpolation) {
    case v1::INTERPOLATION_UNSPECIFIED:
    case v1::INTERPOLATION_LINEAR:
      return Interpolation::kLinear;
    case v1::INTERPOLATION_CUBIC_SPLINE:
      return Interpolation::kCubicSpline;
    default:
      break;
  }
  violations.push_back(Unknown("interpolation", interpolation, "1 linear, 2 cubic spline"));
  return Interpolation::kLinear;
}

v1::Interpolation ToProto(Interpolation interpolation) {
  switch (interpolation) {
    case Interpolation::kLinear:
      return v1::INTERPOLATION_LINEAR;
    case Interpolation::kCubicSpline:
      return v1::INTERPOLATION_CUBIC_SPLINE;
  }
  return v1::INTERPOLATION_UNSPECIFIED;
}

ContourChoice ContourChoiceFromProto(v1::ContourChoice choice, std::vector<Violation>& violations) {
  switch (choice) {
    case v1::CONTOUR_CHOICE_UNSPECIFIED:
      return ContourChoice::kAuto;
    case v1::CONTOUR_CHOICE_THEOREM_2_2:
      return ContourChoice::kTheorem22;
    case v1::CONTOUR_CHOICE_REMARK_2_4:
      return ContourChoice::kRemark24;
    default:
      break;
  }
  violations.push_back(Unknown("contour.choice", choice, "0 automatic, 1 Theorem 2.2, 2 Remark 2.4"));
  return ContourChoice::kAuto;
}

v1::ContourChoice ToProto(ContourChoice choice) {
  switch (choice) {
    case ContourChoice::kAuto:
      return v1::CONTOUR_CHOICE_UNSPECIFIED;
    case ContourChoice::kTheorem22:
      return v1::CONTOUR_CHOICE_THEOREM_2_2;
    case ContourChoice::kRemark24:
      return v1::CONTOUR_CHOICE_REMARK_2_4;
  }
  return v1::CONTOUR_CHOICE_UNSPECIFIED;
}

PropagatorKind PropagatorFromProto(v1::PropagatorKind propagator, std::vector<Violation>& violations) {
  switch (propagator) {
    case v1::PROPAGATOR_KIND_UNSPECIFIED:
      return PropagatorKind::kAuto;
    case v1::PROPAGATOR_KIND_DENSE:
      return PropagatorKind::kDense;
    case v1::PROPAGATOR_KIND_KRONECKER_SUM:
      return PropagatorKind::kKroneckerSum;
    case v1::PROPAGATOR_KIND_CONTOUR:
      return PropagatorKind::kContour;
    case v1::PROPAGATOR_KIND_SPARSE_STEPPING:
      return PropagatorKind::kSparseStepping;
    case v1::PROPAGATOR_KIND_ITERATIVE_STEPPING:
      return PropagatorKind::kIterativeStepping;
    default:
      break;
  }
  violations.push_back(
      Unknown("propagator", propagator,
              "0 automatic, 1 dense, 2 Kronecker sum, 3 contour, 4 sparse stepping, 5 iterative stepping"));
  return PropagatorKind::kAuto;
}

}  // namespace

v1::PropagatorKind ToProto(PropagatorKind propagator) {
  switch (propagator) {
    case PropagatorKind::kAuto:
      return v1::PROPAGATOR_KIND_UNSPECIFIED;
    case PropagatorKind::kDense:
      return v1::PROPAGATOR_KIND_DENSE;
    case PropagatorKind::kKroneckerSum:
      return v1::PROPAGATOR_KIND_KRONECKER_SUM;
    case PropagatorKind::kContour:
      return v1::PROPAGATOR_KIND_CONTOUR;
    case PropagatorKind::kSparseStepping:
      return v1::PROPAGATOR_KIND_SPARSE_STEPPING;
    case PropagatorKind::kIterativeStepping:
      return v1::PROPAGATOR_KIND_ITERATIVE_STEPPING;
  }
  return v1::PROPAGATOR_KIND_UNSPECIFIED;
}

namespace {

// The absolute tolerances of single components, each of which must be there, once.
std::vector<ComponentTolerance> TolerancesFromProto(const v1::SolveOptions& options, const ComponentNames& names,
                                                    Index m, Index n, std::vector<Violation>& violations) {
  std::vector<ComponentTolerance> result;
  bool has_unknown = false;
  for (int k = 0; k < options.absolute_tolerances_size(); ++k) {
    const v1::ComponentTolerance& given = options.absolute_tolerances(k);
    const std::string field = fmt::format("absolute_tolerances[{}]", k);
    const std::optional<Component> component = ComponentNamed(given.name(), names, m, n);
    if (!component) {
      // The names are listed once.
      const bool is_first = !std::exchange(has_unknown, true);
      violations.push_back(
          {field + ".name", is_first ? NoComponentNamed(given.name(), names, m, n)
                                     : fmt::format("{}; is no state, pair or output either", Quoted(given.name()))});
      continue;
    }
    const auto same = [&](const ComponentTolerance& other) { return other.component == *component; };
    if (std::any_of(result.begin(), result.end(), same)) {
      violations.push_back({field + ".name", fmt::format("{}; given twice; keep one of them", Quoted(given.name()))});
    }
    result.push_back({*component, given.tolerance()});
  }
  return result;
}

}  // namespace

Options OptionsFromProto(const v1::SolveOptions& options, const ComponentNames& names, Index m, Index n,
                         std::vector<Violation>& violations) {
  Options result;
  result.method = MethodFromProto(options.method(), violations);
  if (options.has_steps()) {
    result.num_steps = options.steps();
    if (options.steps() <= 0) {
      violations.push_back({"steps", fmt::format("{}; must be at least 1", options.steps())});
    }
  } else if (options.has_step()) {
    result.step = options.step();
    if (!(options.step() > 0) || !std::isfinite(options.step())) {
      violations.push_back({"step", fmt::format("{}; must be positive and finite", options.step())});
    }
  } else if (options.has_grid_times()) {
    result.grid_times.assign(options.grid_times().times().begin(), options.grid_times().times().end());
    if (result.grid_times.empty()) violations.push_back({"grid_times", "no times; must hold at least one"});
  }
  result.error_tolerance = options.error_tolerance();
  if (options.has_absolute_tolerance()) result.absolute_tolerance = options.absolute_tolerance();
  result.absolute_tolerances = TolerancesFromProto(options, names, m, n, violations);
  result.output_times.assign(options.output_times().begin(), options.output_times().end());
  result.output_times_only = !result.output_times.empty();
  result.theta = options.theta();
  result.step_solver = StepSolverFromProto(options.step_solver(), violations);
  result.average_y = options.average_y();
  result.window_steps = options.window_steps();
  result.kernel = KernelFromProto(options.kernel(), violations);
  result.acceleration = options.acceleration();
  if (options.windows_in_flight() != 0) result.windows_in_flight = options.windows_in_flight();
  result.propagator = PropagatorFromProto(options.propagator(), violations);
  if (options.max_memory_bytes() != 0) result.max_memory = options.max_memory_bytes();
  if (options.iteration_tolerance() != 0) result.iteration_tolerance = options.iteration_tolerance();
  result.max_iterations = options.max_iterations();
  const v1::Contour& contour = options.contour();
  if (contour.nodes() != 0) result.num_contour_nodes = contour.nodes();
  result.contour_gamma = contour.gamma();
  result.contour_mu = contour.mu();
  result.contour_step = contour.step();
  result.contour = ContourChoiceFromProto(contour.choice(), violations);
  result.contour_for_initial_state = contour.for_initial_state();
  result.interpolation = InterpolationFromProto(options.interpolation(), violations);
  result.project_initial_state = options.project_initial_state();
  result.inelastic_impact = options.inelastic_impact();
  if (options.has_estimate_error()) result.estimate_error = options.estimate_error();
  result.period = options.period();
  result.num_threads = options.threads();
  return result;
}

v1::SolveOptions ToProto(const Options& options, const ComponentNames& names) {
  const Options defaults;
  v1::SolveOptions result;
  result.set_method(ToProto(options.method));
  if (options.num_steps != 0) result.set_steps(options.num_steps);
  if (options.step != 0) result.set_step(options.step);
  if (!options.grid_times.empty()) {
    result.mutable_grid_times()->mutable_times()->Add(options.grid_times.begin(), options.grid_times.end());
  }
  result.set_error_tolerance(options.error_tolerance);
  if (options.absolute_tolerance) result.set_absolute_tolerance(*options.absolute_tolerance);
  for (const ComponentTolerance& given : options.absolute_tolerances) {
    v1::ComponentTolerance& of_component = *result.add_absolute_tolerances();
    of_component.set_name(DisplayName(given.component, names));
    of_component.set_tolerance(given.tolerance);
  }
  result.mutable_output_times()->Add(options.output_times.begin(), options.output_times.end());
  result.set_theta(options.theta);
  if (options.step_solver != defaults.step_solver) result.set_step_solver(ToProto(options.step_solver));
  result.set_average_y(options.average_y);
  result.set_window_steps(options.window_steps);
  result.set_kernel(ToProto(options.kernel));
  result.set_acceleration(options.acceleration);
  if (options.windows_in_flight != defaults.windows_in_flight) result.set_windows_in_flight(options.windows_in_flight);
  result.set_propagator(ToProto(options.propagator));
  if (options.max_memory != defaults.max_memory) result.set_max_memory_bytes(options.max_memory);
  if (options.iteration_tolerance != defaults.iteration_tolerance) {
    result.set_iteration_tolerance(options.iteration_tolerance);
  }
  result.set_max_iterations(options.max_iterations);
  v1::Contour contour;
  if (options.num_contour_nodes != defaults.num_contour_nodes) {
    contour.set_nodes(static_cast<int>(options.num_contour_nodes));
  }
  contour.set_gamma(options.contour_gamma);
  contour.set_mu(options.contour_mu);
  contour.set_step(options.contour_step);
  contour.set_for_initial_state(options.contour_for_initial_state);
  contour.set_choice(ToProto(options.contour));
  if (contour.ByteSizeLong() > 0) *result.mutable_contour() = contour;
  if (options.interpolation != defaults.interpolation) result.set_interpolation(ToProto(options.interpolation));
  result.set_project_initial_state(options.project_initial_state);
  result.set_inelastic_impact(options.inelastic_impact);
  if (!options.estimate_error) result.set_estimate_error(false);
  result.set_period(options.period);
  result.set_threads(options.num_threads);
  return result;
}

v1::Method ToProto(Method method) {
  switch (method) {
    case Method::kAuto:
      return v1::METHOD_UNSPECIFIED;
    case Method::kLaplaceIteration:
      return v1::METHOD_LAPLACE_ITERATION;
    case Method::kWuChenIteration:
      return v1::METHOD_WU_CHEN_ITERATION;
    case Method::kExponentialIntegrator:
      return v1::METHOD_EXPONENTIAL_INTEGRATOR;
    case Method::kTimeStepping:
      return v1::METHOD_TIME_STEPPING;
    case Method::kEventDriven:
      return v1::METHOD_EVENT_DRIVEN;
  }
  return v1::METHOD_UNSPECIFIED;
}

std::string WireOptionName(const std::string& core_field) {
  static constexpr std::pair<const char*, const char*> kNames[] = {
      {"num_steps", "steps"},
      {"num_threads", "threads"},
      {"max_memory", "max_memory_bytes"},
      {"num_contour_nodes", "contour.nodes"},
      {"contour", "contour.choice"},
      {"contour_gamma", "contour.gamma"},
      {"contour_mu", "contour.mu"},
      {"contour_step", "contour.step"},
      {"contour_for_initial_state", "contour.for_initial_state"},
  };
  const std::size_t bracket = std::min(core_field.find('['), core_field.size());
  for (const auto& [core_name, wire_name] : kNames) {
    if (core_field.compare(0, bracket, core_name) == 0) return wire_name + core_field.substr(bracket);
  }
  return core_field;
}

}  // namespace dlcs
