// SPDX-License-Identifier: Apache-2.0
// SemicopositiveConstantAbove(): descent on the faces of the unit cube.

#include <limits>
#include <vector>

#include "core/linalg/linear_program.h"
#include "core/matrix_classes/s_matrix.h"
#include "core/matrix_classes/semicopositive_constant.h"

namespace dlcs {
namespace {

constexpr Index kMaxSize = 12;

double LargestProduct(const Matrix& M, const Vector& z) { return z.cwiseProduct(M * z).maxCoeff(); }

// The step d, |d_i| <= `radius`, that minimizes max_i of z_i (Mz)_i to first order, with z + d on the face
// z_k = 1 of the unit cube.
Vector LinearStep(const Matrix& M, const Vector& z, Index k, double radius) {
  const Index n = M.rows();
  const Vector image = M * z;
  LinearProgram program = MakeLinearProgram(n, n + 1);
  program.rows.leftCols(n) = z.asDiagonal() * M;
  program.rows.leftCols(n).diagonal() += image;
  program.rows.col(n).setConstant(-1);
  program.row_upper = -z.cwiseProduct(image);
  program.lower.head(n) = (-z).cwiseMax(-radius);
  program.upper.head(n) = (Vector::Ones(n) - z).cwiseMin(radius);
  program.lower[k] = program.upper[k] = 0;
  program.lower[n] = -kUnbounded;
  program.cost[n] = 1;
  const LinearProgramSolution step = SolveLinearProgram(program);
  if (step.verdict != LinearProgramVerdict::kOptimal) return Vector::Zero(n);
  return step.z.head(n);
}

UpperBound Descend(const Matrix& M, Vector z, Index k) {
  constexpr int kMaxSteps = 30;
  constexpr double kSmallestRadius = 1e-6;
  double value = LargestProduct(M, z);
  double radius = 0.5;
  for (int step = 0; step < kMaxSteps && radius > kSmallestRadius; ++step) {
    const Vector next = (z + LinearStep(M, z, k, radius)).cwiseMax(0).cwiseMin(1);
    const double next_value = LargestProduct(M, next);
    if (next_value < value) {
      z = next;
      value = next_value;
    } else {
      radius /= 4;
    }
  }
  return {value, z};
}

}  // namespace

UpperBound SemicopositiveConstantAbove(const Matrix& M) {
  const Index n = M.rows();
  UpperBound best{std::numeric_limits<double>::infinity(), {}};
  const auto take = [&best](UpperBound found) {
    if (found.value < best.value) best = std::move(found);
  };
  const Vector opposed = PositiveImageOfMMatrix(ZMatrixBelow(M));  // where (Mz)_i is small against z_i
  for (Index k = 0; k < n; ++k) {
    std::vector<Vector> starts = {Vector::Unit(n, k), Vector::Ones(n)};
    if (opposed.size() > 0) {
      starts.push_back((opposed / opposed[k]).cwiseMin(1));
    }
    for (Vector& start : starts) {
      if (n <= kMaxSize) {
        take(Descend(M, std::move(start), k));
      } else {
        take({LargestProduct(M, start), std::move(start)});
      }
    }
  }
  return best;
}

}  // namespace dlcs
