// SPDX-License-Identifier: Apache-2.0
#include "core/context/checkpointing.h"

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/parallel/team.h"

namespace dlcs {
namespace {

// Must be increased whenever the state that a method stores changes, or the bits of the results computed from it.
constexpr Index kVersion = 4;
// The oldest version whose states are read. It has no largest values of components.
constexpr Index kOldestVersion = 3;

// Identifies a solve, so that the state of another one is refused.
std::vector<Index> Fingerprint(const SolveContext& context) {
  return {kVersion,
          static_cast<Index>(context.solution.method),
          static_cast<Index>(context.selection),
          static_cast<Index>(context.solution.propagator.used),
          context.problem.num_states(),
          context.problem.num_constraints(),
          context.grid.num_steps(),
          static_cast<Index>(context.grid.output_nodes.size())};
}

}  // namespace

// What the structs of a solve consist of, for StateArchive.

void CarryFields(StateArchive& state, Certificate& c) {
  state(c.node_residual, c.midpoint_residual, c.node_complementarity, c.midpoint_complementarity, c.ode_defect,
        c.lcp_scale, c.ode_scale, c.x_scale, c.node_residual_of_rows, c.midpoint_residual_of_rows, c.drift_of_rows);
}
void CarryFields(StateArchive& state, CertificateRows& rows) {
  state(rows.x_size, rows.y_size, rows.w_size, rows.f_size, rows.g_size, rows.node_residual, rows.midpoint_residual,
        rows.drift, rows.largest_drift);
}
void CarryFields(StateArchive& state, Cost& c) {
  state(c.steps, c.windows, c.iterations, c.lcps, c.coupled_steps, c.newton_iterations, c.most_newton_iterations,
        c.substituted_steps, c.seconds_setup, c.seconds_lcp, c.seconds_linear, c.seconds_certificate);
}
void CarryFields(StateArchive& state, StateJump& jump) { state(jump.time, jump.dx, jump.multiplier); }
void CarryFields(StateArchive& state, LeftLimit& limit) { state(limit.column, limit.y, limit.w); }
void CarryFields(StateArchive& state, DenseOutput& dense) { state(dense.x_is_linear, dense.y_is_linear); }
void CarryFields(StateArchive& state, KernelRecord& kernel) {
  state(kernel.blocks_by_recursion, kernel.blocks_by_contour, kernel.contours, kernel.factorizations,
        kernel.contour_error, kernel.fallback);
}

namespace {

// Stores or restores everything in the context that changes while a method runs, except the trajectory.
void CarryContext(StateArchive& state, Index version, SolveContext& context) {
  Solution& solution = context.solution;
  Certificate certificate = context.certificate.certificate();
  CertificateRows rows = context.certificate.rows();
  Index recorded = context.recorder.recorded();
  bool has_steps = !context.certificate.empty();
  state(certificate, rows, has_steps, recorded, solution.cost, solution.jumps, solution.left_limits, solution.warnings,
        solution.dense_output, solution.kernel, context.impulses.first);
  if (context.limit_watch) state(solution.reached_limits);
  if (version > kOldestVersion) {
    state(rows.x_largest, rows.y_largest, rows.w_largest);
  } else {
    std::tie(rows.x_largest, rows.y_largest, rows.w_largest) = std::tie(rows.x_size, rows.y_size, rows.w_size);
  }
  if (!state.reads()) return;
  if (has_steps) context.certificate.ResumeFrom(certificate, rows);
  context.recorder.ResumeFrom(recorded);
}

// The column recorded last may still change: where the next segment begins at its node, with a jump.
void CarryLastColumn(StateArchive& state, SolveContext& context) {
  const Index recorded = context.recorder.recorded();
  if (recorded == 0) return;
  Solution& solution = context.solution;
  Vector x = solution.x.col(recorded - 1), y = solution.y.col(recorded - 1), w = solution.w.col(recorded - 1);
  state(x, y, w);
  if (!state.ok()) return;
  solution.x.col(recorded - 1) = x;
  solution.y.col(recorded - 1) = y;
  solution.w.col(recorded - 1) = w;
}

// Sets the context and the method to the state of the resume point. False if it does not fit.
bool Restore(SolveContext& context, const CarryMethod& carry) {
  const ResumePoint& earlier = *context.checkpoints.resume;
  StateArchive state(earlier.state);
  std::vector<Index> fingerprint;
  double seconds = 0;
  state(fingerprint, seconds);
  if (!state.ok() || fingerprint.empty()) return false;
  const Index version = fingerprint.front();
  fingerprint.front() = std::max(version, kVersion);
  if (version < kOldestVersion || fingerprint != Fingerprint(context)) return false;
  CarryContext(state, version, context);
  const Index recorded = context.recorder.recorded();
  const Index parted = context.checkpoints.parted = std::max<Index>(recorded - 1, 0);
  Solution& solution = context.solution;
  const bool fits = state.ok() && recorded <= solution.x.cols() && earlier.x.cols() >= parted &&
                    earlier.y.cols() >= parted && earlier.w.cols() >= parted && earlier.x.rows() == solution.x.rows() &&
                    earlier.y.rows() == solution.y.rows() && earlier.w.rows() == solution.w.rows();
  if (!fits) return false;
  for (Index k = 0; k < recorded; ++k) solution.times[k] = context.grid.times[context.grid.output_nodes[k]];
  solution.x.leftCols(parted) = earlier.x.leftCols(parted);
  solution.y.leftCols(parted) = earlier.y.leftCols(parted);
  solution.w.leftCols(parted) = earlier.w.leftCols(parted);
  CarryLastColumn(state, context);
  carry(state);
  // Seconds count those of all attempts.
  context.started -=
      std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(seconds));
  return state.at_end();
}

}  // namespace

bool ResumeFromCheckpoint(SolveContext& context, const CarryMethod& carry) {
  CheckpointRecord& checkpoints = context.checkpoints;
  if (!checkpoints.resume) return true;
  // A stop while matrices are made again throws, and is no refusal.
  checkpoints.resumed = Restore(context, carry);
  checkpoints.refused = !checkpoints.resumed;
  return checkpoints.resumed;
}

void OfferCheckpoint(SolveContext& context, double time, const CarryMethod& carry) {
  CheckpointRecord& checkpoints = context.checkpoints;
  // The clocks of a team differ.
  if (!checkpoints.makes || !Team::Current().Any(context.observer.WantsCheckpoint())) return;
  const Index stands = std::max<Index>(context.recorder.recorded() - 1, 0);
  const auto make_state = [&context, &carry] {
    StateArchive state;
    std::vector<Index> fingerprint = Fingerprint(context);
    double seconds = context.Seconds();
    state(fingerprint, seconds);
    CarryContext(state, kVersion, context);
    CarryLastColumn(state, context);
    carry(state);
    return state.Take();
  };
  const Index first = std::exchange(checkpoints.parted, stands);
  context.observer.OnCheckpoint(
      {.time = time, .solution = context.solution, .first = first, .count = stands - first, .state = make_state});
}

absl::Status ResumeStatus(const CheckpointRecord& checkpoints, bool stopped) {
  if (!checkpoints.resume || checkpoints.resumed || (stopped && !checkpoints.refused)) return absl::OkStatus();
  return absl::InvalidArgumentError("resume: the state is not one of this problem with these options and this version");
}

}  // namespace dlcs
