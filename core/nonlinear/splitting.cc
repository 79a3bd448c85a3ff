// SPDX-License-Identifier: Apache-2.0

#include "core/nonlinear/splitting.h"

#include <Eigen/LU>
#include <limits>
#include <vector>

namespace dlcs {

Matrix ReducedJacobian(NonlinearFunctions& functions, double t, const Vector& x, const Vector& y) {
  const Matrix f_x = functions.FByX(t, x, y);
  const Vector w = functions.G(t, x, y);
  std::vector<Index> active;
  for (Index i = 0; i < y.size(); ++i) {
    if (y[i] > 0 && y[i] >= w[i]) active.push_back(i);
  }
  if (active.empty()) return f_x;
  const Matrix g_y = functions.GByY(t, x, y);
  const Eigen::PartialPivLU<Matrix> factor(Matrix(g_y(active, active)));
  if (!(factor.rcond() > 1e3 * std::numeric_limits<double>::epsilon())) return f_x;
  const Matrix g_x = functions.GByX(t, x, y);
  const Matrix f_y = functions.FByY(t, x, y);
  return f_x - f_y(Eigen::all, active) * factor.solve(Matrix(g_x(active, Eigen::all)));
}

}  // namespace dlcs
