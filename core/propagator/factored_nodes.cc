// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/factored_nodes.h"

#include <algorithm>
#include <cmath>

#include "core/format_number.h"

namespace dlcs {
namespace {

// The number of right-hand sides solved together.
constexpr Index kColumnsAtOnce = 8;
// Sums of states that are formed at the same time, where they fit; a cut that does not depend on the threads.
constexpr Index kPartialSums = 4;
constexpr Index kPartialSumBytes = 1'000'000'000;

// The factors of zE - A: twice as many numbers as the Cholesky factor, complex, with their indices and some room.
double FactorBytes(const Sector& sector) { return 1.3 * 2 * sector.factor_nonzeros * 20; }

}  // namespace

std::unique_ptr<FactoredNodes> FactoredNodes::Create(const Problem& problem, const Options& options,
                                                     std::string& why_not) {
  const auto sector = FindSector(problem.A.Sparse(), problem.horizon, problem.E.Sparse());
  if (!sector) {
    why_not = WhyNoSector(problem.has_mass(), problem.horizon);
    return nullptr;
  }
  const double columns = static_cast<double>(problem.num_constraints() + kNarrowLift);
  const double m = static_cast<double>(problem.num_states());
  const int threads = Workers(options.num_threads).max_threads();
  const double each = FactorBytes(*sector) + 6 * 16 * m * kColumnsAtOnce, all = 8 * m * columns;
  // As many at once as fit into half of the memory, so that factors can be kept in the rest.
  const double fitting = std::floor((options.max_memory / 2 - all) / each);
  const int at_once = static_cast<int>(std::clamp(fitting, 1.0, static_cast<double>(threads)));
  const double needed = at_once * each + all;
  if (needed > options.max_memory) {
    why_not = "the sparse factors on a contour need some " + FormatNumber(needed) + " bytes, more than " +
              MemoryLimitText(options);
    return nullptr;
  }
  // Takes half of the remaining memory. The states and the trajectory need the rest.
  return std::unique_ptr<FactoredNodes>(
      new FactoredNodes(problem, *sector, needed, (options.max_memory - needed) / 2, at_once, threads));
}

FactoredNodes::FactoredNodes(const Problem& problem, const Sector& sector, double needed_bytes, double kept_bytes,
                             int at_once, int threads)
    : N_(problem.N.Sparse()),
      sector_(sector),
      needed_bytes_(needed_bytes),
      kept_bytes_(kept_bytes),
      resolvent_(problem.A.Sparse(), problem.E.Sparse(), kept_bytes),
      few_workers_(at_once < threads ? std::make_unique<Workers>(at_once) : nullptr),
      at_once_(at_once),
      team_(Team::Current()) {}

std::vector<TransferValues> FactoredNodes::Values(double step, const StepContours& contours,
                                                  const std::vector<Matrix>& groups, Workers& workers,
                                                  const std::stop_token& stop) {
  std::vector<TransferValues> values;
  for (const Matrix& columns : groups) {
    values.emplace_back(static_cast<std::size_t>(contours.size()), Eigen::MatrixXcd(N_.rows(), columns.cols()));
  }
  (few_workers_ ? *few_workers_ : workers).ForBlocks(contours.size(), 1, [&](Index, Index p, Index) {
    if (stop.stop_requested() || !team_.Owns(p)) return;
    const ContourNode& node = contours.node(p);
    const auto factor = resolvent_.At(node.z / step);
    for (std::size_t g = 0; g < groups.size(); ++g) {
      for (Index begin = 0; begin < groups[g].cols(); begin += kColumnsAtOnce) {
        const Index count = std::min(kColumnsAtOnce, groups[g].cols() - begin);
        const Eigen::MatrixXcd solved = factor->Solve(groups[g].middleCols(begin, count).cast<Complex>());
        values[g][static_cast<std::size_t>(p)].middleCols(begin, count) = node.weight * (N_.cast<Complex>() * solved);
      }
    }
  });
  if (stop.stop_requested()) values.clear();
  for (TransferValues& of_group : values) {
    for (Index p = 0; p < contours.size(); ++p)
      ShareMatrix(team_, team_.OwnerOf(p), of_group[static_cast<std::size_t>(p)]);
  }
  return values;
}

Matrix FactoredNodes::States(double step, const StepContours& contours, const Matrix& columns, Index outputs,
                             const Excitation& excite, Workers& workers, const std::stop_token& stop) {
  const Index m = columns.rows();
  const Index parts = 8.0 * kPartialSums * static_cast<double>(m * outputs) <= kPartialSumBytes ? kPartialSums : 1;
  std::vector<Matrix> sums(static_cast<std::size_t>(parts), Matrix::Zero(m, outputs));
  // The nodes that Values() gives to this process, whose factors may be kept.
  const Index stride = parts * team_.size();
  (few_workers_ ? *few_workers_ : workers).ForBlocks(parts, 1, [&](Index part, Index, Index) {
    Matrix& sum = sums[static_cast<std::size_t>(part)];
    Eigen::MatrixXcd excited(columns.cols(), outputs);
    for (Index p = part * team_.size() + team_.rank(); p < contours.size() && !stop.stop_requested(); p += stride) {
      excite(p, excited);
      const auto factor = resolvent_.At(contours.node(p).z / step);
      const Index solves = std::min(outputs, excited.rows());
      for (Index first = 0; first < solves; first += kColumnsAtOnce) {
        const Index count = std::min(kColumnsAtOnce, solves - first);
        if (outputs <= excited.rows()) {
          sum.middleCols(first, count) += factor->Solve(columns * excited.middleCols(first, count)).real();
        } else {
          const Eigen::MatrixXcd solved = factor->Solve(columns.middleCols(first, count).cast<Complex>());
          const Eigen::MatrixXcd part_excited = excited.middleRows(first, count);
          sum.noalias() += solved.real() * Matrix(part_excited.real());
          sum.noalias() -= solved.imag() * Matrix(part_excited.imag());
        }
      }
    }
  });
  for (std::size_t part = 1; part < sums.size(); ++part) sums[0] += sums[part];
  return team_.is_alone() ? std::move(sums[0]) : SumOverTeam(team_, sums[0]);
}

double FactoredNodes::PredictBytes(double nodes) const {
  return needed_bytes_ + std::min(kept_bytes_, nodes * FactorBytes(sector_));
}

void FactoredNodes::Report(PropagatorRecord& record) const {
  if (few_workers_) {
    const std::string count = at_once_ == 1 ? "one factorization" : std::to_string(at_once_) + " factorizations";
    record.reason += "; the memory allowed (--max-memory) is enough for " + count + " at a time";
  }
  record.factorizations = static_cast<Index>(team_.Sum(static_cast<double>(resolvent_.factorizations())));
}

}  // namespace dlcs
