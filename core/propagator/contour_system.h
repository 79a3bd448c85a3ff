// SPDX-License-Identifier: Apache-2.0
// A large sparse system with few constraints, propagated on contours.

#ifndef DLCS_CORE_PROPAGATOR_CONTOUR_SYSTEM_H_
#define DLCS_CORE_PROPAGATOR_CONTOUR_SYSTEM_H_

#include <complex>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "core/linalg/sparse/sparse_factor.h"
#include "core/parallel/team.h"
#include "core/problem/options.h"
#include "core/propagator/contour_kernel.h"
#include "core/propagator/propagator.h"
#include "core/propagator/sector.h"
#include "core/shared_setups.h"

namespace dlcs {

// The factorizations of zE - A, one for each z, kept for later calls as long as they fill no more than `kept_bytes`.
// Threads: all functions may be called concurrently; results do not depend on which factors were kept.
class SparseResolvent {
 public:
  using Complex = std::complex<double>;
  using Factor = SparseFactor<Complex>;

  SparseResolvent(SparseMatrix A, SparseMatrix E, double kept_bytes)
      : A_(std::move(A)), E_(std::move(E)), order_(SparseOrder(A_, E_)), free_bytes_(kept_bytes) {}

  Index size() const { return A_.rows(); }
  Index factorizations() const {
    const std::scoped_lock lock(mutex_);
    return factorizations_;
  }

  std::shared_ptr<const Factor> At(Complex z) {
    {
      const std::scoped_lock lock(mutex_);
      const auto found = kept_.find({z.real(), z.imag()});
      if (found != kept_.end()) return found->second;
    }
    auto factor = std::make_shared<const Factor>(A_, order_, z, 1.0, E_);
    const std::scoped_lock lock(mutex_);
    ++factorizations_;
    if (factor->bytes() <= free_bytes_ && kept_.emplace(std::pair(z.real(), z.imag()), factor).second) {
      free_bytes_ -= factor->bytes();
    }
    return factor;
  }

 private:
  const SparseMatrix A_, E_;
  const Factor::Order order_;
  mutable std::mutex mutex_;
  std::map<std::pair<double, double>, std::shared_ptr<const Factor>> kept_;
  double free_bytes_;
  Index factorizations_ = 0;
};

// K_k = N (zE - A)⁻¹ B, and with it all that a reduced solve needs, inverted on two contours for each length of step
// (core/propagator/contour_response.h): some 30 nodes for the first steps, and some 60 to 120 for all later ones,
// however many. Each is one sparse factorization of zE - A, and a solve for each column of B, of the lift of f, and E
// x0, all in one pass over the nodes. Columns that are not known then (another start, the states at output nodes) take
// further passes, with the same factors as far as Options::max_memory allows them to be kept. The values for B and the
// lift, some megabytes, do not depend on the start: solves of the same matrices share them, and a solve with another
// start makes a pass for one column only.
//
// In a team each process visits its part of the nodes, and n × n blocks travel; of States() sums of states do.
//
// The contours enclose a sector that is proven to contain the field of values (core/propagator/sector.h).
class ContourSystem final : public Propagator {
 public:
  // Null if the spectrum has no contour over [0, T], or if the factors of one node do not fit into memory; `why_not`
  // says which. Options::max_memory decides how many nodes are factored at the same time.
  // `setups` may be null; otherwise it must outlive the system.
  static std::unique_ptr<ContourSystem> Create(const Problem& problem, const Options& options, std::string& why_not,
                                               SetupCache* setups = nullptr);

  std::shared_ptr<const ReducedKernel> MakeKernel(double step, Hold hold, Index longest_window, Workers& workers,
                                                  const std::stop_token& stop) override;
  FreeMotion Move(const Vector& x, const RunSources& sources, Hold hold, Workers& workers,
                  const std::stop_token& stop) override;
  // Cost: a pass over all nodes, with a solve for each output or each column, whichever are fewer.
  Matrix States(const Vector& x, const RunSources& sources, const Matrix& y, Hold hold, const std::vector<Index>& nodes,
                Workers& workers, const std::stop_token& stop) override;
  // Factors and values at the nodes of the contours for all lengths of steps, to a factor of two.
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
    Matrix columns;  // m × r; empty if they are the columns of the lift, whose values are kept
    Matrix signal;
  };

  // `needed_bytes` are always in use, for `at_once` factorizations at the same time, of as many as `threads` allow;
  // kept factors use at most `kept_bytes`.
  ContourSystem(const Problem& problem, const Sector& sector, double needed_bytes, double kept_bytes, int at_once,
                int threads, SetupCache* setups);

  StepContours MakeContours(double step, Index steps) const;
  // Null where `stop` was requested.
  const StepValues* At(double step, Index steps, Workers& workers, const std::stop_token& stop);
  // N (zE - A)⁻¹ columns at all nodes, weighted, for each of `groups`; the result for one group does not depend on the
  // others. Empty where `stop` was requested.
  std::vector<TransferValues> Visit(double step, const StepContours& contours, const std::vector<Matrix>& groups,
                                    Workers& workers, const std::stop_token& stop);
  // E x, as a column.
  Matrix Weighted(const Vector& x) const { return E_.rows() > 0 ? Matrix(E_ * x) : Matrix(x); }
  Sources Split(const RunSources& sources) const;
  static TransferValues Part(const TransferValues& values, Index first, Index count);

  SparseMatrix N_, B_;
  StructuredMatrix E_;  // 0 × 0 for the identity
  StructuredMatrix lift_;
  bool keeps_lift_ = false;
  Vector x0_;
  double horizon_;
  Sector sector_;
  double needed_bytes_, kept_bytes_;
  SparseResolvent resolvent_;
  SetupKey matrices_;
  SharedSetups setups_;
  const std::unique_ptr<Workers> few_workers_;  // where memory holds the factors of fewer nodes than there are threads
  const int at_once_;
  Team& team_;
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
