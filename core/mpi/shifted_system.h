// SPDX-License-Identifier: Apache-2.0
// Equations with zE - A for complex z, whose rows are distributed over ranks.

#ifndef DLCS_CORE_MPI_SHIFTED_SYSTEM_H_
#define DLCS_CORE_MPI_SHIFTED_SYSTEM_H_

#include <complex>
#include <memory>
#include <vector>

#include "core/mpi/halo.h"
#include "core/mpi/mpi_team.h"
#include "core/mpi/multigrid_cycle.h"
#include "core/mpi/ownership.h"
#include "core/types.h"

namespace dlcs {

// Adds up the values of all ranks of `team` in their order, so that all get the same bits. Called by all ranks.
void SumOverRanks(Eigen::Ref<Eigen::MatrixXcd> values, MpiTeam& team);

// (zE - A) x = b by GMRES in complex numbers. M is one V-cycle for the real matrix sE - A with s near |z|, applied to
// real and imaginary part. Were it exact, and A symmetric, the eigenvalues of M(zE - A) would lie on the segment from
// z/s to 1. It does not contain 0, and GMRES gains a factor of cot(θ/4) in each step, θ the argument of z: 2.4 for an
// imaginary z, 1.5 at 135°, for any A.
//
// What is made small is M(b - (zE - A) x), which is the error of x but for a factor of some 1/cos(θ/2): large entries
// of A do not count in it, as they would in the residual, which rounding keeps at 1e-16 ‖A‖ ‖x‖.
//
// All functions are called by all ranks of the team; vectors hold the rows of this one. The bits depend on the number
// of ranks and on nothing else. Memory: A and E, multigrid, and kRestart + 8 complex vectors of these rows.
class ShiftedSystem {
 public:
  using Complex = std::complex<double>;
  static constexpr Index kRestart = 24;

  // The rows of this rank, with all columns; `E` with 0 rows stands for the identity.
  ShiftedSystem(const RowMajorMatrix& A, const RowMajorMatrix& E, bool is_symmetric, const Ownership& rows,
                MpiTeam& team);

  // Returns whether error() is at most `tolerance`, or where rounding does not allow that, 10 times as much.
  // `tolerance`: at least 1e-13.
  bool Solve(Complex z, const Eigen::VectorXcd& b, double tolerance, Eigen::VectorXcd& x);
  // ‖M (b - (zE - A) x)‖₂ / ‖x‖₂ of the last solve, computed from x.
  double error() const { return error_; }
  Index iterations() const { return iterations_; }  // of all solves

 private:
  // The cycle for sE - A; shifts within 20% share one.
  void PrepareCycle(double size_of_z);
  // product = (zE - A) v.
  void Multiply(Complex z, const Eigen::VectorXcd& v, Eigen::VectorXcd& product);
  // r = M r.
  void Precondition(Eigen::VectorXcd& r);
  double Norm(const Eigen::VectorXcd& v);
  // Reduces the 2-norm of w = M (b - (zE - A) x), `size`, to `target` by at most kRestart steps, and adds to x.
  void Cycle(Complex z, const Eigen::VectorXcd& w, double size, double target, Eigen::VectorXcd& x);

  const bool is_symmetric_;
  const Ownership& rows_;
  MpiTeam& team_;
  const std::vector<Index> own_rows_;
  const DistributedMatrix A_;
  const std::unique_ptr<const DistributedMatrix> E_;  // null for the identity
  double shift_ = 0;                                  // s of the cycle; 0 without one
  std::unique_ptr<MultigridCycle> cycle_;
  Eigen::MatrixXcd basis_;
  Matrix parts_, products_, weighted_;  // real and imaginary part
  Vector right_, left_;                 // of the cycle
  double error_ = 0;
  Index iterations_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_SHIFTED_SYSTEM_H_
