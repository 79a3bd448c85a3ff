// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <iterator>
#include <limits>
#include <set>

#include "core/problem/verdict.h"
#include "server/wire/convert.h"
#include "server/wire/convert_dense.h"

namespace dlcs {
namespace {

// Limit of lists in a summary, which is a single message.
constexpr int kMaxListedSwitchings = 10000;
constexpr Index kMaxErrors = 10000;
constexpr int kMaxNamed = 1000;

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
  return result;
}

v1::AccuracySource ToProto(AccuracySource source) {
  switch (source) {
    case AccuracySource::kNotEstimated:
      return v1::ACCURACY_SOURCE_UNSPECIFIED;
    case AccuracySource::kCompared:
      return v1::ACCURACY_SOURCE_COMPARED;
    case AccuracySource::kControlled:
      return v1::ACCURACY_SOURCE_CONTROLLED;
  }
  return v1::ACCURACY_SOURCE_UNSPECIFIED;
}

v1::Knowledge ToProto(Knowledge knowledge) {
  switch (knowledge) {
    case Knowledge::kZero:
      return v1::KNOWLEDGE_ZERO;
    case Knowledge::kNegligible:
      return v1::KNOWLEDGE_NEGLIGIBLE;
    case Knowledge::kMissed:
      return v1::KNOWLEDGE_MISSED;
    case Knowledge::kKnown:
    case Knowledge::kGiven:
      break;
  }
  return v1::KNOWLEDGE_UNSPECIFIED;
}

v1::NamedComponent ToProto(const NamedComponent& named) {
  v1::NamedComponent result;
  result.set_name(named.name);
  result.set_knowledge(ToProto(named.knowledge));
  result.set_size(named.own);
  result.set_truncation(named.truncation);
  result.set_rounding(named.rounding);
  result.set_allowed(named.allowed);
  result.set_digits(named.digits);
  result.set_beside(named.beside_name);
  result.set_beside_size(named.beside_own);
  return result;
}

v1::Accuracy ToProto(const Accuracy& accuracy) {
  v1::Accuracy result;
  result.set_source(ToProto(accuracy.source));
  if (!std::isnan(accuracy.error)) result.set_error(accuracy.error);
  result.set_tolerance(accuracy.tolerance);
  result.set_tolerance_is_default(accuracy.tolerance_is_default);
  std::array<std::set<Index>, std::size(kComponentKinds)> small;
  for (const NamedComponent& named : accuracy.named) {
    if (named.knowledge != Knowledge::kMissed) {
      small[static_cast<std::size_t>(named.component.kind)].insert(named.component.index);
    }
  }
  const auto append = [&](ComponentKind kind, google::protobuf::RepeatedField<double>& relative) {
    const ErrorsByCause& errors = accuracy.errors.of(kind);
    const std::set<Index>& left_out = small[static_cast<std::size_t>(kind)];
    for (Index i = 0; i < std::min(errors.size(), kMaxErrors); ++i) {
      const double error = left_out.contains(i) ? 0 : errors.truncation[i] + errors.rounding[i];
      relative.Add(error == 0 ? 0 : error / errors.own[i]);
    }
  };
  append(ComponentKind::kState, *result.mutable_errors_x());
  append(ComponentKind::kPair, *result.mutable_errors_y());
  append(ComponentKind::kSlack, *result.mutable_errors_w());
  append(ComponentKind::kOutput, *result.mutable_errors_outputs());
  for (const NamedComponent& named : accuracy.named) {
    if (result.named_size() == kMaxNamed) break;
    *result.add_named() = ToProto(named);
  }
  result.set_note(accuracy.note);
  return result;
}

v1::VerdictKind ToProto(VerdictKind kind) {
  switch (kind) {
    case VerdictKind::kSolved:
      return v1::VERDICT_KIND_SOLVED;
    case VerdictKind::kErrorEstimated:
      return v1::VERDICT_KIND_ERROR_ESTIMATED;
    case VerdictKind::kErrorUnknown:
      return v1::VERDICT_KIND_ERROR_UNKNOWN;
    case VerdictKind::kNotSolved:
      return v1::VERDICT_KIND_NOT_SOLVED;
  }
  return v1::VERDICT_KIND_UNSPECIFIED;
}

v1::Verdict ToProto(const Verdict& verdict) {
  v1::Verdict result;
  result.set_kind(ToProto(verdict.kind));
  result.set_success(verdict.success);
  result.set_text(verdict.text);
  result.mutable_concerns()->Add(verdict.concerns.begin(), verdict.concerns.end());
  result.mutable_notes()->Add(verdict.notes.begin(), verdict.notes.end());
  return result;
}

// A count that the contract holds in 32 bits.
std::int32_t Count(Index count) {
  return static_cast<std::int32_t>(std::min<Index>(count, std::numeric_limits<std::int32_t>::max()));
}

v1::Cost ToProto(const Cost& cost) {
  v1::Cost result;
  result.set_steps(Count(cost.steps));
  result.set_windows(Count(cost.windows));
  result.set_iterations(Count(cost.iterations));
  result.set_lcps(cost.lcps);
  result.set_coupled_steps(Count(cost.coupled_steps));
  result.set_newton_iterations(Count(cost.newton_iterations));
  result.set_most_newton_iterations(Count(cost.most_newton_iterations));
  result.set_substituted_steps(Count(cost.substituted_steps));
  result.set_seconds_setup(cost.seconds_setup);
  result.set_seconds_lcp(cost.seconds_lcp);
  result.set_seconds_linear(cost.seconds_linear);
  result.set_seconds_certificate(cost.seconds_certificate);
  result.set_seconds_total(cost.seconds_total);
  result.set_predicted_bytes(static_cast<std::int64_t>(std::min(cost.predicted_bytes, 9e18)));
  return result;
}

v1::PropagatorRecord ToProto(const PropagatorRecord& record) {
  v1::PropagatorRecord result;
  result.set_used(ToProto(record.used));
  result.set_reason(record.reason);
  result.set_terms(record.terms);
  result.set_factorizations(record.factorizations);
  result.set_error(record.error);
  result.set_linear_iterations(record.linear_iterations);
  result.set_set_changes(record.set_changes);
  return result;
}

v1::NewtonRecord ToProto(const NewtonRecord& record) {
  v1::NewtonRecord result;
  result.set_time(record.time);
  result.mutable_residuals()->Add(record.residuals.begin(), record.residuals.end());
  if (record.contraction) result.set_contraction(*record.contraction);
  return result;
}

v1::KernelRecord ToProto(const KernelRecord& record) {
  v1::KernelRecord result;
  result.set_blocks_by_recursion(record.blocks_by_recursion);
  result.set_blocks_by_contour(record.blocks_by_contour);
  result.set_contours(record.contours);
  result.set_factorizations(record.factorizations);
  result.set_contour_error(record.contour_error);
  result.set_fallback(record.fallback);
  return result;
}

v1::ContourRecord ToProto(const ContourRecord& record) {
  v1::ContourRecord result;
  result.set_nodes(record.nodes);
  result.set_gamma(record.gamma);
  result.set_mu(record.mu);
  result.set_step(record.step);
  result.set_choice(record.choice);
  result.set_sector_angle(record.sector_angle);
  result.set_log10_error(record.log10_error);
  result.set_separated(record.separated);
  return result;
}

v1::Stability ToProto(Stability stability) {
  switch (stability) {
    case Stability::kStable:
      return v1::STABILITY_STABLE;
    case Stability::kUnstable:
      return v1::STABILITY_UNSTABLE;
    case Stability::kUndetermined:
      return v1::STABILITY_UNDETERMINED;
  }
  return v1::STABILITY_UNSPECIFIED;
}

v1::PeriodicSolution ToProto(const PeriodicRecord& record) {
  v1::PeriodicSolution result;
  result.set_period(record.period);
  for (const std::complex<double>& multiplier : record.multipliers) {
    v1::Multiplier& out = *result.add_multipliers();
    out.set_real(multiplier.real());
    out.set_imaginary(multiplier.imag());
  }
  if (record.stability) result.set_stability(ToProto(*record.stability));
  if (!std::isnan(record.growth)) result.set_growth(record.growth);
  Append(record.mean_x, *result.mutable_mean_x());
  Append(record.mean_y, *result.mutable_mean_y());
  Append(record.mean_w, *result.mutable_mean_w());
  if (!std::isnan(record.residual)) result.set_residual(record.residual);
  if (!std::isnan(record.error)) result.set_error(record.error);
  result.set_periods(Count(record.periods));
  result.set_newton_iterations(Count(record.newton_iterations));
  result.set_phase(record.phase);
  Append(record.mean_outputs, *result.mutable_mean_outputs());
  return result;
}

v1::SwitchingKind ToProto(SwitchingKind kind) {
  switch (kind) {
    case SwitchingKind::kStart:
      return v1::SWITCHING_KIND_START;
    case SwitchingKind::kSwitch:
      return v1::SWITCHING_KIND_SWITCH;
    case SwitchingKind::kJump:
      return v1::SWITCHING_KIND_JUMP;
    case SwitchingKind::kBreakPoint:
      return v1::SWITCHING_KIND_BREAK_POINT;
    case SwitchingKind::kCoupledStepsBegin:
      return v1::SWITCHING_KIND_COUPLED_STEPS_BEGIN;
    case SwitchingKind::kCoupledStepsEnd:
      return v1::SWITCHING_KIND_COUPLED_STEPS_END;
  }
  return v1::SWITCHING_KIND_UNSPECIFIED;
}

v1::SwitchingTime ToProto(const SwitchingTime& switching) {
  v1::SwitchingTime result;
  result.set_error(switching.error);
  result.set_time(switching.time);
  result.mutable_entering()->Add(switching.entering.begin(), switching.entering.end());
  result.mutable_leaving()->Add(switching.leaving.begin(), switching.leaving.end());
  result.set_kind(ToProto(switching.kind));
  return result;
}

v1::LeftLimit ToProto(const LeftLimit& limit) {
  v1::LeftLimit result;
  result.set_index(limit.column);
  result.mutable_y()->Add(limit.y.begin(), limit.y.end());
  result.mutable_w()->Add(limit.w.begin(), limit.w.end());
  return result;
}

}  // namespace

v1::Termination ToProto(Termination termination) {
  switch (termination) {
    case Termination::kNotSolved:
      return v1::TERMINATION_UNSPECIFIED;
    case Termination::kReachedEnd:
      return v1::TERMINATION_REACHED_END;
    case Termination::kInfeasible:
      return v1::TERMINATION_INFEASIBLE;
    case Termination::kDiverged:
      return v1::TERMINATION_DIVERGED;
    case Termination::kIterationLimit:
      return v1::TERMINATION_ITERATION_LIMIT;
    case Termination::kInconsistentState:
      return v1::TERMINATION_INCONSISTENT_STATE;
    case Termination::kUnsupported:
      return v1::TERMINATION_UNSUPPORTED;
    case Termination::kNonFinite:
      return v1::TERMINATION_NON_FINITE;
    case Termination::kCancelled:
      return v1::TERMINATION_CANCELLED;
    case Termination::kNotPeriodic:
      return v1::TERMINATION_NOT_PERIODIC;
  }
  return v1::TERMINATION_UNSPECIFIED;
}

v1::Analysis ToProto(const AnalysisReport& report, const ComponentNames& names) {
  v1::Analysis result;
  result.set_matrix_class(report.matrix_class);
  result.set_method(ToProto(report.method));
  result.set_reason(report.reason);
  result.set_states(static_cast<int>(report.num_states));
  result.set_constraints(static_cast<int>(report.num_constraints));
  result.set_steps(report.num_steps);
  result.set_step(report.step);
  if (report.lipschitz) result.set_lipschitz(*report.lipschitz);
  for (const std::string& warning : report.warnings) result.add_warnings(WithNames(warning, names));
  SetNames(names, result);
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
  result.set_coupled(outcome.coupled);
  result.set_reason(outcome.why);
  return result;
}

v1::TrajectoryChunk ChunkToProto(const Solution& solution, Index first, Index count, OutputEvaluator* outputs) {
  v1::TrajectoryChunk result;
  result.set_first(first);
  result.mutable_times()->Add(solution.times.begin() + first, solution.times.begin() + first + count);
  Append(solution.x.middleCols(first, count), *result.mutable_x());
  Append(solution.y.middleCols(first, count), *result.mutable_y());
  Append(solution.w.middleCols(first, count), *result.mutable_w());
  if (outputs != nullptr) {
    Append(outputs->Columns(solution, first, count), *result.mutable_outputs());
    for (const OutputEvaluator::Limit& limit : outputs->LeftLimits(solution, first, count)) {
      v1::LeftLimit& out = *result.add_left_limits();
      out = ToProto(limit.of_solution);
      Append(limit.outputs, *out.mutable_outputs());
    }
    return result;
  }
  for (const LeftLimit& limit : solution.left_limits) {
    if (limit.column >= first && limit.column < first + count) *result.add_left_limits() = ToProto(limit);
  }
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
  *result.mutable_accuracy() = ToProto(solution.accuracy);
  *result.mutable_verdict() = ToProto(JudgeSolution(solution));
  *result.mutable_certificate() = ToProto(solution.certificate);
  *result.mutable_cost() = ToProto(solution.cost);
  result.set_times(static_cast<Index>(solution.times.size()));
  if (solution.newton) *result.mutable_newton() = ToProto(*solution.newton);
  if (solution.kernel) *result.mutable_kernel() = ToProto(*solution.kernel);
  if (solution.contour) *result.mutable_contour() = ToProto(*solution.contour);
  if (solution.periodic) *result.mutable_periodic() = ToProto(*solution.periodic);
  result.set_switchings(static_cast<Index>(solution.switching_times.size()));
  for (const SwitchingTime& switching : solution.switching_times) {
    if (result.switching_times_size() == kMaxListedSwitchings) break;
    *result.add_switching_times() = ToProto(switching);
  }
  *result.mutable_propagator() = ToProto(solution.propagator);
  for (const MeasurementResult& measured : solution.measurements) *result.add_measurements() = ToProto(measured);
  return result;
}

}  // namespace dlcs
