// SPDX-License-Identifier: Apache-2.0
// BoomerAMG of hypre. For a symmetric matrix it smooths by Chebyshev polynomials and coarsens by PMIS, neither of which
// sees where one rank ends and the next begins: the number of iterations then does not depend on the number of ranks.
// Otherwise parameters are hypre's defaults; l1 Gauss-Seidel and HMIS are among them.

#include <HYPRE.h>
#include <HYPRE_IJ_mv.h>
#include <HYPRE_parcsr_ls.h>

#include <utility>

#include "core/mpi/multigrid_cycle.h"

namespace dlcs {
namespace {

class HypreCycle final : public MultigridCycle {
 public:
  HypreCycle(MPI_Comm communicator, const NumberedRows& rows, bool is_symmetric)
      : numbers_(rows.numbers.begin(), rows.numbers.end()) {
    const HYPRE_BigInt first = numbers_.front(), last = numbers_.back();
    HYPRE_IJMatrixCreate(communicator, first, last, first, last, &matrix_);
    HYPRE_IJMatrixSetObjectType(matrix_, HYPRE_PARCSR);
    HYPRE_IJMatrixInitialize(matrix_);
    std::vector<HYPRE_Int> lengths(rows.lengths.begin(), rows.lengths.end());
    const std::vector<HYPRE_BigInt> columns(rows.columns.begin(), rows.columns.end());
    HYPRE_IJMatrixSetValues(matrix_, static_cast<HYPRE_Int>(numbers_.size()), lengths.data(), numbers_.data(),
                            columns.data(), rows.values.data());
    HYPRE_IJMatrixAssemble(matrix_);
    void* object = nullptr;
    HYPRE_IJMatrixGetObject(matrix_, &object);
    K_ = static_cast<HYPRE_ParCSRMatrix>(object);
    for (auto [vector, contents] : {std::pair(&right_, &right_contents_), std::pair(&left_, &left_contents_)}) {
      HYPRE_IJVectorCreate(communicator, first, last, vector);
      HYPRE_IJVectorSetObjectType(*vector, HYPRE_PARCSR);
      HYPRE_IJVectorInitialize(*vector);
      HYPRE_IJVectorAssemble(*vector);
      HYPRE_IJVectorGetObject(*vector, &object);
      *contents = static_cast<HYPRE_ParVector>(object);
    }
    HYPRE_BoomerAMGCreate(&multigrid_);
    HYPRE_BoomerAMGSetPrintLevel(multigrid_, 0);
    HYPRE_BoomerAMGSetTol(multigrid_, 0);
    HYPRE_BoomerAMGSetMaxIter(multigrid_, 1);
    if (is_symmetric) {
      constexpr HYPRE_Int kChebyshev = 16, kDown = 1, kUp = 2, kPmis = 8;
      HYPRE_BoomerAMGSetCycleRelaxType(multigrid_, kChebyshev, kDown);
      HYPRE_BoomerAMGSetCycleRelaxType(multigrid_, kChebyshev, kUp);
      HYPRE_BoomerAMGSetCoarsenType(multigrid_, kPmis);
    }
    HYPRE_BoomerAMGSetup(multigrid_, K_, right_contents_, left_contents_);
    HYPRE_ClearAllErrors();
  }
  ~HypreCycle() override {
    HYPRE_BoomerAMGDestroy(multigrid_);
    HYPRE_IJVectorDestroy(left_);
    HYPRE_IJVectorDestroy(right_);
    HYPRE_IJMatrixDestroy(matrix_);
  }
  HypreCycle(const HypreCycle&) = delete;
  HypreCycle& operator=(const HypreCycle&) = delete;

  void Apply(const Vector& r, Vector& z) override {
    const auto count = static_cast<HYPRE_Int>(numbers_.size());
    z.setZero();
    HYPRE_IJVectorSetValues(right_, count, numbers_.data(), r.data());
    HYPRE_IJVectorSetValues(left_, count, numbers_.data(), z.data());
    HYPRE_BoomerAMGSolve(multigrid_, K_, right_contents_, left_contents_);
    HYPRE_IJVectorGetValues(left_, count, numbers_.data(), z.data());
    HYPRE_ClearAllErrors();
  }

 private:
  std::vector<HYPRE_BigInt> numbers_;
  HYPRE_IJMatrix matrix_ = nullptr;
  HYPRE_ParCSRMatrix K_ = nullptr;
  HYPRE_IJVector right_ = nullptr, left_ = nullptr;
  HYPRE_ParVector right_contents_ = nullptr, left_contents_ = nullptr;
  HYPRE_Solver multigrid_ = nullptr;
};

}  // namespace

std::unique_ptr<MultigridCycle> MultigridCycle::Make(MPI_Comm communicator, const NumberedRows& rows,
                                                     bool is_symmetric) {
  return std::make_unique<HypreCycle>(communicator, rows, is_symmetric);
}

void MultigridCycle::StartLibrary() { HYPRE_Init(); }
void MultigridCycle::EndLibrary() { HYPRE_Finalize(); }

}  // namespace dlcs
