// SPDX-License-Identifier: Apache-2.0
// One step for a large sparse A without factors of it: Krylov iterations, pairs by active sets.

#ifndef DLCS_CORE_STEPPING_ITERATIVE_STEP_H_
#define DLCS_CORE_STEPPING_ITERATIVE_STEP_H_

#include <memory>
#include <string>
#include <vector>

#include "core/discretization/step_rule.h"
#include "core/lcp/structured/bounded_solver.h"
#include "core/linalg/norms.h"
#include "core/parallel/parallel.h"
#include "core/parallel/team.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/stepping/iterative_system.h"

namespace dlcs {

// A step (E - sA) x = r + w B y, 0 <= y ⟂ N x + g + M y >= 0 as one sparse system with bounds,
// core/lcp/structured/bounded_solver.h, so that nothing dense of size n × n or m × n is ever made. Every pair is one
// of two kinds:
//
// - Row i and column i of M are zero, and N and B have one entry ν and β in the same state c, νβ > 0: an obstacle.
//   The state c is bounded by -g_i/ν, and y_i is the residual of its row.
// - M_ii > 0: y_i is an unknown z_{m+k} >= 0 beside the states, with the equation D_i (N x + M y + g)_i = 0 where it is
//   positive. D_i = -w B_ci / N_ic if all entries agree on it: then the system is symmetric where A and DM are, and
//   conjugate gradients solve it.
//
// With a mass matrix E the states are scaled, x = S z with S_cc = E_cc^{-1/2}, and so are the equations: rows of small
// elements then count as much as those of large ones.
//
// Other pairs are not served, and no E with a diagonal that is not positive. An active set leaves a principal part of
// one matrix, for which multigrid is as good as for the whole: fixed unknowns are Dirichlet points of a grid, the
// others are points like all states.
class IterativeStep {
 public:
  // The least tolerance, which rounding always permits: a residual relative to the largest x or y and their terms. Most
  // steps would reach a quarter of it, and four times as much is still below the default of the iteration tolerance.
  static constexpr double kLeastTolerance = 2e-13;
  // The tolerance of each step if there are `steps`: a hundredth of the error tolerance, divided among them. If steps
  // are given, it is the iteration tolerance.
  static double ToleranceFor(const Options& options, Index steps);

  // Why a problem is not served; empty if it is. Called by all processes of a team that distributes steps. Cost: the
  // entries of B, N and M.
  static std::string WhyNot(const Problem& problem);
  static constexpr const char* kNoPositiveMass = "the diagonal of E is not positive";

  // For a problem that is served; it must outlive the step. `tolerance`: the relative residual of a step. Cost: that of
  // core/linalg/sparse/multigrid_solver.h.
  IterativeStep(const Problem& problem, double step, SparseRule rule, double theta, Workers& workers,
                double tolerance = kLeastTolerance);
  // With a solver of `system`, whose K is not used. Where rows are distributed over a team, all vectors are those of
  // this process, with its states first; only the norms are those of the whole system.
  IterativeStep(const StepRule& rule, IterativeSystem system, std::unique_ptr<BoundedSolver> solver, Team& team,
                double tolerance = kLeastTolerance);

  const StepRule& rule() const { return rule_; }
  const BoundedSolver& solver() const { return *solver_; }

  // z, scaled states and then unknowns y; and the multipliers of all bounds: w_i or y_i in the units of the system.
  struct State {
    Vector z, multipliers;
  };
  // The state at a node where x, y and g are known.
  State StateOf(const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y,
                const Eigen::Ref<const Vector>& g) const;

  // Solves for `state`, which holds a guess, with r = `right`. The verdict is that of BoundedSolver::Solve(): kSolved
  // only where the equations hold to the tolerance, and the signs; kPivotLimit where a pair is wrong beside its terms.
  LcpStatus Solve(const Vector& right, const Eigen::Ref<const Vector>& g, State& state);
  Vector StatesOf(const State& state) const;  // x
  Vector PairsOf(const State& state) const;   // y
  // max |z_i| over all processes.
  double SizeOf(const Vector& z) const { return team_.Max(MaxAbs(z)); }

 private:
  void Prepare();
  // Whether no pair is grossly wrong beside its own terms. The solver has one tolerance for all rows, and where those
  // of some pairs are many orders smaller than those of others, it sees nothing of them. Not looked at where rows are
  // distributed.
  bool HoldsInEachPair(const State& state, const Eigen::Ref<const Vector>& g) const;

  StepRule rule_;
  double tolerance_;
  IterativeSystem system_;  // without K
  std::unique_ptr<BoundedSolver> solver_;
  Team& team_;
  Vector right_, bounds_;
  Vector sizes_of_N_, sizes_of_M_;  // sums of |N_ij| and |M_ij| over each row
};

}  // namespace dlcs

#endif  // DLCS_CORE_STEPPING_ITERATIVE_STEP_H_
