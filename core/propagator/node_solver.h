// SPDX-License-Identifier: Apache-2.0
// Solves with zE - A at the nodes of contours.

#ifndef DLCS_CORE_PROPAGATOR_NODE_SOLVER_H_
#define DLCS_CORE_PROPAGATOR_NODE_SOLVER_H_

#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "core/linalg/structured_matrix.h"
#include "core/parallel/parallel.h"
#include "core/parallel/team.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"
#include "core/propagator/contour_response.h"
#include "core/propagator/sector.h"

namespace dlcs {

// Columns of a lift that are solved for with those of B; of wider ones the rank of ψ is used.
inline constexpr Index kNarrowLift = 16;

// `matrix` of the process `owner` of a team, in all of them.
inline void ShareMatrix(Team& team, int owner, Eigen::MatrixXcd& matrix) {
  team.Share(owner, reinterpret_cast<double*>(matrix.data()), 2 * matrix.size());
}

// The sum of `own` over the processes of a team, in their order: all get the same bits.
inline Matrix SumOverTeam(Team& team, const Matrix& own) {
  Matrix sum = Matrix::Zero(own.rows(), own.cols());
  for (int rank = 0; rank < team.size(); ++rank) {
    Matrix of_rank = own;
    team.Share(rank, of_rank.data(), of_rank.size());
    sum += of_rank;
  }
  return sum;
}

// What a contour needs of A, E and N. In a team all processes call the same functions, and get the same results.
class NodeSolver {
 public:
  // Sets what stands before the columns at node p, times the weight of the node: columns × outputs.
  using Excitation = std::function<void(Index p, Eigen::Ref<Eigen::MatrixXcd> excited)>;

  virtual ~NodeSolver() = default;

  // That of the field of values: contours enclose it.
  virtual const Sector& sector() const = 0;
  // Of a matrix with a row for each state, the rows that Values() and States() want: all, or those of this process.
  virtual SparseMatrix OwnRows(const StructuredMatrix& matrix) const = 0;
  virtual Matrix OwnRows(Matrix columns) const = 0;
  // N x.
  virtual Vector Observe(const Vector& x) const = 0;

  // N (zE - A)⁻¹ columns at all nodes, weighted, for each of `groups`; the result for one group does not depend on the
  // others. The contours are those of steps of length one, and z is node over `step`. Empty where `stop` was requested.
  // Errors: std::runtime_error where equations are not solved, in all processes.
  virtual std::vector<TransferValues> Values(double step, const StepContours& contours,
                                             const std::vector<Matrix>& groups, Workers& workers,
                                             const std::stop_token& stop) = 0;
  // Σ_p Re (zE - A)⁻¹ columns · excited_p: all rows, states × `outputs`. Zero where `stop` was requested. Errors as
  // above. Cost: for each node a solve for each output or each column, whichever are fewer.
  virtual Matrix States(double step, const StepContours& contours, const Matrix& columns, Index outputs,
                        const Excitation& excite, Workers& workers, const std::stop_token& stop) = 0;

  // What it keeps for contours of that many nodes.
  virtual double PredictBytes(double nodes) const = 0;
  // Adds its work, and what the reason should say of it.
  virtual void Report(PropagatorRecord& record) const = 0;
};

// Groups of processes of a team, which share the nodes.
class NodeSolverGroups {
 public:
  virtual ~NodeSolverGroups() = default;

  // Null with a reason in `why_not` if the system is not served. Called by all processes.
  virtual std::unique_ptr<NodeSolver> MakeSolver(const Problem& problem, const Options& options,
                                                 std::string& why_not) = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_NODE_SOLVER_H_
