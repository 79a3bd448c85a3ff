// SPDX-License-Identifier: Apache-2.0
// Large sparse systems of equations by Krylov methods, with the diagonal or what derived classes bring as
// preconditioner.

#ifndef DLCS_CORE_LINALG_SPARSE_KRYLOV_SOLVER_H_
#define DLCS_CORE_LINALG_SPARSE_KRYLOV_SOLVER_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "core/linalg/sparse/compressed_rows.h"
#include "core/linalg/sparse/symmetric_diagonals.h"
#include "core/parallel/parallel.h"
#include "core/parallel/team.h"
#include "core/types.h"

namespace dlcs {

// Residuals count relative to `first` in the rows before `split`, and to `second` in the others.
struct ResidualScale {
  Index split = 0;
  double first = 1, second = 1;
};

// Solves K x = b for one K and many b, where some unknowns may be fixed: then the equations of the others are solved.
// Conjugate gradients where K is symmetric, else GMRES, with restarts and in its flexible form, since the
// preconditioner need not be the same to the last bit at each step. Sums run through blocks in a fixed order: the bits
// do not depend on the number of threads. Memory: that of K, and 4 vectors, or 2 kRestart + 2 where K is not symmetric.
//
// Where the rows are distributed over a team, all vectors hold the unknowns of this process, and all processes call the
// same functions; what is said of the system holds for the whole of it.
class KrylovSolver {
 public:
  static constexpr Index kRestart = 24;
  // Of a symmetric K with the diagonal D, the spectral radius ρ of D⁻¹|K - D| up to which D is the preconditioner: the
  // condition number is then at most (1 + ρ) / (1 - ρ) = 39. That takes some six times as many iterations as with
  // multigrid, each an eighth of the work.
  static constexpr double kDominated = 0.95;

  virtual ~KrylovSolver() = default;

  const CompressedRows<double>& matrix() const { return K_; }
  bool is_symmetric() const { return is_symmetric_; }
  Team& team() const { return team_; }

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

  // (K x)_i, where x is that of the last Expand().
  double RowTimes(Index i, const Vector& x) const;
  // Gets the values of `x` that other processes have and rows of this one need.
  virtual void Expand(const Vector& /*x*/) {}

 protected:
  // `K`: the rows of this process, by its own unknowns.
  KrylovSolver(CompressedRows<double> K, bool is_symmetric, Workers& workers, Team& team);

  // Makes the diagonal of K the preconditioner if K is symmetric and ρ at most kDominated: then the functions below are
  // not called. Returns whether it did. To be called once, with outside_ in place. Cost: at most that of 24 iterations.
  bool TryDiagonal();

  // z = the preconditioner applied to r, 0 in fixed unknowns. `size`: max |r_i|.
  virtual void Precondition(const Vector& r, double size, Vector& z) = 0;
  virtual void PrepareFixed(const std::vector<std::uint8_t>& is_fixed) = 0;

  const CompressedRows<double> K_;
  // The columns of other processes, and their unknowns as Expand() found them; no rows where there are none.
  CompressedRows<double> outside_;
  Vector outside_values_;

 private:
  bool ReduceByConjugateGradients(double target, Index max_iterations);
  bool ReduceByGmres(double target, Index max_iterations);
  // One cycle of at most `steps` steps, or until the 2-norm has fallen by `factor`; the steps taken.
  Index GmresCycle(double factor, Index steps);
  // product[i - begin] = (K x)_i for these rows, where x is that of the last Expand().
  void MultiplyRows(const Vector& x, Index begin, Index end, double* product) const;
  // The same for unknowns that are not fixed, in the whole vector; 0 in the others.
  void MultiplyFree(const Vector& v, Index begin, Index end, Vector& product) const;
  // Scalar products of the rows of this process, summed over blocks of rows in their order.
  struct Sums {
    double first = 0, second = 0;

    void operator+=(const Sums& other) {
      first += other.first;
      second += other.second;
    }
  };
  template <typename Body>
  Sums SumOfBlocks(const Body& body);
  // product = K v in the unknowns that are not fixed, 0 in the others. Returns vᵀ product and vᵀ other.
  Sums Multiply(const Vector& v, const Vector& other, Vector& product);
  double Dot(const Eigen::Ref<const Vector>& a, const Eigen::Ref<const Vector>& b);
  // z_ = the preconditioner applied to r_, which counts as an iteration. Returns z_ᵀr_ and z_ᵀq_.
  Sums PreconditionResidual();
  // The same for z_ in these rows.
  Sums MeasurePreconditioned(Index begin, Index end) const;
  // Calls update(begin, end), which changes those rows of r_, for blocks of rows, and measures r_. Where the diagonal
  // is the preconditioner it is applied in the same pass over memory.
  template <typename Body>
  void UpdateResidual(const Body& update);
  void ComputeResidual();

  std::optional<SymmetricDiagonals> diagonals_;  // of K_, where they are few
  bool is_symmetric_;
  Workers& workers_;
  Team& team_;
  std::vector<std::uint8_t> is_fixed_;
  bool uses_diagonal_ = false;
  Vector inverse_diagonal_;  // where it does
  Sums of_diagonal_;         // then those of PreconditionResidual(), in this process
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

#endif  // DLCS_CORE_LINALG_SPARSE_KRYLOV_SOLVER_H_
