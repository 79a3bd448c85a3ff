// SPDX-License-Identifier: Apache-2.0

#include "core/stepping/exponential_integrator.h"

#include "core/stepping/reduced_integrator.h"
#include "core/stepping/stepping.h"

namespace dlcs {

bool ExponentialIntegrator(SolveContext& context) {
  if (context.choices.propagator) return IntegrateReduced(context);
  const bool linear = context.y_is_lipschitz();
  return StepThroughGrid(context, linear ? "exp-PL" : "exp-PC", [&](double step) {
    return linear ? ExponentialPiecewiseLinear(context.problem, step)
                  : ExponentialPiecewiseConstant(context.problem, step);
  });
}

}  // namespace dlcs
