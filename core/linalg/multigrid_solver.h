// SPDX-License-Identifier: Apache-2.0
// Large sparse systems of equations by Krylov methods, with multigrid as the preconditioner.

#ifndef DLCS_CORE_LINALG_MULTIGRID_SOLVER_H_
#define DLCS_CORE_LINALG_MULTIGRID_SOLVER_H_

#include <cstdint>
#include <vector>

#include "core/linalg/compressed_rows.h"
#include "core/linalg/multigrid.h"
#include "core/linalg/structured_matrix.h"
#include "core/parallel/parallel.h"
#include "core/types.h"

namespace dlcs {

// Residuals count relative to `first` in the rows before `split`, and to `second` in the others.
struct ResidualScale {
  Index split = 0;
  double first = 1, second = 1;
};

// Solves K x = b for one K and many b, where some unknowns may be fixed: then the equations of the others are solved.
// Conjugate gradients where K is symmetric, else GMRES, with restarts and in its flexible form, since the
// preconditioner has single precision. Sums run through blocks in a fixed order: the bits do not depend on the number
// of threads. Memory: that of K and of core/linalg/multigrid.h, and 4 vectors, or 2 kRestart + 2 where K is not
// symmetric.
class MultigridSolver {
 public:
  static constexpr Index kRestart = 24;

  // Cost: that of some twenty V-cycles.
  MultigridSolver(const SparseMatrix& K, Workers& workers);

  const CompressedRows<double>& matrix() const { return K_; }
  bool is_symmetric() const { return is_symmetric_; }
  const Multigrid& multigrid() const { return multigrid_; }

  // From now on the unknowns with is_fixed[i] != 0 are fixed. Start() must follow.
  void Fix(const std::vector<std::uint8_t>& is_fixed);

  // Begins at `x`, which holds the values of fixed unknowns as well. Keeps references to both.
  void Start(const Vector& b, Vector& x, const ResidualScale& scale);

  // Iterates until residual() is at most `target`, which may be less each time. False if it is not: after
  // `max_iterations`, or where K is not definite or residuals stay as they are. x is the last iterate in any case.
  // Looks for stop requests.
  bool Reduce(double target, Index max_iterations);

  // max |b - K x| in the units of the scale over the unknowns that are not fixed; NaN where a number is not finite.
  double residual() const { return residual_; }
  // Computes it again from x, without what rounding has added up since Start().
  void Refresh();
  Index iterations() const { return iterations_; }  // of all solves

  // (K x)_i
  double RowTimes(Index i, const Vector& x) const;

 private:
  bool ReduceByConjugateGradients(double target, Index max_iterations);
  bool ReduceByGmres(double target, Index max_iterations);
  // One cycle of at most `steps` steps, or until the 2-norm has fallen by `factor`; the steps taken.
  Index GmresCycle(double factor, Index steps);
  // product = K v in the unknowns that are not fixed, 0 in the others. Returns vᵀ product.
  double Multiply(const Vector& v, Vector& product) const;
  // z = the preconditioner applied to v.
  void Precondition(const Vector& v, Vector& z);
  // Calls update(begin, end), which changes those rows of r_, for blocks of rows, and measures r_.
  template <typename Body>
  void UpdateResidual(const Body& update);
  void ComputeResidual();

  CompressedRows<double> K_;
  bool is_symmetric_;
  Workers& workers_;
  Multigrid multigrid_;
  std::vector<std::uint8_t> is_fixed_;
  Index iterations_ = 0;

  const Vector* b_ = nullptr;
  Vector* x_ = nullptr;
  ResidualScale scale_;
  double residual_ = 0, size_of_r_ = 0;  // max |r_i| in the units of the scale, and as it is
  Vector r_;
  // Conjugate gradients: the direction and K times it, rᵀz; has_direction_ once there was a step.
  Vector z_, p_, q_;
  double rho_ = 0;
  bool has_direction_ = false;
  double last_step_ = 0;
  Matrix basis_, corrections_;  // of GMRES
};

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_MULTIGRID_SOLVER_H_
