// SPDX-License-Identifier: Apache-2.0
// Solves at the nodes of contours by Krylov methods, each in a group of ranks.

#ifndef DLCS_CORE_MPI_GROUP_NODES_H_
#define DLCS_CORE_MPI_GROUP_NODES_H_

#include <complex>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/mpi/ownership.h"
#include "core/mpi/rank_groups.h"
#include "core/mpi/shifted_system.h"
#include "core/propagator/node_solver.h"

namespace dlcs {

// The groups visit the nodes in rounds: group k of c the nodes k, k + c, k + 2c, ... A rank has the rows of A, B and E
// of its block of states, and the columns of N for them, and solves for them (core/mpi/shifted_system.h). What is
// common to all ranks after a round are the n × n blocks of its nodes, and whether one was asked to stop. States at
// output times are summed over the groups by rows, and collected once.
//
// A node counts by e^{t Re z} at times t from half a step on, so the far ends of a contour, where equations are hard to
// solve, are solved with tolerances that grow as this decays, from 1e-13 to at most 1e-6.
//
// All functions are called by all ranks. The bits depend on the number of ranks in a group and on the number of groups;
// those of Values() on the former alone.
class GroupNodes final : public NodeSolver {
 public:
  // Null if FindDistributedSector() finds no contour over [0, T], or a rank has no states, or its rows do not fit into
  // Options::max_memory; `why_not` says which. `groups` must outlive it.
  static std::unique_ptr<GroupNodes> Create(const Problem& problem, const Options& options, RankGroups& groups,
                                            std::string& why_not);

  const Sector& sector() const override { return sector_; }
  SparseMatrix OwnRows(const StructuredMatrix& matrix) const override;
  Matrix OwnRows(Matrix columns) const override;
  Vector Observe(const Vector& x) const override;
  std::vector<TransferValues> Values(double step, const StepContours& contours, const std::vector<Matrix>& groups,
                                     Workers& workers, const std::stop_token& stop) override;
  Matrix States(double step, const StepContours& contours, const Matrix& columns, Index outputs,
                const Excitation& excite, Workers& workers, const std::stop_token& stop) override;
  double PredictBytes(double nodes) const override;
  void Report(PropagatorRecord& record) const override;

 private:
  GroupNodes(RowMajorMatrix columns_of_N, const Sector& sector, double bytes, Ownership states, RankGroups& groups);

  // Calls visit(p) for the nodes of this group, and after each round, with all ranks, share(first, end) for the nodes
  // of the round. Returns false, in all ranks, once one was asked to stop. Throws, in all ranks, where visit() did not
  // succeed in one.
  bool ForRounds(const StepContours& contours, const std::function<void(Index p)>& visit,
                 const std::function<void(Index first, Index end)>& share, const std::stop_token& stop);
  // (zE - A)⁻¹ columns for a node. Where they are not found, says so in failure_.
  Eigen::MatrixXcd Solve(double step, const StepContours& contours, Index p, const Eigen::MatrixXcd& columns);

  const Ownership states_;  // blocks
  const Index first_row_, own_rows_;
  const RowMajorMatrix columns_of_N_;  // own columns × n
  const Sector sector_;
  const double bytes_;
  RankGroups& groups_;
  std::unique_ptr<ShiftedSystem> system_;
  std::string failure_;
};

// Makes the solvers of the nodes for each propagator.
class GroupNodeSolvers final : public NodeSolverGroups {
 public:
  // Arguments as for RankGroups.
  GroupNodeSolvers(MpiTeam& world, int ranks_per_group) : groups_(world, ranks_per_group) {}

  RankGroups& ranks() { return groups_; }
  std::unique_ptr<NodeSolver> MakeSolver(const Problem& problem, const Options& options,
                                         std::string& why_not) override {
    return GroupNodes::Create(problem, options, groups_, why_not);
  }

 private:
  RankGroups groups_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_GROUP_NODES_H_
