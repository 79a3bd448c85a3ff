// SPDX-License-Identifier: Apache-2.0
// The interface of all solvers of LCP(q, M).

#ifndef DLCS_CORE_LCP_BASIS_LCP_SOLVER_H_
#define DLCS_CORE_LCP_BASIS_LCP_SOLVER_H_

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/types.h"

namespace dlcs {

enum class LcpStatus {
  kSolved,
  kInfeasible,  // proven: no y >= 0 with q + M y >= 0, or no complementary basis solves it
  kRay,         // Lemke's method ended in a secondary ray and infeasibility is not proven
  kPivotLimit,
  kSingular,   // a basis that had to be factored is singular to working precision
  kNonFinite,  // q holds an infinity or NaN
};
const char* LcpStatusName(LcpStatus verdict);  // "SOLVED", "INFEASIBLE", ...

// Which y_i are basic (may be positive). It is both the warm start of a solve and part of its result.
using Basis = std::vector<std::uint8_t>;

// { i : basis[i] }, increasing.
std::vector<Index> IndicesOf(const Basis& basis);

// How a solve went, for statistics and messages.
struct LcpStats {
  Index pivots = 0;         // basic variables exchanged
  const char* method = "";  // the method that gave the verdict: "principal pivoting", ...
  std::string message;      // why, where the verdict is not kSolved
};

// Solves LCP(q, M) for one matrix and many q. One object per thread. A solver keeps factorizations and work space, and
// allocates nothing in a solve with the same basis as before.
//
// A solve is a pure function of its arguments: the factors kept from earlier calls are those that a new solver would
// compute, so the bits of the solution depend neither on earlier calls nor on which of several clones is used.
class LcpSolver {
 public:
  virtual ~LcpSolver() = default;

  // `q`          n entries.
  // `tolerance`  n entries >= 0, absolute: w_i above -tolerance_i counts as nonnegative. The caller knows the
  //              rounding in q_i; a good value is 1e-13 times the size of the terms that q_i is the sum of.
  //              The rounding of the solver's own arithmetic is added to it in any case.
  // `basis`      in: a guess, n entries; out: the basis of the solution, the last one tried where there is
  //              none. The solution does not depend (beyond rounding and `tolerance`) on the guess where it
  //              is unique or the least element.
  // `y`          out: >= 0 exactly, from a factorization of the basis: in a kSolved result w_i is off by at most
  //              10·tolerance_i + 1e-12·(|q_i| + Σ_j|M_ij| y_j). Zero where the verdict is another one.
  virtual LcpStatus Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                          Eigen::Ref<Vector> y) = 0;

  // Whether `basis` itself gives a solution, and which; `y` is undefined otherwise. Never searches for another basis.
  // Solvers that select a solution, and those that keep no dense factors, do not try and return false. The arguments
  // are those of Solve(). Cost: where the basis is that of the last call O(n |S|), else with its factorization.
  virtual bool SolvesIn(const Basis& /*basis*/, const Eigen::Ref<const Vector>& /*q*/,
                        const Eigen::Ref<const Vector>& /*tolerance*/, Eigen::Ref<Vector> /*y*/) {
    return false;
  }

  // Whether the last solution is the selected one. False only if a coupled solver found a solution of LCP(q, M + K)
  // that is not the selected one of LCP(q + K y, M), and found none that is.
  virtual bool KeptSelection() const { return true; }

  // Whether the selection determines the last solution uniquely. False only for minimizers.
  virtual bool IsOnlyChoice() const { return true; }

  // How the last Solve() went. Allocates; not for the inner loop.
  virtual LcpStats Account() const = 0;

  // A fresh solver for the same matrix, for another thread: its results do not depend on this one's past.
  virtual std::unique_ptr<LcpSolver> Clone() const = 0;
};

// The basis that followed each basis in a sequence of LCPs. In circuits with gates, bases recur in cycles.
class BasisSuccessors {
 public:
  // As solver.Solve(), but if `basis` gives no solution, the basis that followed it last is tried before `solver`
  // searches. So where several bases give solutions the result depends on the calls before.
  LcpStatus Solve(LcpSolver& solver, const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                  Basis& basis, Eigen::Ref<Vector> y);

  // The basis that followed `basis` last; null if none did.
  const Basis* After(const Basis& basis) const {
    const auto found = after_.find(basis);
    return found == after_.end() ? nullptr : &found->second;
  }

 private:
  std::map<Basis, Basis> after_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_BASIS_LCP_SOLVER_H_
