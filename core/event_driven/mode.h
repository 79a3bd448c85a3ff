// SPDX-License-Identifier: Apache-2.0
// A mode: the system while one set of indices is active.

#ifndef DLCS_CORE_EVENT_DRIVEN_MODE_H_
#define DLCS_CORE_EVENT_DRIVEN_MODE_H_

#include <memory>
#include <optional>
#include <vector>

#include "core/discretization/legendre.h"
#include "core/event_driven/magnitudes.h"
#include "core/linalg/pencil_form.h"
#include "core/linalg/refined_inverse.h"
#include "core/problem/problem.h"
#include "core/types.h"

namespace dlcs {

// Below this reciprocal condition number a matrix does not determine y. ModeTest feels it.
inline constexpr double kSingularY = 1e-12;

// A linear function of state and sources: state · x + slope · x' + f · f + g · g. Empty matrices stand for zero.
struct LinearOutput {
  Matrix state;
  Matrix slope;
  Matrix f;
  Matrix g;
  Matrix slope_g;  // what g' is in it through x', where algebraic equations move x'
};

// An inverse in units in which rows and columns can be compared: that of row.asDiagonal() · matrix ·
// column.asDiagonal().
struct ScaledInverse {
  RefinedInverse inverse;
  Vector row, column;

  Matrix Value() const { return column.asDiagonal() * inverse.value() * row.asDiagonal(); }
  // matrix⁻¹ · rows.
  Matrix Solve(const Matrix& rows) const {
    return column.asDiagonal() * Matrix(inverse.value() * (row.asDiagonal() * rows));
  }
  // rows · matrix⁻¹, and RefinedInverse::TermsOfQuotient().
  Matrix Quotient(const Matrix& rows) const;
  Matrix TermsOfQuotient(const Matrix& rows, const Matrix& quotient) const;
};

// y_S by the equations that determine it, the pivots: slope (x' - f) = of_x x + of_y y_S + of_g g. An empty `slope`
// stands for zero.
struct Multipliers {
  ScaledInverse inverse;  // of of_y
  Matrix of_y, of_x, of_g, slope;

  // of_states x + of_sources g + of_multipliers y_S, with factors that have no more than the rounding of their terms.
  LinearOutput Substitute(const Matrix& of_states, const Matrix& of_sources, const Matrix& of_multipliers) const;
  // Corrects rows S of y by the residual of these equations in twice the digits: then differences of y_S have the
  // digits that x and sources determine, and w_S is zero to the rounding of its terms.
  void Refine(const std::vector<Index>& S, const LegendreSeries& x, const LegendreSeries& x_slope,
              const LegendreSeries& f, const LegendreSeries& g, LegendreSeries& y) const;
};

// While S is active, w_S = 0, and y = 0 outside S:
//
//     x' = A x + B_S y_S + f,      0 = N_S x + M_SS y_S + g_S.
//
// y_S is eliminated from these m + |S| equations by |S| of them, the pivots, and follows from the pivots. What remains
// are m equations for the state,
//
//     E (x' - f) = F x + source_g g.
//
// Where M_SS is nonsingular and of normal size, its rows are the pivots, and E is the identity. Where it is singular
// (ideal diodes, sliding, M = 0), some pivots are differential equations; the rows of the left null space of M_SS
// remain as algebraic equations, which constrain the state: zero rows of E, the last ones. Where M_SS is small, they
// remain as equations of fast states. A pivot is taken where y is best determined, relative to the other terms of its
// equation. So a slow equation is subtracted from fast ones, not the other way round, and each of the remaining
// equations is as accurate as its own terms: next to states of rate 1e14 the slow ones keep their digits.
struct Mode {
  std::vector<Index> active;  // S, increasing
  LinearOutput y;             // n rows, zero outside S
  std::optional<Multipliers> refinement;  // of y; absent where their equations are well conditioned
  LinearOutput guard;         // n rows: y_i for i in S, w_i otherwise; the mode ends where one becomes negative
  LinearOutput outputs;       // the outputs that are not hidden, without their sources
  Matrix outputs_of_y;        // the factors of y_S in them: who has the trajectory computes them with a rounded y

  Matrix E;         // m × m; empty: the identity
  Matrix F;         // m × m
  Matrix source_g;  // m × n; empty: zero
  // The sums of the absolute values of the terms that entries of E and F were summed from.
  Matrix E_terms;  // empty: the identity
  Matrix F_terms;

  PencilForm form;
  std::vector<std::complex<double>> eigenvalues;  // of the pencil, as far as they are determined
  // The left eigenvector of the one that decays slowest: of what acts on the rows, v · rows lasts longest.
  Eigen::VectorXcd slowest;
  Matrix dynamics;  // x' as a function of x, without sources; F if E is the identity. Not as accurate as E and F
  double rate = 0;  // the largest row sum of dynamics, balanced: no time in which it acts is shorter than 1/rate

  // For each state the row that its differential equation became; -1 if it was a pivot. Empty if E is the identity.
  std::vector<Index> row_of_state;

  Index num_algebraic = 0;
  // E with `algebraic_rows()` in place of its zero rows, and its inverse: x' as a function of the other rows'
  // right-hand sides and of what -algebraic_g() makes of g'. Both empty if E is the identity.
  Matrix of_slope, solve_slope;
  // The smallest correction of a state along B_S: x -= correction · (F x + source_g g), last rows.
  Matrix correction;

  bool is_explicit() const { return E.size() == 0; }
  auto algebraic_rows() const { return F.bottomRows(num_algebraic); }
  auto algebraic_g() const { return source_g.bottomRows(num_algebraic); }
};

// The equations slope · (x' - f) = of_x x + of_y y_S + of_g g: first those of the states, then 0 = w_S.
struct ModeEquations {
  Matrix slope, of_x, of_y, of_g;
};

class ModeMaker {
 public:
  // Keeps a reference.
  explicit ModeMaker(const Problem& problem);

  // The mode of `active` (increasing indices), or null if y_S is not determined: the system does not have relative
  // degree one at most on S, or not to working precision. Cost: a Schur form of m × m and factorizations of that size.
  std::unique_ptr<Mode> Make(std::vector<Index> active, const DataSizes& sizes) const;
  // The same without form, eigenvalues, slowest and rate, for the factorizations alone.
  std::unique_ptr<Mode> MakeEquations(std::vector<Index> active, const DataSizes& sizes) const;

 private:
  ModeEquations EquationsOf(const std::vector<Index>& S) const;

  const Problem& problem_;
  Vector units_;  // of the states, powers of two
  // The differential equations rows · (x' - f) = rows_A x + rows_B y.
  Matrix rows_, rows_A_, rows_B_;
  std::vector<Index> opposite_;  // for each w_i one with the opposite row, or -1
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_MODE_H_
