// SPDX-License-Identifier: Apache-2.0
#include "core/context/component_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// The rounding error of a sum, relative to the numbers from which it is summed.
constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();

// Trajectories may be larger than the remaining memory, so they are processed a few columns at a time.
Index ColumnsAtOnce(const Solution& solution) {
  constexpr Index kNumbersAtOnce = Index{1} << 16;
  return std::max<Index>(1, kNumbersAtOnce / std::max<Index>(1, std::max(solution.x.rows(), solution.y.rows())));
}

// The columns of two solutions at the same time.
struct CommonColumns {
  std::vector<Index> of_a, of_b;
};

CommonColumns ColumnsInCommon(const std::vector<double>& a, const std::vector<double>& b) {
  CommonColumns common;
  std::size_t i = 0, k = 0;
  while (i < a.size() && k < b.size()) {
    if (a[i] == b[k]) {
      common.of_a.push_back(static_cast<Index>(i++));
      common.of_b.push_back(static_cast<Index>(k++));
    } else {
      ++(a[i] < b[k] ? i : k);
    }
  }
  return common;
}

// Leaves out the times within `apart` of a jump.
void LeaveOutJumps(const Solution& a, const Solution& b, double apart, CommonColumns& common) {
  std::vector<double> jumps;
  for (const Solution* solution : {&a, &b}) {
    for (const StateJump& jump : solution->jumps) jumps.push_back(jump.time);
  }
  std::sort(jumps.begin(), jumps.end());
  CommonColumns kept;
  for (std::size_t k = 0; k < common.of_a.size(); ++k) {
    const double time = a.times[static_cast<std::size_t>(common.of_a[k])];
    const auto next = std::lower_bound(jumps.begin(), jumps.end(), time - apart);
    if (time > 0 && next != jumps.end() && *next <= time + apart) continue;
    kept.of_a.push_back(common.of_a[k]);
    kept.of_b.push_back(common.of_b[k]);
  }
  common = std::move(kept);
}

ComponentErrors Differences(const Solution& a, const Solution& b, const CommonColumns& common,
                            const StructuredMatrix* B, const ComponentSizes& sizes) {
  Vector x = Vector::Zero(a.x.rows()), By = Vector::Zero(B ? B->rows() : 0), w = Vector::Zero(sizes.w.size());
  const auto count = static_cast<Index>(common.of_a.size());
  const Index at_once = ColumnsAtOnce(a);
  std::vector<Index> of_a, of_b;
  for (Index first = 0; first < count; first += at_once) {
    const Index last = std::min(count, first + at_once);
    of_a.assign(common.of_a.begin() + first, common.of_a.begin() + last);
    of_b.assign(common.of_b.begin() + first, common.of_b.begin() + last);
    // As a matrix: an expression would copy the indices once for every column.
    RaiseRowMaxAbs(Matrix(a.x(Eigen::all, of_a) - b.x(Eigen::all, of_b)), x);
    if (B) RaiseRowMaxAbs(*B * Matrix(a.y(Eigen::all, of_a) - b.y(Eigen::all, of_b)), By);
    if (w.size() > 0) RaiseRowMaxAbs(Matrix(a.w(Eigen::all, of_a) - b.w(Eigen::all, of_b)), w);
  }
  return {Relative(x, sizes.x, sizes.x_rounding), Relative(By, sizes.By, sizes.By_rounding),
          Relative(w, sizes.w, Vector::Zero(w.size()))};
}

// Zero for a Kronecker sum, whose entries are not written down.
Vector DiagonalOf(const StructuredMatrix& matrix) {
  if (matrix.is_dense()) return matrix.Dense().diagonal();
  if (matrix.sparse() != nullptr) return matrix.sparse()->diagonal();
  return Vector::Zero(matrix.rows());
}

}  // namespace

Vector MemoryOf(const Problem& problem, double longest) {
  const Vector masses = problem.has_mass() ? DiagonalOf(problem.E) : Vector::Ones(problem.num_states());
  return DiagonalOf(problem.A).binaryExpr(
      masses, [&](double rate, double mass) { return std::min(longest / std::abs(mass), 1 / std::abs(rate)); });
}

Vector Relative(const Vector& difference, const Vector& size, const Vector& rounding) {
  Vector relative(difference.size());
  for (Index i = 0; i < difference.size(); ++i) {
    if (size[i] > rounding[i] || std::isnan(size[i])) {
      relative[i] = difference[i] / size[i];
    } else {
      relative[i] = difference[i] > rounding[i] ? 1 : 0;
    }
  }
  return relative;
}

double ComponentErrors::largest() const { return NanMax(MaxAbs(x), NanMax(MaxAbs(By), MaxAbs(w))); }

void ComponentErrors::RaiseTo(const ComponentErrors& other, double factor) {
  const auto raise = [factor](Vector& errors, const Vector& others) {
    errors = errors.binaryExpr(others, [factor](double a, double b) { return NanMax(a, factor * b); });
  };
  raise(x, other.x);
  raise(By, other.By);
  raise(w, other.w);
}

void ComponentErrors::operator+=(const ComponentErrors& other) {
  x += other.x;
  By += other.By;
  w += other.w;
}

void ComponentErrors::operator*=(double factor) {
  x *= factor;
  By *= factor;
  w *= factor;
}

void ComponentErrors::MoveTo(Accuracy& accuracy) {
  // The errors are relative to the sizes of the computed trajectory, which are themselves wrong by e. Relative to the
  // true sizes they are up to e / (1 - e). That has a pole at e = 1, so its first terms e + e² are taken.
  for (Vector* errors : {&x, &By, &w}) errors->array() *= 1 + errors->array();
  accuracy.error = NanMax(largest(), Accuracy::kMinError);
  accuracy.errors_x = std::move(x);
  accuracy.errors_By = std::move(By);
  accuracy.errors_w = std::move(w);
}

ComponentSizes SizesOf(const Problem& problem, const Solution& solution, bool y_counts) {
  ComponentSizes sizes;
  sizes.x = problem.x0.cwiseAbs();
  RaiseRowMaxAbs(solution.x, sizes.x);
  const Vector y = RowMaxAbs(solution.y);
  const Vector summed_By = problem.B.AbsTimes(y);
  const Vector moved = problem.A.AbsTimes(sizes.x) + summed_By;
  sizes.x_rounding = kRounding * (sizes.x + MemoryOf(problem, problem.horizon).cwiseProduct(moved));
  if (!y_counts) return sizes;
  sizes.By = Vector::Zero(problem.num_states());
  Vector g = Vector::Zero(problem.num_constraints());
  const Index at_once = ColumnsAtOnce(solution);
  for (Index first = 0; first < solution.y.cols(); first += at_once) {
    const Index count = std::min(at_once, solution.y.cols() - first);
    const auto y_part = solution.y.middleCols(first, count);
    RaiseRowMaxAbs(problem.B * y_part, sizes.By);
    Matrix g_part = solution.w.middleCols(first, count);
    g_part -= problem.N * solution.x.middleCols(first, count);
    g_part -= problem.M * y_part;
    RaiseRowMaxAbs(g_part, g);
  }
  sizes.w = problem.N.AbsTimes(sizes.x) + problem.M.AbsTimes(y) + g;
  // y_i = -(N x + g + ...)_i / M_ii has the rounding of N x.
  const Vector by_Nx = problem.N.AbsTimes(sizes.x).cwiseProduct(
      DiagonalOf(problem.M).unaryExpr([](double d) { return d != 0 ? 1 / std::abs(d) : 0; }));
  sizes.By_rounding = kRounding * (summed_By + problem.B.AbsTimes(by_Nx));
  return sizes;
}

ComponentSizes SizesOf(const Solution& solution) {
  ComponentSizes sizes;
  sizes.x = RowMaxAbs(solution.x);
  sizes.x_rounding = kRounding * sizes.x;
  return sizes;
}

ComponentErrors DifferencesBetween(const Solution& a, const Solution& b, const Problem& problem,
                                   const ComponentSizes& sizes, double apart) {
  CommonColumns common = ColumnsInCommon(a.times, b.times);
  if (apart > 0) LeaveOutJumps(a, b, apart, common);
  return Differences(a, b, common, sizes.By.size() > 0 ? &problem.B : nullptr, sizes);
}

ComponentErrors DifferencesBetween(const Solution& a, const Solution& b, const ComponentSizes& sizes) {
  return Differences(a, b, ColumnsInCommon(a.times, b.times), nullptr, sizes);
}

ComponentErrors SwitchChanges(const Solution& solution, const Problem& problem, const ComponentSizes& sizes) {
  const Vector memory = MemoryOf(problem, problem.horizon);
  Vector x = Vector::Zero(problem.num_states());
  auto limit = solution.left_limits.begin();
  bool switched_before = false;
  for (Index k = 1; k < solution.y.cols(); ++k) {
    const double begin = solution.times[static_cast<std::size_t>(k) - 1];
    const double end = solution.times[static_cast<std::size_t>(k)];
    while (limit != solution.left_limits.end() && limit->column < k) ++limit;
    const auto before = solution.y.col(k - 1);
    const bool jumps = limit != solution.left_limits.end() && limit->column == k;
    const Vector after = jumps ? limit->y : Vector(solution.y.col(k));
    const bool switches = !((before.array() > 0) == (after.array() > 0)).all();
    const bool settles = std::exchange(switched_before, switches);
    if (!switches && !settles) continue;
    const double step = std::min(end - begin, solution.step);
    x = x.cwiseMax((problem.B * Vector(after - before)).cwiseAbs().cwiseProduct(memory.cwiseMin(step)));
  }
  return {Relative(x, sizes.x, sizes.x_rounding), Vector::Zero(sizes.By.size()), Vector::Zero(sizes.w.size())};
}

double RelativeDifference(const Matrix& coarse, const Matrix& fine) {
  const Vector size = RowMaxAbs(fine);
  const Vector difference = RowMaxAbs(coarse - fine);
  return MaxAbs(Relative(difference, size, Vector::Zero(size.size())));
}

void KeepTimes(const std::vector<double>& wanted, Solution& solution) {
  const std::vector<Index> kept = ColumnsInCommon(solution.times, wanted).of_a;
  if (kept.size() == solution.times.size()) return;
  std::vector<double> times;
  std::vector<LeftLimit> left_limits;
  auto limit = solution.left_limits.begin();
  for (std::size_t k = 0; k < kept.size(); ++k) {
    times.push_back(solution.times[static_cast<std::size_t>(kept[k])]);
    while (limit != solution.left_limits.end() && limit->column < kept[k]) ++limit;
    if (limit != solution.left_limits.end() && limit->column == kept[k]) {
      left_limits.push_back({static_cast<Index>(k), std::move(limit->y), std::move(limit->w)});
    }
  }
  solution.x = Matrix(solution.x(Eigen::all, kept));
  solution.y = Matrix(solution.y(Eigen::all, kept));
  solution.w = Matrix(solution.w(Eigen::all, kept));
  solution.dense_output.reset();
  solution.times = std::move(times);
  solution.left_limits = std::move(left_limits);
}

}  // namespace dlcs
