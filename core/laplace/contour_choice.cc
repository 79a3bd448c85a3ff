// SPDX-License-Identifier: Apache-2.0
#include "core/laplace/contour_choice.h"

namespace dlcs {

Contour ContourOf(const Options& options) {
  Contour contour = SourceContour(options.num_contour_nodes);
  if (options.contour_gamma > 0) contour.gamma = options.contour_gamma;
  if (options.contour_mu > 0) contour.mu = options.contour_mu;
  if (options.contour_step > 0) contour.step = options.contour_step;
  return contour;
}

}  // namespace dlcs
