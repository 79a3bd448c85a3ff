// SPDX-License-Identifier: Apache-2.0
// Large sparse systems some of whose unknowns are bounded from one side: linear variational inequalities.

#ifndef DLCS_CORE_LCP_STRUCTURED_BOUNDED_SOLVER_H_
#define DLCS_CORE_LCP_STRUCTURED_BOUNDED_SOLVER_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "core/lcp/basis/lcp_solver.h"
#include "core/linalg/sparse/krylov_solver.h"
#include "core/linalg/structured_matrix.h"
#include "core/parallel/parallel.h"
#include "core/types.h"

namespace dlcs {

// An unknown with a bound: sign 1 for a lower bound, -1 for an upper one.
struct BoundedUnknown {
  Index index = 0;
  double sign = 1;
};

struct BoundedSolverCounts {
  Index linear_iterations = 0;
  Index changes = 0;  // of the set of unknowns at their bounds
};

// Solves, for one K and many b and bounds l,
//     (K z - b)_j = 0                                                 for unknowns j without a bound,
//     0 <= s_j (z_j - l_j)  ⟂  s_j (K z - b)_j >= 0                   for those with one, s_j their sign,
// by a primal-dual active set method, which is a semismooth Newton method: the unknowns taken to be at their bounds are
// fixed, the equations of the others are solved by core/linalg/sparse/krylov_solver.h, and unknowns change sides where
// one of the signs is wrong. The set is looked at while the iteration goes on, whenever the residual has fallen by a
// hundred, and changes only beyond the present residual. So a wrong set costs few iterations, and the last solve starts
// near the solution.
//
// For M-matrices K the exact method converges from any start. Otherwise it may cycle, which is seen and reported
// (kPivotLimit). kSolved is only said of a z whose signs and residual were checked.
//
// Source: [Hintermüller, Ito, Kunisch 2002] The primal-dual active set strategy as a semismooth Newton method. SIAM J.
// Optim. 13, 865-888.
class BoundedSolver {
 public:
  BoundedSolver(const SparseMatrix& K, std::vector<BoundedUnknown> bounded, Workers& workers);
  // The same for the system of `linear`, with the diagonal of K in the bounded unknowns. Where its rows are distributed
  // over a team, these are the bounded unknowns of this process, and so are all vectors below.
  BoundedSolver(std::unique_ptr<KrylovSolver> linear, Vector diagonal, std::vector<BoundedUnknown> bounded,
                Workers& workers);

  // `tolerance`   what residuals may be left, absolute; signs are wrong only beyond it.
  // `z`           in: a guess; out: the solution, bounds kept exactly.
  // `multipliers` one for each bounded unknown, in: a guess; out: s_j (K z - b)_j >= 0 at bounds, 0 elsewhere.
  // The guesses decide what is tried first, and not the solution beyond `tolerance` where it is the only one.
  // Returns kSolved, kPivotLimit, kSingular where the equations could not be solved, or kNonFinite. Looks for stop
  // requests.
  LcpStatus Solve(const Vector& b, const Vector& bounds, const ResidualScale& tolerance, Vector& z,
                  Vector& multipliers);

  const BoundedSolverCounts& counts() const { return counts_; }

 private:
  // Iterates until the residual is 1 or has fallen by `factor`.
  LcpStatus Iterate(double factor);
  // Lets unknowns whose signs are wrong change sides. Returns whether there were any.
  bool ChangeSides(const Vector& b, const Vector& bounds, const ResidualScale& tolerance, Vector& z,
                   Vector& multipliers);
  // The same in all processes of a team.
  std::uint64_t HashOfFixed() const;

  std::unique_ptr<KrylovSolver> linear_;
  std::vector<BoundedUnknown> bounded_;
  Vector diagonal_;  // of K, in bounded unknowns
  Workers& workers_;
  std::vector<std::uint8_t> is_fixed_;  // all unknowns
  BoundedSolverCounts counts_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_STRUCTURED_BOUNDED_SOLVER_H_
