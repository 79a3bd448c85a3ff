// SPDX-License-Identifier: Apache-2.0

#include "core/methods/exponential_march.h"

#include "core/methods/marching.h"
#include "core/methods/reduced_march.h"

namespace dlcs {

bool ExponentialMarch(SolveContext& context) {
  if (context.realised) return ReducedMarch(context);
  const bool linear = context.y_is_lipschitz();
  return MarchGrid(context, linear ? "exp-PL" : "exp-PC", [&](double step) {
    return linear ? ExponentialPiecewiseLinear(context.problem, step)
                  : ExponentialPiecewiseConstant(context.problem, step);
  });
}

}  // namespace dlcs
