// SPDX-License-Identifier: Apache-2.0

#include "core/methods/scheme.h"

#include <limits>

#include "core/linalg/norms.h"
#include "core/linalg/panel_lu.h"
#include "core/linalg/panel_product.h"
#include "core/linalg/phi_functions.h"

namespace dlcs {
namespace {

// The weights of s_{j-1} and s_j after a step, and at its middle, for a source linear over the step; the two
// sets share one evaluation of the φ-functions, at h/2, and a doubling.
struct ExponentialWeights {
  Matrix state, before, after;
  Matrix mid_state, mid_before, mid_after;
};

ExponentialWeights ComputeWeights(const Matrix& A, double step) {
  const PhiFunctions half = ComputePhiFunctions(step / 2 * A);
  const PhiFunctions full = DoublePhiFunctions(half);
  ExponentialWeights weights;
  weights.state = full.phi0;
  weights.before = step * (full.phi1 - full.phi2);
  weights.after = step * full.phi2;
  // Over the first half the source runs from s_{j-1} to (s_{j-1} + s_j)/2.
  weights.mid_state = half.phi0;
  weights.mid_after = step / 4 * half.phi2;
  weights.mid_before = step / 2 * half.phi1 - weights.mid_after;
  return weights;
}

Scheme WithSources(const ExponentialWeights& weights, double step) {
  Scheme scheme;
  scheme.step = step;
  scheme.state = weights.state;
  scheme.f_before = weights.before;
  scheme.f_after = weights.after;
  scheme.mid_state = weights.mid_state;
  scheme.mid_f_before = weights.mid_before;
  scheme.mid_f_after = weights.mid_after;
  return scheme;
}

}  // namespace

Scheme ExponentialPiecewiseLinear(const Problem& problem, double step) {
  const ExponentialWeights weights = ComputeWeights(problem.A, step);
  Scheme scheme = WithSources(weights, step);
  scheme.y_before = Product(weights.before, problem.B.Dense());
  scheme.y_after = Product(weights.after, problem.B.Dense());
  scheme.mid_y_before = Product(weights.mid_before, problem.B.Dense());
  scheme.mid_y_after = Product(weights.mid_after, problem.B.Dense());
  scheme.y_is_linear = true;
  scheme.order = 2;
  return scheme;
}

Scheme ExponentialPiecewiseConstant(const Problem& problem, double step) {
  const ExponentialWeights weights = ComputeWeights(problem.A, step);
  Scheme scheme = WithSources(weights, step);
  scheme.y_after = Product(weights.before + weights.after, problem.B.Dense());
  scheme.mid_y_after = Product(weights.mid_before + weights.mid_after, problem.B.Dense());
  return scheme;
}

Scheme ThetaScheme(const Problem& problem, double step, double theta) {
  const Matrix identity = Matrix::Identity(problem.num_states(), problem.num_states());
  const Matrix implicit = identity - step * (1 - theta) * problem.A.Dense();
  const PanelLu factor(implicit);
  Scheme scheme;
  scheme.step = step;
  const Matrix inverse = factor.Solve(identity);
  scheme.state = theta == 0 ? inverse : factor.Solve(identity + step * theta * problem.A.Dense());
  scheme.f_after = step * inverse;
  scheme.y_after = Product(scheme.f_after, problem.B.Dense());
  scheme.x_is_linear = true;
  const double condition = InfinityNorm(implicit) * InfinityNorm(inverse);
  if (!(condition < 1 / std::numeric_limits<double>::epsilon())) {
    scheme.state.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return scheme;
}

Scheme AveragedScheme(const Problem& problem, double step) {
  Scheme scheme = ThetaScheme(problem, step, 0.5);
  scheme.f_after /= 2;
  scheme.f_before = scheme.f_after;
  scheme.y_after /= 2;
  scheme.y_before = scheme.y_after;
  scheme.y_is_linear = true;
  scheme.order = 2;
  return scheme;
}

}  // namespace dlcs
