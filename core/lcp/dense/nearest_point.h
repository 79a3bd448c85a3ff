// SPDX-License-Identifier: Apache-2.0
// The nearest point of a polyhedron of solutions.

#ifndef DLCS_CORE_LCP_DENSE_NEAREST_POINT_H_
#define DLCS_CORE_LCP_DENSE_NEAREST_POINT_H_

#include <vector>

#include "core/lcp/dense/feasibility.h"
#include "core/problem/problem.h"
#include "core/types.h"

namespace dlcs {

// { v >= 0 : E v = e, G v >= g }, any of the parts with no rows. The sizes are of the numbers that e and g were summed
// from.
struct Polyhedron {
  Matrix E;
  Vector e, e_size;
  Matrix G;
  Vector g, g_size;
};

struct NearestPoint {
  Feasibility answer = Feasibility::kUnknown;  // is there a point at all; the rest only where there is
  Vector v = {};                               // the minimizer; of several the one of least norm
  double distance = 0;                         // ‖C v - b‖₂
  bool unique = true;                          // no other point of the polyhedron has C v the same
};

// The face { v_S >= 0, v = 0 elsewhere, (q + M v)_S = 0, q + M v >= 0 } of the solutions of LCP(q, M), in the
// variables v_S.
Polyhedron SolutionFaceOf(const Matrix& M, const Vector& q, const std::vector<Index>& S);

// All solutions of LCP(q, M) for positive semidefinite M, given one of them, ȳ:
//     { v >= 0 : q + M v >= 0, (M + Mᵀ) v = (M + Mᵀ) ȳ, qᵀv = qᵀȳ }.
// Source: [Cottle, Pang & Stone 1992] R. W. Cottle, J.-S. Pang, R. E. Stone. The linear complementarity
// problem. Academic Press. Theorem 3.1.7.
Polyhedron ConvexSolutionSet(const Matrix& M, const Vector& q, const Vector& solution);

// Minimizes ‖C v - b‖₂ over `polyhedron`. The conditions of optimality of this quadratic program are an LCP
// with a positive semidefinite matrix, which Lemke's method solves and the point of its basis certifies:
//
//     0 <= v ⟂ Cᵀ(C v - b) - Aᵀλ >= 0,     0 <= λ ⟂ A v - a >= 0,     A v >= a for E v >= e, -E v >= -e, G v
//     >= g.
//
// kUnknown where rounding hides whether the polyhedron is empty. Rows of E that depend on others are left out
// of the program; the result is checked against all. Dense, up to (3n)³ for n variables.
NearestPoint FindNearestPoint(const Polyhedron& polyhedron, const Selector& selector);

// Whether `polyhedron`, which holds `v`, holds another point: two quadratic programs along a generic line.
bool HasOtherPoint(const Polyhedron& polyhedron, const Vector& v);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_NEAREST_POINT_H_
