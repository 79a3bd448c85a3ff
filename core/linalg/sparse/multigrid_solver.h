// SPDX-License-Identifier: Apache-2.0
// Large sparse systems of equations by Krylov methods, with multigrid as the preconditioner where it pays.

#ifndef DLCS_CORE_LINALG_SPARSE_MULTIGRID_SOLVER_H_
#define DLCS_CORE_LINALG_SPARSE_MULTIGRID_SOLVER_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "core/linalg/sparse/krylov_solver.h"
#include "core/linalg/sparse/multigrid.h"
#include "core/linalg/structured_matrix.h"
#include "core/parallel/parallel.h"
#include "core/types.h"

namespace dlcs {

// Memory: that of the base, and of core/linalg/sparse/multigrid.h unless the diagonal dominates.
class MultigridSolver final : public KrylovSolver {
 public:
  // Cost: that of some twenty V-cycles.
  MultigridSolver(const SparseMatrix& K, Workers& workers);

  // Absent where the diagonal is the preconditioner.
  const std::optional<Multigrid>& multigrid() const { return multigrid_; }

 private:
  void Precondition(const Vector& r, double size, Vector& z) override { multigrid_->Apply(r, size, z); }
  void PrepareFixed(const std::vector<std::uint8_t>& is_fixed) override { multigrid_->Fix(is_fixed); }

  std::optional<Multigrid> multigrid_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_SPARSE_MULTIGRID_SOLVER_H_
