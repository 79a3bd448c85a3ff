// SPDX-License-Identifier: Apache-2.0
// Short sums of exponentials for the response of a diagonal system with one input and one output.

#ifndef DLCS_CORE_PROPAGATOR_SUM_OF_EXPONENTIALS_H_
#define DLCS_CORE_PROPAGATOR_SUM_OF_EXPONENTIALS_H_

#include <vector>

#include "core/types.h"

namespace dlcs {

// Σ_k weights_k e^{rates_k t}
struct SumOfExponentials {
  Vector rates;
  Vector weights;
  double error = 0;  // bound of max_ω |H(iω) - H_r(iω)| relative to max_ω |H(iω)|
};

// A sum with fewer terms whose transfer function Σ w_k / (z - μ_k) differs by at most `tolerance` of its largest value
// on the imaginary axis, by balanced truncation: with w > 0 the system is symmetric, its Gramian P_ik = √(w_i w_k) /
// -(μ_i + μ_k) has singular values that fall like e^{-ck}, and the error is at most twice the sum of those cut off.
// What is left is symmetric and stable again. P is factored by pivoted Cholesky, which meets its small singular values:
// O(q r²). Where some μ >= 0, or the weights differ in sign, the sum is returned as it is, terms of weight 0 left out.
// Source: [Antoulas 2005] A. C. Antoulas. Approximation of large-scale dynamical systems. SIAM. Chapter 7.
SumOfExponentials Compress(const SumOfExponentials& sum, double tolerance);

// e^{μ_i t} for all i by a few of them: Σ_k weights(i, k) e^{μ_{kept_k} t}, for t > 0.
struct ExponentialBasis {
  std::vector<Index> kept;
  Matrix weights;  // q × kept
};

// The basis that pivoted Cholesky of the Gramian 1 / -(μ_i + μ_k) chooses: some log(μ_max/μ_min) log(1/ε) of the
// exponentials span all others to working precision in L²(0, ∞), whatever they are convolved with. All are kept where
// some μ >= 0. O(q r²).
ExponentialBasis ChooseBasis(const Vector& rates);

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_SUM_OF_EXPONENTIALS_H_
