// SPDX-License-Identifier: Apache-2.0
// A large sparse system with few constraints, propagated on contours.

#ifndef DLCS_CORE_PROPAGATOR_CONTOUR_SYSTEM_H_
#define DLCS_CORE_PROPAGATOR_CONTOUR_SYSTEM_H_

#include <memory>
#include <string>
#include <vector>

#include "core/problem/options.h"
#include "core/propagator/contour_kernel.h"
#include "core/propagator/node_solver.h"
#include "core/propagator/propagator.h"
#include "core/shared_setups.h"

namespace dlcs {

// K_k = N (zE - A)⁻¹ B, and with it all that a reduced solve needs, inverted on two contours for each length of step
// (core/propagator/contour_response.h): some 30 nodes for the first steps, and some 60 to 120 for all later ones,
// however many. Each is one sparse factorization of zE - A, and a solve for each column of B, of the lift of f, and E
// x0, all in one pass over the nodes. Columns that are not known then (another start, the states at output nodes) take
// further passes, with the same factors as far as Options::max_memory allows them to be kept. The values for B and the
// lift, some megabytes, do not depend on the start: solves of the same matrices share them, and a solve with another
// start makes a pass for one column only.
//
// Who solves at the nodes is a NodeSolver: each process of a team factors its part of them, or groups of processes
// share them (Team::node_solver_groups()).
//
// The contours enclose a sector that is proven to contain the field of values (core/propagator/sector.h).
class ContourSystem final : public Propagator {
 public:
  // Null if the spectrum has no contour over [0, T], or if what one node takes does not fit into memory; `why_not` says
  // which. Options::max_memory decides how many nodes are factored at the same time. `setups` may be null; otherwise it
  // must outlive the system.
  static std::unique_ptr<ContourSystem> Create(const Problem& problem, const Options& options, std::string& why_not,
                                               SetupCache* setups = nullptr);

  std::shared_ptr<const ReducedKernel> MakeKernel(double step, Hold hold, Index longest_window, Workers& workers,
                                                  const std::stop_token& stop) override;
  FreeMotion Move(const Vector& x, const RunSources& sources, Hold hold, Workers& workers,
                  const std::stop_token& stop) override;
  // Cost: a pass over all nodes (NodeSolver::States()).
  Matrix States(const Vector& x, const RunSources& sources, const Matrix& y, Hold hold, const std::vector<Index>& nodes,
                Workers& workers, const std::stop_token& stop) override;
  // What nodes take, and values there, for the contours of all lengths of steps, to a factor of two.
  double PredictBytes(const Grid& grid) const override;
  PropagatorRecord record() const override;

 private:
  // The values kept for one step length.
  struct StepValues {
    double step = 0;
    StepContours contours;
    std::shared_ptr<const TransferValues> of_inputs;  // columns of B, and of the lift where it is narrow
    TransferValues of_start;                          // E x0
  };
  // f = columns · signal, signal r × J + 1.
  struct Sources {
    Matrix columns;  // own rows × r; empty if they are the columns of the lift, whose values are kept
    Matrix signal;
  };

  ContourSystem(const Problem& problem, std::unique_ptr<NodeSolver> nodes, SetupKey matrices, SetupCache* setups);

  StepContours MakeContours(double step, Index steps) const;
  // Null where `stop` was requested.
  const StepValues* At(double step, Index steps, Workers& workers, const std::stop_token& stop);
  // E x, as a column of own rows.
  Matrix Weighted(const Vector& x) const { return nodes_->OwnRows(E_.rows() > 0 ? Matrix(E_ * x) : Matrix(x)); }
  Sources Split(const RunSources& sources) const;
  static TransferValues Part(const TransferValues& values, Index first, Index count);

  const std::unique_ptr<NodeSolver> nodes_;
  const Index constraints_;
  SparseMatrix B_, own_lift_;  // own rows
  StructuredMatrix E_;         // 0 × 0 for the identity
  StructuredMatrix lift_;
  bool keeps_lift_ = false;
  Vector x0_;
  double horizon_;
  SetupKey matrices_;
  SharedSetups setups_;
  std::vector<std::unique_ptr<StepValues>> steps_;
  struct KeptKernel {
    double step;
    Hold hold;
    std::shared_ptr<const ContourKernel> kernel;
  };
  std::vector<KeptKernel> kernels_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_CONTOUR_SYSTEM_H_
