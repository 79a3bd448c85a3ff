// SPDX-License-Identifier: Apache-2.0
#include "core/context/shared_setup.h"

#include <utility>

#include "core/setup_cache.h"

namespace dlcs {
namespace {

double BytesOf(const Scheme& scheme) {
  double numbers = 0;
  for (const Matrix* matrix :
       {&scheme.state, &scheme.y_before, &scheme.y_after, &scheme.f_before, &scheme.f_after, &scheme.mid_state,
        &scheme.mid_y_before, &scheme.mid_y_after, &scheme.mid_f_before, &scheme.mid_f_after}) {
    numbers += static_cast<double>(matrix->size());
  }
  return 8 * numbers;
}

}  // namespace

Scheme SharedScheme(const SolveContext& context, const std::string& kind, double step,
                    const std::function<Scheme(double step)>& make) {
  if (!context.choices.setups) return make(step);
  SetupKey key("scheme " + kind);
  key.Add(context.problem.A).Add(context.problem.B).Add(step);
  return *context.choices.setups->Get<Scheme>(key, [&]() -> SetupCache::Made<Scheme> {
    auto scheme = std::make_shared<const Scheme>(make(step));
    const double bytes = BytesOf(*scheme);
    return {std::move(scheme), bytes};
  });
}

std::unique_ptr<LcpSolver> SharedCoupledSolver(const SolveContext& context, const Matrix& K) {
  const SolutionChoice choice = context.choice();
  if (!context.choices.setups) return MakeCoupledLcpSolver(context.problem.M, K, choice);
  SetupKey key("coupled solver");
  key.Add(context.problem.M).Add(K).Add(static_cast<Index>(choice.selection)).Add(choice.X);
  if (choice.selector) key.Add(choice.selector->C).Add(Matrix(choice.selector->b));
  const auto prototype = context.choices.setups->Get<LcpSolver>(key, [&]() -> SetupCache::Made<LcpSolver> {
    // M, its scaled form and the factors of a basis.
    const double bytes = 3.0 * 8.0 * static_cast<double>(K.size());
    return {std::shared_ptr<const LcpSolver>(MakeCoupledLcpSolver(context.problem.M, K, choice)), bytes};
  });
  return prototype->Clone();
}

MatrixClass SharedClass(const Problem& problem, SetupCache* setups) {
  if (!setups) return Classify(problem.M, problem.rule);
  SetupKey key("class");
  key.Add(problem.M).Add(static_cast<Index>(problem.rule));
  return *setups->Get<MatrixClass>(key, [&]() -> SetupCache::Made<MatrixClass> {
    const double bytes = 4096 + 8.0 * static_cast<double>(problem.M.size());
    return {std::make_shared<const MatrixClass>(Classify(problem.M, problem.rule)), bytes};
  });
}

}  // namespace dlcs
