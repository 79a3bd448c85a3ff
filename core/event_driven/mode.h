// SPDX-License-Identifier: Apache-2.0
// A mode: the system while one set of indices is active.

#ifndef DLCS_CORE_EVENT_DRIVEN_MODE_H_
#define DLCS_CORE_EVENT_DRIVEN_MODE_H_

#include <memory>
#include <vector>

#include "core/linalg/graded_schur.h"
#include "core/problem/problem.h"
#include "core/types.h"

namespace dlcs {

// A linear function of state and sources: x·state + f·f + g·g + g'·slope. Empty matrices stand for zero.
struct LinearOutput {
  Matrix state;
  Matrix f;
  Matrix g;
  Matrix slope;  // of g' = dg/dt
};

// While S is active, w_S = 0 and y = 0 off S, so that y_S follows from 0 = N_S x + g_S + M_SS y_S and the
// rest is a linear differential equation
//
//     x' = dynamics x + source_f f + source_g g + source_slope g'.
//
// Where M_SS is singular (ideal diodes, sliding, M = 0), let U span its left null space: then Uᵀ(N_S x + g_S)
// = 0 asks something of the state alone, and its derivative Uᵀ(N_S (A x + B_S y_S + f) + g_S') = 0 takes its
// place. Together with what is left of M_SS y_S = ... that determines y_S wherever the system has relative
// degree one on S.
struct Mode {
  std::vector<Index> active;  // S, increasing
  LinearOutput y;             // n rows, zero off S
  LinearOutput guard;         // n rows: y_i for i in S, w_i otherwise; the mode ends where one becomes negative
  Matrix dynamics;            // m × m
  Matrix source_f;            // m × m; empty: the identity
  Matrix source_g;            // m × n; empty: zero
  Matrix source_slope;        // m × n; empty: zero

  GradedSchurForm form;  // of dynamics
  double rate = 0;       // the largest row sum of dynamics, balanced: no time in which it acts is shorter than 1/rate
  // |A| + |B||y.state|, in coordinates of y that make it small: the numbers that dynamics was summed from.
  Matrix dynamics_size;

  // What the state must satisfy, rows · x + rows_g · g = 0, and the smallest correction along B_S: x -=
  // correction · (that residual). No rows where M_SS is nonsingular.
  Matrix rows;
  Matrix rows_g;
  Matrix correction;

  bool differentiated() const { return rows.rows() > 0; }
};

// The mode of `active`, increasing indices, or null where y_S is not determined: M_SS is singular and
// relative degree one is not enough, or not reached to working precision. Cost: a Schur form of m × m (25 m³)
// and a factorization of |S| × |S|.
std::unique_ptr<Mode> MakeMode(const Problem& problem, std::vector<Index> active);

// `mode` with dynamics that draw a state back to the constraint c along its correction at rates[c], which changes
// nothing for a state that satisfies it. Where fast rows cancel, the rounding of their terms takes a state off in no
// time, and nothing else would bring it back. Null, and cost, as MakeMode().
std::unique_ptr<Mode> DrawBack(const Problem& problem, const Mode& mode, const Vector& rates);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_MODE_H_
