// SPDX-License-Identifier: Apache-2.0
// (zI - A)⁻¹ for many z and one large sparse A.

#ifndef DLCS_CORE_PROPAGATOR_SPARSE_RESOLVENT_H_
#define DLCS_CORE_PROPAGATOR_SPARSE_RESOLVENT_H_

#include <complex>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "core/linalg/sparse_factor.h"

namespace dlcs {

// One factorization for each z, kept for the next visit while they fill no more than `kept_bytes`.
// Threads: all functions may be called at once; the numbers do not depend on what was kept.
class SparseResolvent {
 public:
  using Complex = std::complex<double>;
  using Factor = SparseFactor<Complex>;

  SparseResolvent(SparseMatrix A, double kept_bytes)
      : A_(std::move(A)), order_(SparseOrder(A_)), free_bytes_(kept_bytes) {}

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
    auto factor = std::make_shared<const Factor>(A_, order_, z, 1.0);
    const std::scoped_lock lock(mutex_);
    ++factorizations_;
    if (factor->bytes() <= free_bytes_ && kept_.emplace(std::pair(z.real(), z.imag()), factor).second) {
      free_bytes_ -= factor->bytes();
    }
    return factor;
  }

 private:
  const SparseMatrix A_;
  const Factor::Order order_;
  mutable std::mutex mutex_;
  std::map<std::pair<double, double>, std::shared_ptr<const Factor>> kept_;
  double free_bytes_;
  Index factorizations_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_SPARSE_RESOLVENT_H_
