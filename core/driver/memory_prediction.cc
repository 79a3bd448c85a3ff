// SPDX-License-Identifier: Apache-2.0
#include "core/driver/memory_prediction.h"

#include <algorithm>
#include <cmath>

namespace dlcs {
namespace {

constexpr double kNumber = 8;  // bytes
constexpr double kNumberWithIndex = 12;
constexpr double kMatricesOfAStep = 12;      // of size m × m, with the work space of the matrix functions
constexpr double kColumnsOfARun = 8;         // for each node: y, q, g, the free motion, ...
constexpr double kMaxKernelDoubles = 8.4e7;  // blocks and their transforms, as core/laplace/kernel.h bounds them

}  // namespace

double PredictBytes(const Problem& problem, const Grid& grid, Method method, const PropagatorChoice& propagator) {
  const double m = static_cast<double>(problem.num_states()), n = static_cast<double>(problem.num_constraints());
  const double steps = static_cast<double>(grid.num_steps());
  const double outputs = static_cast<double>(grid.output_nodes.size());
  const double psi = static_cast<double>(problem.f.inner_size(problem.num_states()));
  const double trajectory = ((m + 2 * n + 2) * outputs + steps + 1) * kNumber;  // with the grid
  const double couplings = 4 * n * n * kNumber;
  const double kernel =
      method == Method::kLaplaceIteration ? std::min(5 * n * n * steps, kMaxKernelDoubles) * kNumber : 0;
  const double run_columns = (kColumnsOfARun * n + 2 * psi) * steps * kNumber;
  // Steps on states keep blocks of some steps, at most 16 MB for each matrix.
  const double stretch = kColumnsOfARun * std::min(m * steps, std::max(m, 2e6)) * kNumber;
  switch (propagator.record.used) {
    case PropagatorKind::kAuto:
    case PropagatorKind::kDense:
      return trajectory + couplings + kernel + kMatricesOfAStep * m * m * kNumber +
             (method == Method::kWuChenIteration ? kColumnsOfARun * m * steps * kNumber : stretch);
    case PropagatorKind::kSparseStepping: {
      const Index nonzeros = problem.A.Sparse().nonZeros() + problem.E.Sparse().nonZeros();
      const double factors = static_cast<double>(nonzeros) * std::max(1.0, std::log2(m));
      return trajectory + couplings + stretch + factors * kNumberWithIndex +
             std::min(m * n, static_cast<double>(StructuredMatrix::kMaxDenseEntries)) * kNumber;
    }
    case PropagatorKind::kKroneckerSum:
    case PropagatorKind::kContour:
      return trajectory + couplings + kernel + run_columns + kColumnsOfARun * m * kNumber +
             propagator.system->PredictBytes(grid);
  }
  return trajectory;
}

}  // namespace dlcs
