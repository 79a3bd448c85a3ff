// SPDX-License-Identifier: Apache-2.0

#include "core/context/consistency.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/discretization/step_sources.h"
#include "core/lcp/basis/tolerance.h"
#include "core/lcp/lcp.h"
#include "core/problem/mass_matrix.h"

namespace dlcs {
namespace {

// Raises context.starts.row_size to what w is summed from at the start of a smooth interval; the first time also to
// what |g| comes to on [0, T], seen at its kinks and, where it has formulas, at ProbeTimes(). What is not finite there
// is seen by the steps.
void RaiseRowSize(SolveContext& context, const Eigen::Ref<const Vector>& g, const Eigen::Ref<const Vector>& x,
                  const Eigen::Ref<const Vector>& y) {
  constexpr std::size_t kMaxKinks = 256;
  const Problem& problem = context.problem;
  Vector& size = context.starts.row_size;
  const auto raise = [](const Vector& terms, Vector& largest) {
    for (Index i = 0; i < terms.size(); ++i) {
      if (std::isfinite(terms[i])) largest[i] = std::max(largest[i], terms[i]);
    }
  };
  if (size.size() == 0) {
    size = Vector::Zero(problem.num_constraints());
    std::vector<double> times = ProbeTimes(problem);
    const std::vector<double> kinks = KnownKinks(problem);
    for (std::size_t k = 0; k < kinks.size(); k += 1 + kinks.size() / kMaxKinks) times.push_back(kinks[k]);
    times.push_back(problem.horizon);
    Vector value(problem.num_constraints());
    for (const double time : times) {
      context.sources.G(time, Side::kLeft, value);
      raise(value.cwiseAbs(), size);
    }
  }
  raise(problem.N.AbsTimes(x.cwiseAbs()) + g.cwiseAbs() + problem.M.AbsTimes(y.cwiseAbs()), size);
}

struct Jump {
  LcpStatus verdict;
  Vector p;
  Matrix matrix;    // of the LCP
  Vector solution;  // p, μ
};

Jump FindJump(const Problem& problem, const Vector& q, const Vector& tolerance) {
  const Index n = problem.num_constraints();
  Matrix matrix = Matrix::Zero(2 * n, 2 * n);
  matrix.topLeftCorner(n, n) =
      problem.has_mass() ? Matrix(problem.N * SolveMass(problem, problem.B.Dense())) : problem.N * problem.B;
  matrix.topRightCorner(n, n) = problem.M.Dense();
  matrix.bottomLeftCorner(n, n) = -problem.M.Dense().transpose();
  Vector rhs = Vector::Zero(2 * n);
  rhs.head(n) = q;
  Vector tolerances = Vector::Zero(2 * n);
  tolerances.head(n) = tolerance;
  Basis basis(2 * n, 0);
  Vector solution(2 * n);
  Jump jump;
  jump.verdict = MakeLcpSolver(matrix, Selection::kAny)->Solve(rhs, tolerances, basis, solution);
  jump.p = solution.head(n);
  jump.matrix = std::move(matrix);
  jump.solution = std::move(solution);
  return jump;
}

// The derivative of the state after `jump` by that before: the positive entries of p and μ solve a linear system.
Matrix DerivativeOf(const Problem& problem, const Jump& jump) {
  const Index n = problem.num_constraints();
  std::vector<Index> positive;
  for (Index i = 0; i < jump.solution.size(); ++i) {
    if (jump.solution[i] > 0) positive.push_back(i);
  }
  const auto size = static_cast<Index>(positive.size());
  Matrix system(size, size), of_state = Matrix::Zero(size, problem.num_states());
  for (Index i = 0; i < size; ++i) {
    const Index row = positive[static_cast<std::size_t>(i)];
    for (Index j = 0; j < size; ++j) system(i, j) = jump.matrix(row, positive[static_cast<std::size_t>(j)]);
    if (row < n) of_state.row(i) = problem.N.Dense().row(row);
  }
  // Singular where constraints depend on each other: then p is not unique, and B p is.
  const Matrix moved = -system.completeOrthogonalDecomposition().solve(of_state);
  Matrix p = Matrix::Zero(n, problem.num_states());
  for (Index i = 0; i < size; ++i) {
    if (const Index row = positive[static_cast<std::size_t>(i)]; row < n) p.row(row) = moved.row(i);
  }
  const Matrix identity = Matrix::Identity(problem.num_states(), problem.num_states());
  return identity + SolveMass(problem, problem.B * p);
}

// Makes `solver` if needed, calls `solve` with it, and keeps it if it is small.
template <typename Solve>
LcpStatus SolveStart(const Problem& problem, const SolutionChoice& choice, std::unique_ptr<LcpSolver>& solver,
                     const Solve& solve) {
  constexpr Index kSmall = 64;
  if (!solver) solver = MakeLcpSolver(problem.M, choice);
  const LcpStatus verdict = solve(*solver);
  if (problem.num_constraints() > kSmall) solver.reset();
  return verdict;
}

// Whether LCP(q, M) has a solution, for a positive semidefinite M.
LcpStatus HasSolution(SolveContext& context, const Vector& q, const Vector& tolerance) {
  if (context.matrix_class.zero) {
    if (!q.allFinite()) return LcpStatus::kNonFinite;
    return (q.array() >= -tolerance.array()).all() ? LcpStatus::kSolved : LcpStatus::kInfeasible;
  }
  context.starts.last_basis.resize(static_cast<std::size_t>(q.size()), 0);
  Vector y = Vector::Zero(q.size());
  return SolveStart(context.problem, Selection::kAny, context.starts.any_solver, [&](LcpSolver& solver) {
    return context.starts.successors.Solve(solver, q, tolerance, context.starts.last_basis, y);
  });
}

// The selected solution of LCP(q, M); zero where there is none.
LcpStatus Select(SolveContext& context, const Vector& q, const Vector& tolerance, Eigen::Ref<Vector> y) {
  const Problem& problem = context.problem;
  Basis basis(problem.num_constraints(), 0);
  ++context.solution.cost.lcps;
  const LcpStatus verdict = SolveStart(problem, context.choice(), context.starts.selecting_solver,
                                       [&](LcpSolver& solver) { return solver.Solve(q, tolerance, basis, y); });
  if (verdict != LcpStatus::kSolved) y.setZero();
  return verdict;
}

std::string FormatVector(const Vector& v) {
  constexpr Index kShown = 8;
  std::string text = "(";
  for (Index i = 0; i < std::min(v.size(), kShown); ++i) text += (i ? ", " : "") + FormatNumber(v[i]);
  return text + (v.size() > kShown ? ", ...)" : ")");
}

// The entry that is furthest below zero in units of what is allowed there, for messages.
std::string WorstEntry(const Vector& q, const Vector& tolerance) {
  Index worst = 0;
  for (Index i = 1; i < q.size(); ++i) {
    if (q[i] * tolerance[worst] < q[worst] * tolerance[i]) worst = i;
  }
  return "(N x + g)[" + std::to_string(worst) + "] = " + FormatNumber(q[worst]) + ", below -" +
         FormatNumber(tolerance[worst]);
}

}  // namespace

bool StartInterval(SolveContext& context, double time, const Eigen::Ref<const Vector>& g, Eigen::Ref<Vector> x,
                   Eigen::Ref<Vector> y, bool& y_is_solution) {
  const Problem& problem = context.problem;
  Vector q = problem.N * x + g;
  RaiseRowSize(context, g, x, y);
  // At a break point the state carries the rounding errors of all previous steps.
  const Vector tolerance = (time == 0 ? 1 : 16) * kLcpTolerance * context.starts.row_size;
  y.setZero();
  y_is_solution = false;

  if (context.y_is_function()) {
    const LcpStatus verdict = Select(context, q, tolerance, y);
    y_is_solution = verdict == LcpStatus::kSolved;
    if (y_is_solution) return true;
    const bool may_jump = !context.y_is_lipschitz() && verdict == LcpStatus::kInfeasible;
    if (!may_jump) {
      if (verdict == LcpStatus::kInfeasible && context.matrix_class.positive_semidefinite.yes()) {
        return context.FailLostLeastElement(time);
      }
      return FailLcp(context, verdict, time, "LCP(N x + g, M)");
    }
  }

  if (!context.matrix_class.positive_semidefinite.yes()) return true;
  // Of several solutions only the coupled step knows the one that continues, so y stays zero.
  const LcpStatus verdict = HasSolution(context, q, tolerance);
  ++context.solution.cost.lcps;
  if (verdict == LcpStatus::kSolved) return true;
  if (verdict == LcpStatus::kNonFinite) return FailLcp(context, verdict, time, "LCP(N x + g, M)");

  const Jump jump = FindJump(problem, q, tolerance);
  ++context.solution.cost.lcps;
  const std::string at = "at t = " + FormatNumber(time);
  if (jump.verdict != LcpStatus::kSolved) {
    return context.Fail(Termination::kInfeasible, time,
                        "LCP(N x + g, M) " + at + " has no solution (" + WorstEntry(q, tolerance) +
                            "), and no jump of the state along B can make it consistent.");
  }
  const Vector dx = SolveMass(problem, problem.B * jump.p);
  // Then N x + g itself is complementary to a multiplier: what failed was the LCP solver.
  if (((problem.N * dx).array().abs() <= tolerance.array()).all()) return true;
  if (!context.options.project_initial_state) {
    return context.Fail(Termination::kInconsistentState, time,
                        "The state " + at + " is inconsistent: LCP(N x + g, M) has no solution (" +
                            WorstEntry(q, tolerance) + "). It must jump by dx = " + FormatVector(dx) + " first; " +
                            (time == 0 ? "allow the projection of the initial state, or start from a "
                                         "consistent state."
                                       : "allow the projection of inconsistent states at break points, "
                                         "as it does for the initial state."));
  }
  x += dx;
  context.solution.jumps.push_back({time, dx, jump.p});
  if (context.options.keep_flow) context.starts.jump_derivative = DerivativeOf(problem, jump);
  if (context.y_is_function()) {
    q = problem.N * x + g;
    RaiseRowSize(context, g, x, y);
    y_is_solution = Select(context, q, kLcpTolerance * context.starts.row_size, y) == LcpStatus::kSolved;
  }
  return true;
}

}  // namespace dlcs
