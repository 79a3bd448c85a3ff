// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/group_nodes.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <stdexcept>
#include <utility>

#include "core/format_number.h"
#include "core/mpi/distributed_operator.h"
#include "core/mpi/distributed_sector.h"
#include "core/mpi/row_exchange.h"
#include "core/stepping/iterative_system.h"

namespace dlcs {
namespace {

using Complex = std::complex<double>;

// Of solves for the node of a contour that counts most, and for others.
constexpr double kTolerance = 1e-13, kLoosest = 1e-6;

double ToleranceAt(const StepContours& contours, Index p) {
  const Complex vertex = (contours.is_near(p) ? contours.near : contours.far).front().z;
  const double decay = (contours.node(p).z.real() - vertex.real()) / 2;  // at the shortest time, half a step
  return std::min(kLoosest, kTolerance * std::exp(-decay));
}

std::string TextOf(Complex z) {
  return FormatNumber(z.real()) + (z.imag() < 0 ? " - " : " + ") + FormatNumber(std::abs(z.imag())) + "i";
}

}  // namespace

std::unique_ptr<GroupNodes> GroupNodes::Create(const Problem& problem, const Options& options, RankGroups& groups,
                                               std::string& why_not) {
  MpiTeam& group = groups.group();
  const Index m = problem.num_states(), n = problem.num_constraints();
  if (m < group.size()) {
    why_not = "there are fewer states than ranks in a group";
    return nullptr;
  }
  Ownership states = Ownership::Blocks(m, group.size());
  const std::vector<Index> numbers = states.rows(group.rank());
  const RowMajorMatrix A = RowsOf(problem.A, states, group);
  const RowMajorMatrix E = problem.has_mass() ? RowsOf(problem.E, states, group) : RowMajorMatrix();
  // Entries with their copies while a cycle is made, its levels, and vectors.
  constexpr int kBytesOfAnEntry = 110, kVectors = ShiftedSystem::kRestart + 16;
  const double bytes = kBytesOfAnEntry * static_cast<double>(A.nonZeros() + E.nonZeros()) +
                       static_cast<double>(A.rows()) * (16 * kVectors + 8 * static_cast<double>(n + kNarrowLift));
  if (group.Max(bytes) > options.max_memory) {
    why_not = "the rows of a rank on a contour need some " + FormatNumber(group.Max(bytes)) + " bytes, more than " +
              MemoryLimitText(options);
    return nullptr;
  }
  const RowMajorMatrix transposed = Transposed(A, numbers, m, states, group);
  Workers workers(options.num_threads);
  const auto sector = FindDistributedSector(A, transposed, E, problem.horizon, states, workers, group);
  if (!sector) {
    why_not = WhyNoSector(problem.has_mass(), problem.horizon) +
              "; or this is not to be seen from the sizes of entries, without a factorization, which groups of ranks "
              "do not make (--ranks-per-group 1 does)";
    return nullptr;
  }
  const Ownership rows_of_N = Ownership::Blocks(n, group.size());
  RowMajorMatrix columns_of_N =
      Transposed(RowsOf(problem.N, rows_of_N, group), rows_of_N.rows(group.rank()), n, states, group);
  std::unique_ptr<GroupNodes> nodes(
      new GroupNodes(std::move(columns_of_N), *sector, group.Max(bytes), std::move(states), groups));
  const bool is_symmetric = !group.Any(!DifferByRounding(A, transposed));
  nodes->system_ = std::make_unique<ShiftedSystem>(A, E, is_symmetric, nodes->states_, group);
  return nodes;
}

GroupNodes::GroupNodes(RowMajorMatrix columns_of_N, const Sector& sector, double bytes, Ownership states,
                       RankGroups& groups)
    : states_(std::move(states)),
      first_row_(states_.first(groups.group().rank())),
      own_rows_(states_.count(groups.group().rank())),
      columns_of_N_(std::move(columns_of_N)),
      sector_(sector),
      bytes_(bytes),
      groups_(groups) {}

SparseMatrix GroupNodes::OwnRows(const StructuredMatrix& matrix) const {
  return RowsOf(matrix, states_, groups_.group());
}

Matrix GroupNodes::OwnRows(Matrix columns) const { return columns.middleRows(first_row_, own_rows_); }

Vector GroupNodes::Observe(const Vector& x) const {
  const Vector own = x.segment(first_row_, own_rows_);
  Eigen::MatrixXcd sum = (columns_of_N_.transpose() * own).cast<Complex>();
  SumOverRanks(sum, groups_.group());
  return sum.real();
}

Eigen::MatrixXcd GroupNodes::Solve(double step, const StepContours& contours, Index p,
                                   const Eigen::MatrixXcd& columns) {
  const Complex z = contours.node(p).z / step;
  const double tolerance = ToleranceAt(contours, p);
  Eigen::MatrixXcd solved(columns.rows(), columns.cols());
  Eigen::VectorXcd x;
  for (Index k = 0; k < columns.cols() && failure_.empty(); ++k) {
    const bool is_solved = system_->Solve(z, columns.col(k), tolerance, x);
    solved.col(k) = x;
    if (is_solved) continue;
    failure_ = "The Krylov method for (zE - A) x = b at z = " + TextOf(z) + ", a node of a contour, leaves x with an " +
               "error of " + FormatNumber(system_->error()) + ", and " + FormatNumber(tolerance) +
               " is needed. With --ranks-per-group 1 each rank factors matrices instead.";
  }
  return solved;
}

bool GroupNodes::ForRounds(const StepContours& contours, const std::function<void(Index p)>& visit,
                           const std::function<void(Index first, Index end)>& share, const std::stop_token& stop) {
  const Index count = groups_.peers().size();
  for (Index first = 0; first < contours.size(); first += count) {
    const Index own = first + groups_.peers().rank();
    if (own < contours.size()) visit(own);
    // Requests to stop come with this.
    if (const std::string failure = groups_.world().FirstText(std::exchange(failure_, "")); !failure.empty()) {
      throw std::runtime_error(failure);
    }
    if (stop.stop_requested()) return false;
    share(first, std::min(first + count, contours.size()));
  }
  return true;
}

std::vector<TransferValues> GroupNodes::Values(double step, const StepContours& contours,
                                               const std::vector<Matrix>& groups, Workers& /*workers*/,
                                               const std::stop_token& stop) {
  const Index n = columns_of_N_.cols();
  std::vector<TransferValues> values;
  for (const Matrix& columns : groups) {
    values.emplace_back(static_cast<std::size_t>(contours.size()), Eigen::MatrixXcd(n, columns.cols()));
  }
  const auto visit = [&](Index p) {
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const Eigen::MatrixXcd solved = Solve(step, contours, p, groups[g].cast<Complex>());
      Eigen::MatrixXcd& value = values[g][static_cast<std::size_t>(p)];
      value.real() = columns_of_N_.transpose() * solved.real();
      value.imag() = columns_of_N_.transpose() * solved.imag();
      SumOverRanks(value, groups_.group());
      value *= contours.node(p).weight;
    }
  };
  const auto share = [&](Index first, Index end) {
    for (Index p = first; p < end; ++p) {
      for (TransferValues& of_group : values) {
        ShareMatrix(groups_.peers(), static_cast<int>(p - first), of_group[static_cast<std::size_t>(p)]);
      }
    }
  };
  if (!ForRounds(contours, visit, share, stop)) values.clear();
  return values;
}

Matrix GroupNodes::States(double step, const StepContours& contours, const Matrix& columns, Index outputs,
                          const Excitation& excite, Workers& /*workers*/, const std::stop_token& stop) {
  Matrix sum = Matrix::Zero(columns.rows(), outputs);
  const auto visit = [&](Index p) {
    Eigen::MatrixXcd excited(columns.cols(), outputs);
    excite(p, excited);
    if (outputs <= columns.cols()) {
      sum += Solve(step, contours, p, columns * excited).real();
      return;
    }
    for (Index k = 0; k < columns.cols(); ++k) {
      const Eigen::MatrixXcd solved = Solve(step, contours, p, columns.col(k).cast<Complex>());
      sum.noalias() += solved.real() * Matrix(excited.row(k).real());
      sum.noalias() -= solved.imag() * Matrix(excited.row(k).imag());
    }
  };
  if (!ForRounds(
          contours, visit, [](Index, Index) {}, stop))
    return Matrix::Zero(states_.size(), outputs);
  return Collect(SumOverTeam(groups_.peers(), sum), states_, groups_.group());
}

double GroupNodes::PredictBytes(double /*nodes*/) const { return bytes_; }

void GroupNodes::Report(PropagatorRecord& record) const {
  const int count = groups_.peers().size(), ranks = groups_.group().size();
  record.reason += "; " + std::to_string(count) + (count == 1 ? " group" : " groups") + " of " + std::to_string(ranks) +
                   " ranks by Krylov methods";
  const auto own = static_cast<double>(groups_.group().rank() == 0 ? system_->iterations() : 0);
  record.linear_iterations = static_cast<Index>(groups_.world().Sum(own));
}

}  // namespace dlcs
