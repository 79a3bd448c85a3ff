// SPDX-License-Identifier: Apache-2.0
// A step of the θ-scheme for a large sparse A.

#ifndef DLCS_CORE_METHODS_SPARSE_STEP_H_
#define DLCS_CORE_METHODS_SPARSE_STEP_H_

#include "core/linalg/sparse_factor.h"
#include "core/methods/scheme.h"
#include "core/methods/segment.h"
#include "core/parallel/parallel.h"
#include "core/problem.h"

namespace dlcs {

// With R = (I - h(1-θ)A)⁻¹, factored once,
//
//     x_j = R (x_{j-1} + hθ A x_{j-1} + h f_j) + h R B y_j,
//
// or, averaged (θ = 1/2), with s = B y + f,
//
//     x_j = R (x_{j-1} + h/2 A x_{j-1} + h/2 (f_{j-1} + B y_{j-1} + f_j)) + h/2 R B y_j.
//
// What stands behind the + is R B, found in n solves and kept as a dense m × n matrix where that fits.
// Threads: const calls are safe at once; the n solves take those of `workers`, with the same bits for any number.
class SparseStep {
 public:
  // `problem` must outlive it. A singular I - h(1-θ)A gives numbers that are not finite.
  SparseStep(const Problem& problem, double step, double theta, bool averaged, Workers& workers);

  // How x and y are meant between nodes; without matrices.
  Scheme Description() const;

  // The three parts of a step: the columns 1.. of x get what f says of them; then x_j gets all the rest but for y_j; and last that.
  void StartWithSources(Segment& segment) const;
  void AddBefore(Segment& segment, Index j) const;
  void AddAfter(Segment& segment, Index j) const;

  // h N R B, or half of it.
  const Matrix& CoupledTerm() const { return coupled_term_; }

 private:
  const Problem& problem_;
  double step_;
  double theta_;
  bool averaged_;
  double weight_;  // of s_j: h, or half of it
  SparseFactor<double> factor_;
  Matrix response_;  // weight R B; empty where it does not fit
  Matrix coupled_term_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_METHODS_SPARSE_STEP_H_
