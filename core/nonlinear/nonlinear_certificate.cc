// SPDX-License-Identifier: Apache-2.0

#include "core/nonlinear/nonlinear_certificate.h"

#include <cmath>

#include "core/linalg/norms.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {

Matrix AddToCertificate(NonlinearFunctions& functions, const Scheme& scheme, const Matrix& W, const Segment& segment,
                        const std::vector<double>& times, Certificate& certificate) {
  Matrix values(segment.y.rows(), segment.steps + 1);
  Certificate& c = certificate;
  if (std::isnan(c.node_residual) && std::isnan(c.x_scale)) {
    c.node_residual = c.midpoint_residual = c.node_complementarity = c.midpoint_complementarity = 0;
    c.ode_defect = c.lcp_scale = c.ode_scale = c.x_scale = 0;
  }
  for (Index j = 0; j <= segment.steps; ++j) {
    LookForStop();
    const Vector x = segment.x.col(j), y = segment.y.col(j), w = functions.G(times[j], x, y);
    values.col(j) = w;
    c.node_residual = NanMax(c.node_residual, NaturalResidual(y, w));
    c.node_complementarity = NanMax(c.node_complementarity, std::abs(y.dot(w)));
    c.lcp_scale = NanMax(c.lcp_scale, NanMax(MaxAbs(y), MaxAbs(w)));
    c.ode_scale = NanMax(c.ode_scale, MaxAbs(functions.F(times[j], x, y)));
    c.x_scale = NanMax(c.x_scale, MaxAbs(x));
  }
  for (Index j = 0; j < segment.steps; ++j) {
    LookForStop();
    const double t = (times[j] + times[j + 1]) / 2;
    const Vector x = scheme.mid_state * segment.x.col(j) + scheme.mid_f_before * segment.f.col(j) +
                     scheme.mid_f_after * segment.f.col(j + 1);
    const Vector y = (segment.y.col(j) + segment.y.col(j + 1)) / 2;
    const Vector w = functions.G(t, x, y);
    const Vector slope = W * x + (segment.f.col(j) + segment.f.col(j + 1)) / 2;
    c.midpoint_residual = NanMax(c.midpoint_residual, NaturalResidual(y, w));
    c.midpoint_complementarity = NanMax(c.midpoint_complementarity, std::abs(y.dot(w)));
    c.ode_defect = NanMax(c.ode_defect, MaxAbs(slope - functions.F(t, x, y)));
  }
  return values;
}

}  // namespace dlcs
