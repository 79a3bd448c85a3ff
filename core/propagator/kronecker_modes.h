// SPDX-License-Identifier: Apache-2.0
// A Kronecker sum in coordinates that decouple it into systems with one input and one output.

#ifndef DLCS_CORE_PROPAGATOR_KRONECKER_MODES_H_
#define DLCS_CORE_PROPAGATOR_KRONECKER_MODES_H_

#include <memory>
#include <string>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/problem/problem.h"
#include "core/propagator/factor_transform.h"
#include "core/propagator/outer_product.h"
#include "core/propagator/propagator.h"
#include "core/propagator/sum_of_exponentials.h"

namespace dlcs {

// A = F ⊕ R, F along one axis of the grid and R across it, both symmetric; B = b ⊗ C and N = nᵀ ⊗ D act on the axis
// through one vector each, as constraints on one side of a grid do. With F = Q_F diag(μ) Q_Fᵀ and R = Q_R diag(λ) Q_Rᵀ,
// mode r across the axis is driven by û_r = (Q_Rᵀ C y)_r alone and answers
//
//     ẑ_r(t) = Σ_a n̂_a b̂_a ∫_0^t e^{(μ_a + λ_r)(t - τ)} û_r(τ) dτ,     N x = D Q_R ẑ,
//
// the same sum of q exponentials for every mode except for a shift; Compress() shortens it.
struct KroneckerModes {
  Index num_states = 0;
  Axis axis;
  FactorTransform along;
  std::vector<FactorTransform> across;  // the factors of R in the order of the grid
  Vector mu;                            // q
  Vector lambda;                        // p
  Vector b, n;                          // b̂, n̂: q
  SeparableMatrix C;                    // p × n
  SeparableMatrix D;                    // n × p
  SumOfExponentials response;           // the short sum
  ExponentialBasis basis;               // of e^{μ_a t}
  // No off-diagonal entry of A is negative, all entries of B have one sign, and all of N: then no block of the kernel
  // has entries of both signs.
  bool keeps_sign = false;

  Index num_modes() const { return lambda.size(); }

  // D Q_R diag(`values`) Q_Rᵀ C.
  Matrix Couple(const Vector& values) const;
  // Q_Rᵀ u and Q_R ẑ, columns of p.
  Matrix ToModes(Matrix u) const;
  Matrix FromModes(Matrix z) const;
  // Q_Rᵀ E u, such as û = Q_Rᵀ C y, and N x = D Q_R ẑ, for columns side by side, in parallel.
  void Drive(const SeparableMatrix& E, const Eigen::Ref<const Matrix>& u, Eigen::Ref<Matrix> inputs,
             Workers& workers) const;
  Matrix Observe(Matrix z, Workers& workers) const;
  // sum = `base` + D Q_R ẑ; uses up ẑ.
  void AddObserved(const Eigen::Ref<const Matrix>& base, Eigen::Ref<Matrix> z, Workers& workers, Eigen::Ref<Matrix> sum,
                   const OnColumns& computed) const;
  // One column of ToModes() and FromModes(), fast and without allocation where R has one factor.
  void ToModesInPlace(Eigen::Ref<Vector> u, FactorTransform::Workspace& workspace) const;
  void FromModesInPlace(Eigen::Ref<Vector> z, FactorTransform::Workspace& workspace) const;

  // A state (m) as q × p modes, and back.
  Matrix StateToModes(const Eigen::Ref<const Vector>& x) const;
  void StateFromModes(Matrix modes, Eigen::Ref<Vector> x) const;
};

// The modes of `problem`; null if it has no such form, and `why_not` says why.
std::shared_ptr<const KroneckerModes> FindKroneckerModes(const Problem& problem, std::string& why_not);

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_KRONECKER_MODES_H_
