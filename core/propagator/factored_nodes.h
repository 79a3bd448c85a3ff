// SPDX-License-Identifier: Apache-2.0
// Solves at the nodes of contours by one sparse factorization for each.

#ifndef DLCS_CORE_PROPAGATOR_FACTORED_NODES_H_
#define DLCS_CORE_PROPAGATOR_FACTORED_NODES_H_

#include <complex>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "core/linalg/sparse/sparse_factor.h"
#include "core/parallel/team.h"
#include "core/propagator/node_solver.h"

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

// In a team each process visits its part of the nodes, and n × n blocks travel; of States() sums of states do.
// Factors are kept for later calls as far as Options::max_memory allows.
class FactoredNodes final : public NodeSolver {
 public:
  // Null if the spectrum has no contour over [0, T], or if the factors of one node do not fit into memory; `why_not`
  // says which. Options::max_memory decides how many nodes are factored at the same time.
  static std::unique_ptr<FactoredNodes> Create(const Problem& problem, const Options& options, std::string& why_not);

  const Sector& sector() const override { return sector_; }
  SparseMatrix OwnRows(const StructuredMatrix& matrix) const override { return matrix.Sparse(); }
  Matrix OwnRows(Matrix columns) const override { return columns; }
  Vector Observe(const Vector& x) const override { return N_ * x; }
  std::vector<TransferValues> Values(double step, const StepContours& contours, const std::vector<Matrix>& groups,
                                     Workers& workers, const std::stop_token& stop) override;
  Matrix States(double step, const StepContours& contours, const Matrix& columns, Index outputs,
                const Excitation& excite, Workers& workers, const std::stop_token& stop) override;
  double PredictBytes(double nodes) const override;
  void Report(PropagatorRecord& record) const override;

 private:
  // `needed_bytes` are always in use, for `at_once` factorizations at the same time, of as many as `threads` allow;
  // kept factors use at most `kept_bytes`.
  FactoredNodes(const Problem& problem, const Sector& sector, double needed_bytes, double kept_bytes, int at_once,
                int threads);

  const SparseMatrix N_;
  const Sector sector_;
  const double needed_bytes_, kept_bytes_;
  SparseResolvent resolvent_;
  const std::unique_ptr<Workers> few_workers_;  // where memory holds the factors of fewer nodes than there are threads
  const int at_once_;
  Team& team_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_FACTORED_NODES_H_
