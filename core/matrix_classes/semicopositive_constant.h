// SPDX-License-Identifier: Apache-2.0
// How strictly a matrix is semicopositive: the numbers σ of (3) and of type I, in the ∞-norm.

#ifndef DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_CONSTANT_H_
#define DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_CONSTANT_H_

#include <string>

#include "core/types.h"

namespace dlcs {

// A number that is proven to be at most the constant; 0 where no positive one is known.
struct LowerBound {
  double value = 0;
  std::string why;  // how it was found, or why there is none
};

// σ of (3) of [Shen & Pang 2007]: max_i z_i (Mz)_i >= σ ‖z‖_∞² for all z >= 0. `M` square, finite, n >= 1.
//
// By the row of the largest z_i,  σ >= min_i (m_ii - Σ_{j≠i} max(0, -m_ij)),  which is σ itself for
// nonnegative M; where n <= 6, also by branch and bound over the faces z_i = 1 of the
// unit cube, to 1 % of σ or until 20,000 boxes are looked at. Never more than σ by more than rounding.
LowerBound SemicopositiveConstant(const Matrix& M);

// A number that the constant does not exceed, and the point that shows it.
struct UpperBound {
  double value = 0;  // max_i z_i (Mz)_i
  Vector z;          // z >= 0, ‖z‖_∞ = 1
};

// σ of (3) from above: the least max_i z_i (Mz)_i that was found for z >= 0, ‖z‖_∞ = 1. From several starts
// on every face z_k = 1 by linear programs in a trust region, which end in a local minimum: mostly, but not
// surely, in σ itself. Not positive exactly where a z was found that M is not strictly semicopositive. For n
// <= 12, the start alone beyond. About 30 n small linear programs.
UpperBound SemicopositiveConstantAbove(const Matrix& M);

// σ of type I, valid with t̄ = T for every T:  max_i ∫_0^t v_i' (Mv)_i dτ >= σ ‖v(t)‖_∞²  for all
// nondecreasing v, v(0) = 0.
//
// The larger of two. (i) v_i, v_j are nondecreasing, so ∫ v_i' v_j lies in [0, v_i(t) v_j(t)] and ∫ v_i' v_i
// = v_i(t)²/2: σ of (3) for the matrix with m_ii/2 on the diagonal and min(0, m_ij) beside it. It covers
// Proposition 3(a), with min m_ii/2 in the ∞-norm, and the first form of Proposition 4. (ii) For n <= 6 and
// the weights f and the matrix K of TestSemicopositiveTypeI(): min { zᵀKz : z >= 0, ‖z‖_∞ = 1 }/(2 Σf), which
// for symmetric M is the bound of Proposition 3(b)-(d). A positive value proves that M is of type I.
LowerBound TypeOneConstant(const Matrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_MATRIX_CLASSES_SEMICOPOSITIVE_CONSTANT_H_
