// SPDX-License-Identifier: Apache-2.0

#include "core/methods/time_stepping.h"

#include "core/methods/marching.h"

namespace dlcs {

bool TimeStepping(SolveContext& context) {
  return MarchGrid(context, [&](double step) {
    return ThetaScheme(context.problem, step, context.options.theta);
  });
}

}  // namespace dlcs
