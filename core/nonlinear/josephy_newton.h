// SPDX-License-Identifier: Apache-2.0
// The nonlinear complementarity problem 0 <= y ⟂ G(y) >= 0 by successive linear ones.

#ifndef DLCS_CORE_NONLINEAR_JOSEPHY_NEWTON_H_
#define DLCS_CORE_NONLINEAR_JOSEPHY_NEWTON_H_

#include <functional>
#include <memory>
#include <string>

#include "core/lcp/lcp.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/types.h"

namespace dlcs {

// G: ℝⁿ -> ℝⁿ and its Jacobian, both perhaps not finite outside the domain of G.
struct ComplementarityFunction {
  std::function<Vector(const Vector& y)> value;
  std::function<Matrix(const Vector& y)> jacobian;
};

struct ComplementarityResult {
  enum class Verdict {
    kSolved,
    kInfeasible,  // the LCP of the linearized G where the method stopped has no solution
    kStalled,     // no further progress, or steps ran out
    kNonFinite,   // G or its Jacobian has no value at the start
  };
  Verdict verdict = Verdict::kStalled;
  Index lcps = 0;
  double residual = 0;    // ‖min(y, G(y))‖_∞
  std::string why;        // where the verdict is not kSolved
  bool no_state = false;  // `why` is about the x of a coupled step, not about y
};

// Solves for a sequence of functions G, neighbors in time: the Jacobian and the LCP solver of the last one are kept as
// long as the iteration converges with them.
//
// A step goes to the solution of the LCP of the linearized G (the one that `selection` means: the least element of a
// Z-matrix) with a step length that lowers ½‖Φ‖², Φ the Fischer-Burmeister function; if the LCP has no solution, or its
// direction gives no decrease, a Levenberg-Marquardt step on Φ is taken instead. For affine G a single LCP gives the
// solution. At least one LCP is solved, so a guess that is a solution but not the selected one is not kept.
//
// An accepted solution satisfies |min(y, G(y))|_i <= 1e-13 s_i, s = |G(y)| + |G'||y|; or 1e-9 s_i, if rounding in the
// formulas prevents a smaller residual.
// Threads: one object each. Cost: a solver for each new Jacobian, otherwise an LCP and a value of G per step.
// Source: [Josephy 1979] N. Josephy. Newton's method for generalized equations. MRC report 1965, Wisconsin; the
// safeguard as in [De Luca, Facchinei, Kanzow 1996] A semismooth equation approach to the solution of nonlinear
// complementarity problems. Math. Programming 75, 407-439.
class JosephyNewton {
 public:
  explicit JosephyNewton(Selection selection) : selection_(selection) {}

  // `y` holds a guess >= 0 and takes the solution, >= 0; where there is none, the last point tried.
  ComplementarityResult Solve(const ComplementarityFunction& function, Vector& y);

 private:
  struct Point;
  bool Linearize(const ComplementarityFunction& function, const Vector& y);
  LcpStatus SolveLinearized(const Point& point, Vector& y);
  bool SmallResidual(const Point& point, double tolerance) const;
  bool LevenbergMarquardt(const ComplementarityFunction& function, Point& point) const;

  Selection selection_;
  Matrix jacobian_;
  std::unique_ptr<LcpSolver> solver_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_NONLINEAR_JOSEPHY_NEWTON_H_
