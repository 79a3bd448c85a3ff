// SPDX-License-Identifier: Apache-2.0
#include "server/convert.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>
#include <variant>

#include "fmt/format.h"

namespace dlcs {
namespace {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Doubles = google::protobuf::RepeatedField<double>;

Vector VectorFromProto(const Doubles& values) {
  return Eigen::Map<const Vector>(values.data(), values.size());
}

// Appends the entries of a vector or, column after column, of a matrix.
template <typename Dense>
void Append(const Dense& dense, Doubles& values) {
  values.Reserve(values.size() + static_cast<int>(dense.size()));
  for (Index column = 0; column < dense.cols(); ++column) {
    for (Index row = 0; row < dense.rows(); ++row) values.AddAlreadyReserved(dense(row, column));
  }
}

// A list of values as `size` rows, component fastest.
Matrix ColumnsFromProto(const Doubles& values, Index size, const std::string& field,
                        std::vector<Violation>& violations) {
  if (size == 0 ? !values.empty() : values.size() % size != 0) {
    violations.push_back(
        {field, fmt::format("{} values; must be a multiple of the {} components", values.size(), size)});
    return Matrix();
  }
  return Eigen::Map<const Matrix>(values.data(), size, size == 0 ? 0 : values.size() / size);
}

TimePiece TimePieceFromProto(const v1::TimePiece& piece, Index size, const std::string& field,
                             std::vector<Violation>& violations) {
  switch (piece.kind_case()) {
    case v1::TimePiece::kConstant:
      return ConstantFunction{VectorFromProto(piece.constant().values())};
    case v1::TimePiece::kFormulas:
      return FormulaFunction{{piece.formulas().formulas().begin(), piece.formulas().formulas().end()}};
    case v1::TimePiece::kSamples: {
      const v1::SampledFunction& samples = piece.samples();
      return SampledFunction{{samples.times().begin(), samples.times().end()},
                             ColumnsFromProto(samples.values(), size, field + ".samples", violations)};
    }
    case v1::TimePiece::kPolynomial: {
      PiecewisePolynomial result;
      result.breaks.assign(piece.polynomial().breaks().begin(), piece.polynomial().breaks().end());
      for (int p = 0; p < piece.polynomial().coefficients_size(); ++p) {
        result.coefficients.push_back(
            ColumnsFromProto(piece.polynomial().coefficients(p).values(), size,
                             fmt::format("{}.polynomial.coefficients[{}]", field, p), violations));
      }
      return result;
    }
    case v1::TimePiece::KIND_NOT_SET:
      break;
  }
  violations.push_back({field, "no function; set one of constant, formulas, samples, polynomial"});
  return ConstantFunction{Vector()};
}

Method MethodFromProto(v1::Method method, std::vector<Violation>& violations) {
  switch (method) {
    case v1::METHOD_UNSPECIFIED:
      return Method::kAuto;
    case v1::METHOD_LAPLACE_ITERATION:
      return Method::kLaplaceIteration;
    case v1::METHOD_PAPER_ITERATION:
      return Method::kPaperIteration;
    case v1::METHOD_EXPONENTIAL_MARCH:
      return Method::kExponentialMarch;
    case v1::METHOD_TIME_STEPPING:
      return Method::kTimeStepping;
    default:
      break;
  }
  violations.push_back({"method", fmt::format("{}; this server does not know such a method (see "
                                              "GetCapabilities)",
                                              static_cast<int>(method))});
  return Method::kAuto;
}

v1::SolutionRule ToProto(SolutionRule rule) {
  switch (rule) {
    case SolutionRule::kAuto:
      return v1::SOLUTION_RULE_UNSPECIFIED;
    case SolutionRule::kUnique:
      return v1::SOLUTION_RULE_UNIQUE;
    case SolutionRule::kLeastElement:
      return v1::SOLUTION_RULE_LEAST_ELEMENT;
    case SolutionRule::kHiddenLeastElement:
    case SolutionRule::kLeastNorm:
    case SolutionRule::kMinimiser:
      break;  // not on the wire yet
  }
  return v1::SOLUTION_RULE_UNSPECIFIED;
}

v1::LcpVerdict ToProto(LcpVerdict verdict) {
  switch (verdict) {
    case LcpVerdict::kSolved:
      return v1::LCP_SOLVED;
    case LcpVerdict::kInfeasible:
      return v1::LCP_INFEASIBLE;
    case LcpVerdict::kRay:
      return v1::LCP_RAY;
    case LcpVerdict::kPivotLimit:
      return v1::LCP_PIVOT_LIMIT;
    case LcpVerdict::kSingular:
      return v1::LCP_SINGULAR;
    case LcpVerdict::kNonFinite:
      return v1::LCP_NON_FINITE;
  }
  return v1::LCP_VERDICT_UNSPECIFIED;
}

v1::Certificate ToProto(const Certificate& certificate) {
  v1::Certificate result;
  result.set_node_residual(certificate.node_residual);
  result.set_midpoint_residual(certificate.midpoint_residual);
  result.set_node_complementarity(certificate.node_complementarity);
  result.set_midpoint_complementarity(certificate.midpoint_complementarity);
  result.set_ode_defect(certificate.ode_defect);
  result.set_lcp_scale(certificate.lcp_scale);
  result.set_ode_scale(certificate.ode_scale);
  result.set_x_scale(certificate.x_scale);
  if (certificate.estimated_error_x) result.set_estimated_error_x(*certificate.estimated_error_x);
  if (certificate.estimated_error_By) result.set_estimated_error_by(*certificate.estimated_error_By);
  return result;
}

v1::Cost ToProto(const Cost& cost) {
  v1::Cost result;
  result.set_steps(cost.steps);
  result.set_windows(cost.windows);
  result.set_iterations(cost.iterations);
  result.set_lcps(cost.lcps);
  result.set_marched_steps(cost.marched_steps);
  result.set_seconds_setup(cost.seconds_setup);
  result.set_seconds_lcp(cost.seconds_lcp);
  result.set_seconds_linear(cost.seconds_linear);
  result.set_seconds_total(cost.seconds_total);
  return result;
}

}  // namespace

Matrix MatrixFromProto(const v1::Matrix& matrix, const std::string& field,
                       std::vector<Violation>& violations) {
  if (!matrix.has_dense()) {
    violations.push_back({field, "not set; a dense matrix is required"});
    return Matrix();
  }
  const v1::DenseMatrix& dense = matrix.dense();
  const Index rows = dense.rows();
  const Index columns = dense.columns();
  if (rows < 0 || columns < 0) {
    violations.push_back({field, fmt::format("{} x {}; the shape must not be negative", rows, columns)});
    return Matrix();
  }
  if (dense.values_size() != rows * columns) {
    violations.push_back({field, fmt::format("{} values; {} x {} needs {}", dense.values_size(), rows,
                                             columns, rows * columns)});
    return Matrix();
  }
  return Eigen::Map<const RowMajorMatrix>(dense.values().data(), rows, columns);
}

TimeFunction TimeFunctionFromProto(const v1::TimeFunction& function, Index size, const std::string& field,
                                   std::vector<Violation>& violations) {
  TimeFunction result;
  if (function.pieces().empty()) violations.push_back({field, "not set; at least one piece is required"});
  for (int p = 0; p < function.pieces_size(); ++p) {
    const v1::TimePiece& piece = function.pieces(p);
    result.pieces.push_back(
        {piece.start(), TimePieceFromProto(piece, size, fmt::format("{}.pieces[{}]", field, p), violations)});
  }
  return result;
}

SolutionRule RuleFromProto(v1::SolutionRule rule, std::vector<Violation>& violations) {
  switch (rule) {
    case v1::SOLUTION_RULE_UNSPECIFIED:
      return SolutionRule::kAuto;
    case v1::SOLUTION_RULE_UNIQUE:
      return SolutionRule::kUnique;
    case v1::SOLUTION_RULE_LEAST_ELEMENT:
      return SolutionRule::kLeastElement;
    default:
      break;
  }
  violations.push_back(
      {"rule", fmt::format("{}; this server does not know such a rule (0 automatic, 1 unique, "
                           "2 least element)",
                           static_cast<int>(rule))});
  return SolutionRule::kAuto;
}

Problem ProblemFromProto(const v1::Problem& problem, std::vector<Violation>& violations) {
  Problem result;
  result.A = MatrixFromProto(problem.a(), "A", violations);
  result.B = MatrixFromProto(problem.b(), "B", violations);
  result.N = MatrixFromProto(problem.n(), "N", violations);
  result.M = MatrixFromProto(problem.m(), "M", violations);
  // Declared shapes, so that a matrix with a wrong number of values does not make the functions look wrong
  // too.
  result.f = TimeFunctionFromProto(problem.f(), std::max(0, problem.a().dense().rows()), "f", violations);
  result.g = TimeFunctionFromProto(problem.g(), std::max(0, problem.m().dense().rows()), "g", violations);
  result.x0 = VectorFromProto(problem.x0());
  result.horizon = problem.horizon();
  result.break_points.assign(problem.break_points().begin(), problem.break_points().end());
  result.rule = RuleFromProto(problem.rule(), violations);
  return result;
}

Options OptionsFromProto(const v1::SolveOptions& options, std::vector<Violation>& violations) {
  Options result;
  result.method = MethodFromProto(options.method(), violations);
  if (options.has_steps()) {
    result.num_steps = options.steps();
    if (options.steps() <= 0) {
      violations.push_back({"steps", fmt::format("{}; must be at least 1 (unset takes {})", options.steps(),
                                                 Options::kDefaultSteps)});
    }
  } else if (options.has_step()) {
    result.step = options.step();
    if (!(options.step() > 0) || !std::isfinite(options.step())) {
      violations.push_back({"step", fmt::format("{}; must be positive and finite (unset takes {} steps)",
                                                options.step(), Options::kDefaultSteps)});
    }
  } else if (options.has_grid_times()) {
    result.grid_times.assign(options.grid_times().times().begin(), options.grid_times().times().end());
    if (result.grid_times.empty()) violations.push_back({"grid_times", "no times; must hold at least one"});
  }
  result.output_times.assign(options.output_times().begin(), options.output_times().end());
  result.output_times_only = !result.output_times.empty();
  result.theta = options.theta();
  result.window_steps = options.window_steps();
  if (options.tolerance() != 0) result.tolerance = options.tolerance();
  result.max_iterations = options.max_iterations();
  const v1::Contour& contour = options.contour();
  if (contour.nodes() != 0) result.num_contour_nodes = contour.nodes();
  result.contour_gamma = contour.gamma();
  result.contour_mu = contour.mu();
  result.contour_step = contour.step();
  result.contour_for_initial_state = contour.for_initial_state();
  result.project_initial_state = options.project_initial_state();
  result.inelastic_impact = options.inelastic_impact();
  result.estimate_error = options.estimate_error();
  result.num_threads = options.threads();
  return result;
}

v1::Matrix ToProto(const Matrix& matrix) {
  v1::Matrix result;
  v1::DenseMatrix& dense = *result.mutable_dense();
  dense.set_rows(static_cast<int>(matrix.rows()));
  dense.set_columns(static_cast<int>(matrix.cols()));
  Append(matrix.transpose(), *dense.mutable_values());
  return result;
}

v1::TimeFunction ToProto(const TimeFunction& function) {
  v1::TimeFunction result;
  for (const TimeFunction::Piece& piece : function.pieces) {
    v1::TimePiece& out = *result.add_pieces();
    out.set_start(piece.start);
    std::visit(
        [&out](const auto& kind) {
          using Kind = std::decay_t<decltype(kind)>;
          if constexpr (std::is_same_v<Kind, ConstantFunction>) {
            Append(kind.value, *out.mutable_constant()->mutable_values());
          } else if constexpr (std::is_same_v<Kind, FormulaFunction>) {
            out.mutable_formulas()->mutable_formulas()->Add(kind.formulas.begin(), kind.formulas.end());
          } else if constexpr (std::is_same_v<Kind, SampledFunction>) {
            out.mutable_samples()->mutable_times()->Add(kind.times.begin(), kind.times.end());
            Append(kind.values, *out.mutable_samples()->mutable_values());
          } else {
            static_assert(std::is_same_v<Kind, PiecewisePolynomial>);
            out.mutable_polynomial()->mutable_breaks()->Add(kind.breaks.begin(), kind.breaks.end());
            for (const Matrix& coefficients : kind.coefficients) {
              Append(coefficients, *out.mutable_polynomial()->add_coefficients()->mutable_values());
            }
          }
        },
        piece.function);
  }
  return result;
}

v1::Problem ToProto(const Problem& problem) {
  v1::Problem result;
  *result.mutable_a() = ToProto(problem.A);
  *result.mutable_b() = ToProto(problem.B);
  *result.mutable_n() = ToProto(problem.N);
  *result.mutable_m() = ToProto(problem.M);
  *result.mutable_f() = ToProto(problem.f);
  *result.mutable_g() = ToProto(problem.g);
  Append(problem.x0, *result.mutable_x0());
  result.set_horizon(problem.horizon);
  result.mutable_break_points()->Add(problem.break_points.begin(), problem.break_points.end());
  result.set_rule(ToProto(problem.rule));
  return result;
}

v1::SolveOptions ToProto(const Options& options) {
  v1::SolveOptions result;
  result.set_method(ToProto(options.method));
  if (options.num_steps != 0) result.set_steps(options.num_steps);
  if (options.step != 0) result.set_step(options.step);
  if (!options.grid_times.empty()) {
    result.mutable_grid_times()->mutable_times()->Add(options.grid_times.begin(), options.grid_times.end());
  }
  result.mutable_output_times()->Add(options.output_times.begin(), options.output_times.end());
  result.set_theta(options.theta);
  result.set_window_steps(options.window_steps);
  result.set_tolerance(options.tolerance);
  result.set_max_iterations(options.max_iterations);
  v1::Contour& contour = *result.mutable_contour();
  contour.set_nodes(static_cast<int>(options.num_contour_nodes));
  contour.set_gamma(options.contour_gamma);
  contour.set_mu(options.contour_mu);
  contour.set_step(options.contour_step);
  contour.set_for_initial_state(options.contour_for_initial_state);
  result.set_project_initial_state(options.project_initial_state);
  result.set_inelastic_impact(options.inelastic_impact);
  result.set_estimate_error(options.estimate_error);
  result.set_threads(options.num_threads);
  return result;
}

v1::Method ToProto(Method method) {
  switch (method) {
    case Method::kAuto:
      return v1::METHOD_UNSPECIFIED;
    case Method::kLaplaceIteration:
      return v1::METHOD_LAPLACE_ITERATION;
    case Method::kPaperIteration:
      return v1::METHOD_PAPER_ITERATION;
    case Method::kExponentialMarch:
      return v1::METHOD_EXPONENTIAL_MARCH;
    case Method::kTimeStepping:
      return v1::METHOD_TIME_STEPPING;
  }
  return v1::METHOD_UNSPECIFIED;
}

v1::Termination ToProto(Termination termination) {
  switch (termination) {
    case Termination::kNotSolved:
      return v1::TERMINATION_UNSPECIFIED;
    case Termination::kConverged:
      return v1::CONVERGED;
    case Termination::kInfeasible:
      return v1::INFEASIBLE;
    case Termination::kDiverged:
      return v1::DIVERGED;
    case Termination::kIterationLimit:
      return v1::ITERATION_LIMIT;
    case Termination::kInconsistentState:
      return v1::INCONSISTENT_STATE;
    case Termination::kUnsupported:
      return v1::UNSUPPORTED;
    case Termination::kNonFinite:
      return v1::NON_FINITE;
    case Termination::kCancelled:
      return v1::CANCELLED;
  }
  return v1::TERMINATION_UNSPECIFIED;
}

v1::Analysis ToProto(const AnalysisReport& report) {
  v1::Analysis result;
  result.set_matrix_class(report.matrix_class);
  result.set_method(ToProto(report.method));
  result.set_reason(report.reason);
  result.set_states(static_cast<int>(report.num_states));
  result.set_constraints(static_cast<int>(report.num_constraints));
  result.set_steps(report.num_steps);
  result.set_step(report.step);
  if (report.lipschitz) result.set_lipschitz(*report.lipschitz);
  result.mutable_warnings()->Add(report.warnings.begin(), report.warnings.end());
  return result;
}

v1::WindowStarted ToProto(const WindowReport& report) {
  v1::WindowStarted result;
  result.set_window(report.window);
  result.set_begin(report.begin);
  result.set_end(report.end);
  result.set_steps(report.steps);
  return result;
}

v1::Iterate ToProto(const IterateReport& report) {
  v1::Iterate result;
  result.set_window(report.window);
  result.set_iteration(report.iteration);
  result.set_change(report.change);
  result.set_lcp_residual(report.lcp_residual);
  if (report.log10_bound) result.set_log10_bound(*report.log10_bound);
  result.set_seconds(report.seconds);
  return result;
}

v1::WindowFinished ToProto(const WindowOutcome& outcome) {
  v1::WindowFinished result;
  result.set_window(outcome.window);
  result.set_end(outcome.end);
  result.set_iterations(outcome.iterations);
  result.set_accepted(outcome.accepted);
  result.set_marched(outcome.marched);
  result.set_why(outcome.why);
  return result;
}

v1::SolveLcpResponse ToProto(const LcpResult& lcp) {
  v1::SolveLcpResponse result;
  result.set_verdict(ToProto(lcp.verdict));
  Append(lcp.y, *result.mutable_y());
  Append(lcp.w, *result.mutable_w());
  result.set_residual(lcp.residual);
  result.set_pivots(lcp.pivots);
  result.set_method(lcp.method);
  result.set_message(lcp.message);
  return result;
}

v1::TrajectoryChunk ChunkToProto(const Solution& solution, Index first, Index count) {
  v1::TrajectoryChunk result;
  result.set_first(first);
  result.mutable_times()->Add(solution.times.begin() + first, solution.times.begin() + first + count);
  Append(solution.x.middleCols(first, count), *result.mutable_x());
  Append(solution.y.middleCols(first, count), *result.mutable_y());
  return result;
}

v1::Summary SummaryToProto(const Solution& solution) {
  v1::Summary result;
  result.set_termination(ToProto(solution.termination));
  result.set_message(solution.message);
  if (!std::isnan(solution.failure_time)) result.set_failure_time(solution.failure_time);
  result.set_method(ToProto(solution.method));
  result.set_reason(solution.reason);
  result.mutable_warnings()->Add(solution.warnings.begin(), solution.warnings.end());
  for (const StateJump& jump : solution.jumps) {
    v1::StateJump& out = *result.add_jumps();
    out.set_time(jump.time);
    Append(jump.dx, *out.mutable_dx());
    Append(jump.multiplier, *out.mutable_multiplier());
  }
  result.set_step(solution.step);
  *result.mutable_certificate() = ToProto(solution.certificate);
  *result.mutable_cost() = ToProto(solution.cost);
  result.set_times(static_cast<Index>(solution.times.size()));
  return result;
}

std::string WireOptionName(const std::string& core_field) {
  static constexpr std::pair<const char*, const char*> kNames[] = {
      {"num_steps", "steps"},
      {"num_threads", "threads"},
      {"num_contour_nodes", "contour.nodes"},
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
