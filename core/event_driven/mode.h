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

// While S is active, w_S = 0, and y = 0 outside S. So y_S follows from 0 = N_S x + g_S + M_SS y_S, and x obeys a linear
// differential equation
//
//     x' = dynamics x + source_f f + source_g g + source_slope g'.
//
// Where M_SS is singular (ideal diodes, sliding, M = 0), let U span its left null space: then Uᵀ(N_S x + g_S) = 0 is a
// condition on the state alone. It is replaced by its derivative Uᵀ(N_S (A x + B_S y_S + f) + g_S') = 0. Together with
// the remaining equations of M_SS y_S = -(N_S x + g_S), this determines y_S if the system has relative degree one on S.
struct Mode {
  std::vector<Index> active;  // S, increasing
  LinearOutput y;             // n rows, zero outside S
  LinearOutput guard;         // n rows: y_i for i in S, w_i otherwise; the mode ends where one becomes negative
  Matrix dynamics;            // m × m
  Matrix source_f;            // m × m; empty: the identity
  Matrix source_g;            // m × n; empty: zero
  Matrix source_slope;        // m × n; empty: zero

  GradedSchurForm form;  // of dynamics
  double rate = 0;       // the largest row sum of dynamics, balanced: no time in which it acts is shorter than 1/rate
  // |A| + |B||y.state|, in coordinates of y that make it small: the size of the terms that dynamics is the sum of.
  Matrix dynamics_size;

  // The constraints on the state, rows · x + rows_g · g = 0, and the smallest correction along B_S: x -= correction ·
  // (residual). No rows if M_SS is nonsingular.
  Matrix rows;
  Matrix rows_g;
  Matrix correction;

  bool differentiated() const { return rows.rows() > 0; }
};

// The mode of `active` (increasing indices), or null if y_S is not determined: M_SS is singular, and the system does
// not have relative degree one on S, or not to working precision. Cost: a Schur form of m × m (25 m³) and a
// factorization of |S| × |S|.
std::unique_ptr<Mode> MakeMode(const Problem& problem, std::vector<Index> active);

// `mode` with stabilized constraints: its dynamics move a state back to constraint c along its correction at the rate
// rates[c]. For states that satisfy the constraints nothing changes. It is needed where large terms of a row cancel:
// their rounding errors would move the state off the constraint quickly. Null, and cost, as MakeMode().
std::unique_ptr<Mode> DrawBack(const Problem& problem, const Mode& mode, const Vector& rates);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_MODE_H_
