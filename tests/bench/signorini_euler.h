// SPDX-License-Identifier: Apache-2.0
// Implicit Euler done well for the parabolic Signorini problem (core/models/signorini.h): the yardstick of the
// benchmarks.

#ifndef DLCS_TESTS_BENCH_SIGNORINI_EULER_H_
#define DLCS_TESTS_BENCH_SIGNORINI_EULER_H_

#include <Eigen/SparseCholesky>
#include <memory>

#include "core/lcp/structured/splitting_solver.h"
#include "core/problem/problem.h"
#include "core/propagator/factor_transform.h"

namespace dlcs::bench {

// ψ at t_j = T j / `steps`, one column for each j = 0 ... steps, of a problem made by MakeSignoriniProblem().
Matrix SampleObstacle(const Problem& problem, Index steps);

// What the two forms share: x⁺ = R (x + h B (y + ψ)), R = (I - hA)⁻¹, with y from LCP(N R (x + h B ψ) + g, M^h). Mode
// (a, b) of the grid, a along x1 and b along x2, is multiplied by R_ab. Both are spared what they could be made to pay
// for: M^h is formed by sine transforms, and its LCPs are solved by tridiagonal ones
// (core/lcp/structured/splitting_solver.h), as the march does. Throws std::runtime_error where an LCP is not solved.
class SignoriniEuler {
 public:
  SignoriniEuler(const Problem& problem, Index steps);

  const Matrix& y() const { return y_; }  // of the last run, columns 1 ... steps

 protected:
  // y_j from N R (x + h B ψ_j).
  void SolveLcp(const Vector& N_x, Index j);

  Index size_, steps_;
  double step_, weight_;
  FactorTransform transform_;
  Vector along_;  // e_1 in modes
  Matrix M_, psi_, R_, y_;

 private:
  std::unique_ptr<SplittingLcpSolver> solver_;
  Vector tolerance_;
};

// The state on the grid, two solves with a sparse Cholesky factor a step.
class CholeskyEuler : public SignoriniEuler {
 public:
  CholeskyEuler(const Problem& problem, Index steps);
  // The first `count` steps.
  void Run(Index count);

 private:
  SparseMatrix B_, N_;
  Vector x_;
  Eigen::SimplicialLLT<SparseMatrix> factor_;
};

// The state in modes: one pass over it and two sine transforms a step.
class SineEuler : public SignoriniEuler {
 public:
  SineEuler(const Problem& problem, Index steps);
  void Run();

 private:
  // Moves the state through a step with this input, or leaves it, and adds what N R x sees of it.
  void Advance(bool moves, const Vector& input_modes, Vector& seen_modes);

  Matrix modes_;
};

}  // namespace dlcs::bench

#endif  // DLCS_TESTS_BENCH_SIGNORINI_EULER_H_
