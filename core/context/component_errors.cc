// SPDX-License-Identifier: Apache-2.0
#include "core/context/component_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "core/linalg/abs_times.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/decompositions.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

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

// Sets the smaller one of y_i and w_i to zero, as it is in the solution. What an iteration leaves of it is the residual
// of the LCP, which the certificate holds.
void SetToComplements(Matrix& y, Matrix& w) {
  for (Index k = 0; k < y.size(); ++k) (y.data()[k] < w.data()[k] ? y : w).data()[k] = 0;
}

ComponentValues Differences(const Solution& a, const Solution& b, const CommonColumns& common,
                            const ComponentValues& measured) {
  ComponentValues differences{Vector::Zero(measured.x.size()), Vector::Zero(measured.y.size()),
                              Vector::Zero(measured.w.size())};
  const auto count = static_cast<Index>(common.of_a.size());
  const Index at_once = ColumnsAtOnce(a);
  std::vector<Index> of_a, of_b;
  for (Index first = 0; first < count; first += at_once) {
    const Index last = std::min(count, first + at_once);
    of_a.assign(common.of_a.begin() + first, common.of_a.begin() + last);
    of_b.assign(common.of_b.begin() + first, common.of_b.begin() + last);
    // As a matrix: an expression would copy the indices once for every column.
    RaiseRowMaxAbs(Matrix(a.x(Eigen::all, of_a) - b.x(Eigen::all, of_b)), differences.x);
    if (measured.y.size() == 0) continue;
    Matrix y = a.y(Eigen::all, of_a), w = a.w(Eigen::all, of_a), y_b = b.y(Eigen::all, of_b),
           w_b = b.w(Eigen::all, of_b);
    SetToComplements(y, w);
    SetToComplements(y_b, w_b);
    RaiseRowMaxAbs(y - y_b, differences.y);
    RaiseRowMaxAbs(w - w_b, differences.w);
  }
  return differences;
}

// N_i B_i of each pair; zero where the entries of a matrix are not known.
Vector OwnMoves(const Problem& problem) {
  const StructuredMatrix &N = problem.N, &B = problem.B;
  if (N.is_dense() && B.is_dense()) return N.Dense().cwiseProduct(B.Dense().transpose()).rowwise().sum();
  if (N.linear_operator() || B.linear_operator()) return Vector::Zero(N.rows());
  const SparseMatrix products = N.Sparse().cwiseProduct(SparseMatrix(B.Sparse().transpose()));
  return products * Vector::Ones(products.cols());
}

}  // namespace

Vector MemoryOf(const Problem& problem, double longest) {
  const Vector masses = problem.has_mass() ? problem.E.Diagonal() : Vector(Vector::Ones(problem.num_states()));
  return problem.A.Diagonal().binaryExpr(
      masses, [&](double rate, double mass) { return std::min(longest / std::abs(mass), 1 / std::abs(rate)); });
}

double ComponentValues::LargestRelative(const ComponentValues& sizes) const {
  double largest = 0;
  const auto raise = [&](const Vector& values, const Vector& of_sizes) {
    for (Index i = 0; i < values.size(); ++i) {
      if (values[i] != 0) largest = NanMax(largest, values[i] / of_sizes[i]);
    }
  };
  raise(x, sizes.x);
  raise(y, sizes.y);
  raise(w, sizes.w);
  return largest;
}

ComponentValues Beyond(const ComponentValues& differences, const ComponentValues& rounding) {
  const auto beyond = [](const Vector& of_differences, const Vector& of_rounding) {
    return NanMax(Vector(of_differences - 2 * of_rounding), Vector::Zero(of_differences.size()));
  };
  return {beyond(differences.x, rounding.x), beyond(differences.y, rounding.y), beyond(differences.w, rounding.w)};
}

void ComponentValues::RaiseTo(const ComponentValues& other, double factor) {
  const auto raise = [factor](Vector& values, const Vector& others) {
    values = values.binaryExpr(others, [factor](double a, double b) { return NanMax(a, factor * b); });
  };
  raise(x, other.x);
  raise(y, other.y);
  raise(w, other.w);
}

void ComponentValues::operator+=(const ComponentValues& other) {
  x += other.x;
  y += other.y;
  w += other.w;
}

void ComponentValues::operator*=(double factor) {
  x *= factor;
  y *= factor;
  w *= factor;
}

ComponentValues SizesOf(const Problem& problem, const Solution& solution, bool y_counts) {
  const auto raised = [](Vector size, const Vector& largest, const Matrix& columns) {
    if (largest.size() > 0) size = size.cwiseMax(largest);
    RaiseRowMaxAbs(columns, size);
    return size;
  };
  const Vector none = Vector::Zero(problem.num_constraints());
  ComponentValues sizes{raised(problem.x0.cwiseAbs(), solution.largest.x, solution.x)};
  if (!y_counts) return sizes;
  sizes.y = raised(none, solution.largest.y, solution.y);
  sizes.w = raised(none, solution.largest.w, solution.w);
  return sizes;
}

ComponentValues SizesOf(const Solution& solution) { return {RowMaxAbs(solution.x)}; }

ComponentValues RoundingOfTerms(const Problem& problem, const ComponentValues& sizes) {
  Vector moved = problem.A.AbsTimes(sizes.x);
  ComponentValues rounding;
  if (sizes.y.size() > 0) {
    moved += problem.B.AbsTimes(sizes.y);
    rounding.w = RoundingOf(kOperationsOfSum) * (problem.N.AbsTimes(sizes.x) + problem.M.AbsTimes(sizes.y) + sizes.w);
    // An active y_i has the rounding of w_i, divided by M_ii.
    rounding.y = problem.M.Diagonal().binaryExpr(
        rounding.w, [](double diagonal, double of_w) { return diagonal != 0 ? of_w / std::abs(diagonal) : 0; });
    // What is zero to the bit was set to zero, not summed.
    rounding.y = (sizes.y.array() > 0).select(rounding.y, 0);
    rounding.w = (sizes.w.array() > 0).select(rounding.w, 0);
  }
  rounding.x = RoundingOf(kOperationsOfSum) * (sizes.x + MemoryOf(problem, problem.horizon).cwiseProduct(moved));
  return rounding;
}

ComponentValues RoundingOfTerms(const ComponentValues& sizes) { return {RoundingOf(kOperationsOfSum) * sizes.x}; }

ComponentValues DifferencesBetween(const Solution& a, const Solution& b, const ComponentValues& measured,
                                   double apart) {
  CommonColumns common = ColumnsInCommon(a.times, b.times);
  if (apart > 0) LeaveOutJumps(a, b, apart, common);
  return Differences(a, b, common, measured);
}

ComponentValues SwitchChanges(const Solution& solution, const Problem& problem, const ComponentValues& sizes) {
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
  return {std::move(x), Vector::Zero(sizes.y.size()), Vector::Zero(sizes.w.size())};
}

TrajectoryErrors ErrorsOf(const ComponentValues& sizes, const ComponentValues& truncation,
                          const ComponentValues& rounding) {
  const auto of_kind = [](const Vector& own, const Vector& of_truncation, const Vector& of_rounding) {
    ErrorsByCause errors{own, of_truncation, of_rounding};
    for (Index i = 0; i < own.size(); ++i) {
      if (own[i] > 0) errors.truncation[i] *= 1 + errors.truncation[i] / own[i];
    }
    return errors;
  };
  return {of_kind(sizes.x, truncation.x, rounding.x),
          of_kind(sizes.y, truncation.y, rounding.y),
          of_kind(sizes.w, truncation.w, rounding.w),
          {}};
}

void RaiseTruncation(double part, TrajectoryErrors& errors) {
  for (const ComponentKind kind : kComponentKinds) {
    ErrorsByCause& of_kind = errors.of(kind);
    of_kind.truncation = NanMax(of_kind.truncation, part * of_kind.own);
  }
}

void RaiseToEffectOfStates(const Problem& problem, const Solution& solution, TrajectoryErrors& errors) {
  if (errors.y.size() == 0 || !problem.M.is_dense() || !problem.N.is_dense()) return;
  const Matrix &N = problem.N.Dense(), &M = problem.M.Dense();
  std::set<std::vector<Index>> sets;
  for (Index k = 0; k < solution.y.cols() && sets.size() < kMostSets; ++k) {
    std::vector<Index> active;
    for (Index i = 0; i < solution.y.rows(); ++i) {
      if (solution.y(i, k) > 0) active.push_back(i);
    }
    // Where y_i and w_i are both zero, as at the time of a switch, another time shows which of them stays so.
    const Vector beyond_rounding =
        (solution.y.col(k) - errors.y.rounding).cwiseMax(solution.w.col(k) - errors.w.rounding);
    const bool is_tied = (beyond_rounding.array() <= 0).any();
    if (is_tied || !sets.insert(active).second) continue;
    Matrix of_y = Matrix::Zero(M.rows(), N.cols());
    if (!active.empty())
      of_y(active, Eigen::all) = -Eigen::PartialPivLU<Matrix>(M(active, active)).solve(N(active, Eigen::all));
    const Matrix of_w = N + M * of_y;
    const Vector y = AbsTimes(of_y, errors.x.truncation);
    Vector w = AbsTimes(of_w, errors.x.truncation);
    w(active).setZero();
    if (!y.allFinite() || !w.allFinite()) continue;
    errors.y.truncation = NanMax(errors.y.truncation, y);
    errors.w.truncation = NanMax(errors.w.truncation, w);
  }
}

void AddEffectOfSlacks(const Problem& problem, const Solution& solution, TrajectoryErrors& errors) {
  const Vector& missed = solution.certificate.w_missed;
  if (missed.size() == 0 || errors.x.size() == 0) return;
  const Vector holds = problem.M.Diagonal().cwiseAbs() / problem.horizon + OwnMoves(problem).cwiseAbs();
  const auto in_x = [&](const Vector& of_w) {
    const auto of_y = [](double w, double held) { return held > 0 ? w / held : 0; };
    return problem.B.AbsTimes(of_w.binaryExpr(holds, of_y));
  };
  const Vector operations =
      RoundingOf(kOperationsOfSum) + kUlp / solution.step * MemoryOf(problem, problem.horizon).array();
  // What a step adds to x is rounded, though y may cancel all of it.
  const Vector added =
      problem.A.AbsTimes(errors.x.own) + problem.B.AbsTimes(SizesOf(problem, solution, /*y_counts=*/true).y);
  errors.x.rounding += RoundingOf(kOperationsOfSum) * solution.step * added;
  errors.x.truncation += in_x(missed);
  errors.x.rounding += in_x(problem.N.AbsTimes(errors.x.own.cwiseProduct(operations)));
}

double RelativeDifference(const Matrix& coarse, const Matrix& fine) {
  const Vector size = RowMaxAbs(fine);
  const Vector difference = RowMaxAbs(coarse - fine);
  double largest = 0;
  for (Index i = 0; i < size.size(); ++i) {
    if (difference[i] != 0) largest = NanMax(largest, difference[i] / size[i]);
  }
  return largest;
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
