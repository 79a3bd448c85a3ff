// SPDX-License-Identifier: Apache-2.0
// A large sparse system with few constraints, propagated on contours.

#ifndef DLCS_CORE_PROPAGATOR_CONTOUR_SYSTEM_H_
#define DLCS_CORE_PROPAGATOR_CONTOUR_SYSTEM_H_

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/problem/options.h"
#include "core/propagator/contour_kernel.h"
#include "core/propagator/propagator.h"
#include "core/propagator/sector.h"
#include "core/propagator/sparse_resolvent.h"
#include "core/shared_setups.h"

namespace dlcs {

// K_k = N (zI - A)⁻¹ B, and with it all that a reduced solve needs, inverted on two contours for each length of step
// (core/propagator/contour_response.h): some 30 nodes for the first steps, and some 60 to 120 for all later ones,
// however many. Each is one sparse factorization of zI - A, and a solve for each column of B, of the lift of f, and x0,
// all in one visit. What is not known then, another start or the states at output nodes, takes further visits, with the
// same factors as far as Options::max_memory lets them be kept. The values for B and the lift, some megabytes, do not depend on
// the start: solves of the same matrices share them, and with another start visit the nodes for one column.
//
// The contours enclose a sector that is proved to hold the field of values (core/propagator/sector.h).
class ContourSystem final : public Propagator {
 public:
  // Null, and `why_not` for people, where the spectrum has no contour over [0, T], or the factors do not fit the
  // memory. `setups` may be null; otherwise it must outlive the system.
  static std::unique_ptr<ContourSystem> Create(const Problem& problem, const Options& options, std::string& why_not,
                                               SetupCache* setups = nullptr);

  std::shared_ptr<const ReducedKernel> MakeKernel(double step, Hold hold, Index longest_window, Workers& workers,
                                                  const std::stop_token& stop) override;
  FreeMotion Move(const Vector& x, const RunSources& sources, Hold hold, Workers& workers,
                  const std::stop_token& stop) override;
  // Cost: a visit of all nodes, with a solve for each output or each column, whichever are fewer.
  Matrix States(const Vector& x, const RunSources& sources, const Matrix& y, Hold hold, const std::vector<Index>& nodes,
                Workers& workers, const std::stop_token& stop) override;
  // Factors and values at the nodes of the contours for all lengths of steps, to a factor of two.
  double PredictBytes(const Grid& grid) const override;
  PropagatorRecord record() const override;

 private:
  // What is kept for a length of step.
  struct StepValues {
    double step = 0;
    StepContours contours;
    std::shared_ptr<const TransferValues> of_inputs;  // columns of B, and of the lift where it is narrow
    TransferValues of_start;                          // x0
  };
  // f = columns · signal, signal r × J + 1.
  struct Sources {
    Matrix columns;  // m × r; empty where they are those of the lift that are kept
    Matrix signal;
  };

  // `needed_bytes` are used at any time, `kept_bytes` at most are kept of factors.
  ContourSystem(const Problem& problem, const Sector& sector, double needed_bytes, double kept_bytes, SetupCache* setups);

  StepContours MakeContours(double step, Index steps) const;
  // Null where `stop` was requested.
  const StepValues* At(double step, Index steps, Workers& workers, const std::stop_token& stop);
  // N (zI - A)⁻¹ columns at all nodes, weighted, for each of `groups`; what it is for one group does not depend on the others.
  // Empty where `stop` was requested.
  std::vector<TransferValues> Visit(double step, const StepContours& contours, const std::vector<Matrix>& groups,
                                    Workers& workers, const std::stop_token& stop);
  Sources Split(const RunSources& sources) const;
  static TransferValues Part(const TransferValues& values, Index first, Index count);

  SparseMatrix N_, B_;
  StructuredMatrix lift_;
  bool keeps_lift_ = false;
  Vector x0_;
  double horizon_;
  Sector sector_;
  double needed_bytes_, kept_bytes_;
  SparseResolvent resolvent_;
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
