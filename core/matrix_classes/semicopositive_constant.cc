// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/semicopositive_constant.h"

#include <algorithm>
#include <limits>
#include <queue>
#include <vector>

#include "core/linalg/linear_program.h"
#include "core/linalg/norms.h"
#include "core/matrix_classes/s_matrix.h"
#include "core/matrix_classes/semicopositive_types.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {

namespace {

constexpr Index kMaxBranchingSize = 6;
constexpr int kMaxBoxes = 20'000;
constexpr double kGap = 0.99;

struct Box {
  double bound;
  Vector low, high;
  bool operator<(const Box& other) const { return bound > other.bound; }  // the worst comes first
};

// min f over z in [0, 1]ⁿ with some z_i = 1, from below. `bound(low, high)` is at most f on the box, and f at
// a point; `least_value` is some value of f, or infinite.
template <typename Bound>
double BranchAndBound(Index n, const Bound& bound, double least_value) {
  std::priority_queue<Box> boxes;
  const auto add = [&](const Vector& low, const Vector& high) {
    const Vector middle = 0.5 * (low + high);
    least_value = std::min(least_value, bound(middle, middle));
    boxes.push({bound(low, high), low, high});
  };
  for (Index i = 0; i < n; ++i) add(Vector::Unit(n, i), Vector::Ones(n));
  for (int count = 0; count < kMaxBoxes && boxes.top().bound < kGap * least_value; ++count) {
    LookForStop();
    const Box box = boxes.top();
    boxes.pop();
    Index widest = 0;
    (box.high - box.low).maxCoeff(&widest);
    const double middle = 0.5 * (box.low[widest] + box.high[widest]);
    Vector cut = box.high;
    cut[widest] = middle;
    add(box.low, cut);
    cut = box.low;
    cut[widest] = middle;
    add(cut, box.high);
  }
  return boxes.top().bound;
}

LowerBound Branched(const Matrix& M, double bound) {
  bound -= 1e-13 * InfinityNorm(M);  // rounding
  if (bound > 0) return {bound, "branch and bound, to 1 % where boxes suffice"};
  return {0, "branch and bound found no positive bound"};
}

double LeastQuadraticForm(const Matrix& M) {
  const Matrix positive = M.cwiseMax(0), negative = M.cwiseMin(0);
  const auto bound = [&](const Vector& low, const Vector& high) {
    return low.dot(positive * low) + high.dot(negative * high);
  };
  return BranchAndBound(M.rows(), bound, std::numeric_limits<double>::infinity());
}

}  // namespace

LowerBound SemicopositiveConstant(const Matrix& M) {
  const Matrix positive = M.cwiseMax(0), negative = M.cwiseMin(0);
  LowerBound by_rows{0, "no simple bound is positive, and branch and bound needs n <= 6"};
  const double dominance = (M.diagonal() + negative.rowwise().sum() - negative.diagonal()).minCoeff();
  if (dominance > 0) by_rows = {dominance, "by the row of the largest entry"};
  if (M.rows() > kMaxBranchingSize) return by_rows;
  const double above = SemicopositiveConstantAbove(M).value;
  if (dominance >= kGap * above) return by_rows;
  const auto bound = [&](const Vector& low, const Vector& high) {
    const Vector image = positive * low + negative * high;
    return low.cwiseProduct(image).cwiseMin(high.cwiseProduct(image)).maxCoeff();
  };
  const LowerBound branched = Branched(M, BranchAndBound(M.rows(), bound, above));
  return branched.value > by_rows.value ? branched : by_rows;
}

LowerBound TypeOneConstant(const Matrix& M) {
  Matrix worst = M.cwiseMin(0);
  worst.diagonal() = 0.5 * M.diagonal();
  const LowerBound by_rows = SemicopositiveConstant(worst);
  if (M.rows() > kMaxBranchingSize) return by_rows;
  const Fact type_one = TestSemicopositiveTypeI(M);
  const Vector& f = type_one.witness.z;
  if (!type_one.yes() || f.size() != M.rows()) return by_rows;
  LowerBound by_form = Branched(M, LeastQuadraticForm(TypeIComparison(M, f)));
  by_form.value /= 2 * f.sum();
  if (by_form.value <= by_rows.value) return by_rows;
  by_form.why = "the proof of Proposition 3(b), with weights for rows: the least quadratic form over z >= 0";
  return by_form;
}

namespace {

constexpr Index kMaxConstantSize = 12;

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
      if (n <= kMaxConstantSize) {
        take(Descend(M, std::move(start), k));
      } else {
        take({LargestProduct(M, start), std::move(start)});
      }
    }
  }
  return best;
}

}  // namespace dlcs
