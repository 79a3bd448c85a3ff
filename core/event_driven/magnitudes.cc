// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/magnitudes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/context/sizes.h"
#include "core/discretization/legendre.h"
#include "core/linalg/abs_times.h"

namespace dlcs {

DataSizes SizesOfData(const Problem& problem, bool y_is_lipschitz, SourceSampler& sampler) {
  const Index m = problem.num_states(), n = problem.num_constraints();
  const Matrix &A = problem.A.Dense(), &N = problem.N.Dense();
  constexpr int kLooks = 16;
  DataSizes sizes{problem.x0.cwiseAbs(), Vector::Zero(m), Vector::Zero(n), Vector::Zero(m), Vector::Zero(n)};
  Vector f(m), g(n);
  for (int k = 0; k <= kLooks; ++k) {
    const double t = problem.horizon * k / kLooks;
    sampler.F(t, k == kLooks ? Side::kLeft : Side::kRight, f);
    sampler.G(t, k == kLooks ? Side::kLeft : Side::kRight, g);
    if (f.allFinite()) sizes.f = sizes.f.cwiseMax(f.cwiseAbs());
    if (g.allFinite()) sizes.g = sizes.g.cwiseMax(g.cwiseAbs());
    sampler.TermsOfF(t, f);
    sampler.TermsOfG(t, g);
    if (f.allFinite()) sizes.f_terms = sizes.f_terms.cwiseMax(f);
    if (g.allFinite()) sizes.g_terms = sizes.g_terms.cwiseMax(g);
  }
  const Vector rates = A.diagonal().cwiseAbs().cwiseMax(1 / problem.horizon);
  sizes.x = sizes.x.cwiseMax(sizes.f.cwiseQuotient(rates));
  const Vector driven = AbsTimes(A, sizes.x).cwiseQuotient(rates) / static_cast<double>(m);
  sizes.x = sizes.x.cwiseMax(driven);
  const Vector rows = sizes.g.cwiseMax(AbsTimes(N, sizes.x));
  if (y_is_lipschitz) {
    const Vector y = rows.cwiseQuotient(problem.M.Dense().diagonal());
    sizes.x = sizes.x.cwiseMax(AbsTimes(problem.B.Dense(), y).cwiseQuotient(rates));
  }
  for (Index i = 0; i < m; ++i) {
    if (sizes.x[i] > 0) continue;
    double noticed = std::numeric_limits<double>::infinity();
    for (Index j = 0; j < n; ++j) {
      const double of_state = std::abs(N(j, i));
      if (of_state > 0 && rows[j] > 0) noticed = std::min(noticed, rows[j] / of_state);
    }
    if (std::isfinite(noticed)) sizes.x[i] = noticed;
  }
  return sizes;
}

Magnitudes::Magnitudes(const Problem& problem, const Options& options, double tolerance)
    : x(problem.x0.cwiseAbs()),
      y(Vector::Zero(problem.num_constraints())),
      w(y),
      outputs(Vector::Zero(problem.outputs.shown())),
      x_reach(x),
      x_given(AbsoluteTolerances(options, ComponentKind::kState, problem.num_states()) / tolerance),
      y_given(AbsoluteTolerances(options, ComponentKind::kPair, problem.num_constraints()) / tolerance),
      w_given(AbsoluteTolerances(options, ComponentKind::kSlack, problem.num_constraints()) / tolerance),
      rounding(problem.num_states()),
      errors(problem.num_states(), 0) {}

void Magnitudes::RaiseReach(const Matrix& dynamics, double rate, const Vector& f_size) {
  x_reach = x;
  for (Index k = 0; k < kLegendreDegree; ++k) {
    const Vector next = x_reach.cwiseMax(0.5 / rate * (AbsTimes(dynamics, x_reach) + f_size));
    const bool grows = (next.array() > 2 * x_reach.array()).any();
    x_reach = next;
    if (!grows) break;
  }
}

}  // namespace dlcs
