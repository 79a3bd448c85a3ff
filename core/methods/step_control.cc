// SPDX-License-Identifier: Apache-2.0

#include "core/methods/step_control.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// The estimate must be so many times below the tolerance. Found by trial on tests/cases and the examples of
// the papers, 64 to 262144 steps: the truth was up to 2.04 times the estimate, since the errors of kinks that
// fall between nodes come and go from one trial to the next.
constexpr double kSafety = 3;
// A trial that fails with more steps than this does not fail because they are long.
constexpr Index kMostFailingSteps = 16384;
// Beyond these many steps a tolerance that is out of reach is given up.
constexpr Index kHopelessSteps = 16384;

bool FailsForAnyStep(Termination termination) {
  switch (termination) {
    case Termination::kInconsistentState:
    case Termination::kUnsupported:
    case Termination::kCancelled:
    case Termination::kNotSolved:
      return true;
    case Termination::kReachedEnd:
    case Termination::kInfeasible:
    case Termination::kDiverged:
    case Termination::kIterationLimit:
    case Termination::kNonFinite:
      return false;
  }
  return true;
}

// The columns of `times` that stand at `wanted`.
std::vector<Index> PositionsOf(const std::vector<double>& wanted, const std::vector<double>& times) {
  std::vector<Index> positions;
  positions.reserve(wanted.size());
  auto next = times.begin();
  for (const double time : wanted) {
    next = std::lower_bound(next, times.end(), time);
    if (next == times.end()) break;
    if (*next == time) positions.push_back(next - times.begin());
  }
  return positions;
}

Grid Refine(const Grid& grid, Index nodes_kept) {
  Grid fine = Halve(grid);
  if (fine.num_steps() <= nodes_kept) {
    fine.output_nodes.resize(fine.times.size());
    std::iota(fine.output_nodes.begin(), fine.output_nodes.end(), Index{0});
  }
  return fine;
}

}  // namespace

double Convergence::order() const {
  if (!shows_order()) return 1;
  const double* d = &differences_.back();
  if (!(d[0] > 0 && d[-1] > 0 && d[-2] > 0)) return 1;
  return std::clamp(std::min(std::log2(d[-1] / d[0]), std::log2(d[-2] / d[-1])), 0.5, 2.0);
}

double Convergence::error() const {
  const double* d = &differences_.back();
  const double rate = std::exp2(order());
  const double expected = differences_.size() >= 2 ? NanMax(d[0], d[-1] / rate) : d[0];
  return expected / (rate - 1);
}

namespace {

// RelativeDifference() of what is added block by block.
class RowDifferences {
 public:
  explicit RowDifferences(Index rows) : difference_(Vector::Zero(rows)), size_(Vector::Zero(rows)) {}

  void Add(const Matrix& coarse, const Matrix& fine) {
    RaiseRowMaxAbs(coarse - fine, difference_);
    RaiseRowMaxAbs(fine, size_);
  }

  double Relative() const {
    constexpr double kLeastPart = 1e-6;
    const double floor = kLeastPart * MaxAbs(size_);
    double largest = 0;
    for (Index i = 0; i < difference_.size(); ++i) {
      if (difference_[i] != 0) largest = NanMax(largest, difference_[i] / std::max(size_[i], floor));
    }
    return largest;
  }

 private:
  Vector difference_, size_;  // of each row, the largest
};

// Of x, and of B y where `y_counts`, at the times of `coarse`. Trajectories may be larger than the memory that is left:
// they are compared a few columns at a time.
double DifferenceBetween(const Solution& coarse, const Solution& fine, const StructuredMatrix& B, bool y_counts) {
  constexpr Index kNumbersAtOnce = Index{1} << 16;
  const std::vector<Index> positions = PositionsOf(coarse.times, fine.times);
  const auto count = static_cast<Index>(positions.size());
  RowDifferences x(fine.x.rows()), By(B.rows());
  const Index columns_at_once = std::max<Index>(1, kNumbersAtOnce / std::max(fine.x.rows(), fine.y.rows()));
  std::vector<Index> of_fine;
  for (Index first = 0; first < count; first += columns_at_once) {
    const Index last = std::min(count, first + columns_at_once);
    of_fine.assign(positions.begin() + first, positions.begin() + last);
    x.Add(coarse.x.middleCols(first, last - first), fine.x(Eigen::all, of_fine));
    if (!y_counts) continue;
    const Matrix y = fine.y(Eigen::all, of_fine);
    By.Add(B * coarse.y.middleCols(first, last - first), B * y);
  }
  return y_counts ? NanMax(x.Relative(), By.Relative()) : x.Relative();
}

// Two grids that agree to the last bit where x' is far from the system within a step: neither has seen what is there,
// such as a jump that all their nodes are on the same sides of.
bool AgreesByChance(double difference, const Solution& fine, double tolerance) {
  const Certificate& seen = fine.certificate;
  return difference == 0 && seen.ode_defect * fine.step > tolerance * seen.x_scale;
}

}  // namespace

double RelativeDifference(const Matrix& coarse, const Matrix& fine) {
  RowDifferences differences(fine.rows());
  differences.Add(coarse, fine);
  return differences.Relative();
}

absl::StatusOr<ControlledSolution> SolveToTolerance(
    const Problem& problem, const StepControl& control, Grid grid,
    const std::function<absl::StatusOr<Solution>(const Grid&)>& solve) {
  ControlledSolution result;
  std::optional<Solution> coarse;
  Convergence convergence;
  while (true) {
    absl::StatusOr<Solution> fine = solve(grid);
    if (!fine.ok()) return fine.status();
    const bool solved = fine->termination == Termination::kReachedEnd;
    if (solved && coarse) {
      convergence.Add(DifferenceBetween(*coarse, *fine, problem.B, control.y_counts));
      result.error = convergence.error();
      result.order = convergence.order();
    }
    result.solution = *std::move(fine);
    if (!solved) {
      if (FailsForAnyStep(result.solution.termination) || grid.num_steps() > kMostFailingSteps) return result;
      coarse.reset();
      convergence = {};
      result.error = std::numeric_limits<double>::quiet_NaN();
    } else {
      result.reached = convergence.shows_order() && kSafety * result.error <= control.tolerance &&
                       !AgreesByChance(convergence.last_difference(), result.solution, control.tolerance);
      const double steps = static_cast<double>(grid.num_steps());
      const double least_steps = steps * std::sqrt(result.error / control.tolerance);
      const bool hopeless =
          grid.num_steps() >= kHopelessSteps && least_steps > 100.0 * static_cast<double>(control.most_steps);
      if (result.reached || hopeless) return result;
      if (2 * grid.num_steps() > control.most_steps) return result;
      coarse = std::move(result.solution);
    }
    grid = Refine(grid, control.nodes_kept);
  }
}

void KeepTimes(const std::vector<double>& wanted, Solution& solution) {
  const std::vector<Index> kept = PositionsOf(wanted, solution.times);
  if (kept.size() == solution.times.size()) return;
  std::vector<double> times;
  std::vector<LeftLimit> left_limits;
  auto limit = solution.left_limits.begin();
  for (std::size_t k = 0; k < kept.size(); ++k) {
    times.push_back(solution.times[kept[k]]);
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
