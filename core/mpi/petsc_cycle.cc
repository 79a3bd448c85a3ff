// SPDX-License-Identifier: Apache-2.0
// A preconditioner of PETSc: its own algebraic multigrid, GAMG, or what the options of PETSc say (PETSC_OPTIONS,
// ~/.petscrc). Options start with "dlcs_symmetric_" where the matrix is symmetric, and with "dlcs_" otherwise:
// "-dlcs_symmetric_pc_type hypre". Conjugate gradients need a symmetric one there. By default a symmetric matrix is
// smoothed by Chebyshev polynomials and the diagonal, which do not see where a rank ends, others by Gauss-Seidel.

#include <petscksp.h>

#include <stdexcept>
#include <string>

#include "core/mpi/multigrid_cycle.h"

namespace dlcs {
namespace {

constexpr const char* kSymmetric = "dlcs_symmetric_";
constexpr const char* kOther = "dlcs_";

void Check(PetscErrorCode code) {
  if (code == 0) return;
  const char* text = nullptr;
  PetscErrorMessage(code, &text, nullptr);
  throw std::runtime_error(std::string("PETSc: ") + (text ? text : "error " + std::to_string(code)) +
                           ". Are the options in PETSC_OPTIONS right?");
}

void SetByDefault(const std::string& option, const char* value) {
  PetscBool is_set = PETSC_FALSE;
  Check(PetscOptionsHasName(nullptr, nullptr, option.c_str(), &is_set));
  if (!is_set) Check(PetscOptionsSetValue(nullptr, option.c_str(), value));
}

class PetscCycle final : public MultigridCycle {
 public:
  PetscCycle() = default;
  ~PetscCycle() override {
    PCDestroy(&preconditioner_);
    VecDestroy(&left_);
    VecDestroy(&right_);
    MatDestroy(&matrix_);
  }
  PetscCycle(const PetscCycle&) = delete;
  PetscCycle& operator=(const PetscCycle&) = delete;

  // Apart from the constructor, so that an error leaves nothing behind.
  void SetUp(MPI_Comm communicator, const NumberedRows& rows, bool is_symmetric) {
    const auto count = static_cast<PetscInt>(rows.numbers.size());
    std::vector<PetscInt> starts = {0};
    for (const int length : rows.lengths) starts.push_back(starts.back() + length);
    const std::vector<PetscInt> columns(rows.columns.begin(), rows.columns.end());
    Check(MatCreateMPIAIJWithArrays(communicator, count, count, PETSC_DETERMINE, PETSC_DETERMINE, starts.data(),
                                    columns.data(), rows.values.data(), &matrix_));
    if (is_symmetric) Check(MatSetOption(matrix_, MAT_SPD, PETSC_TRUE));
    Check(VecCreateMPIWithArray(communicator, 1, count, PETSC_DETERMINE, nullptr, &right_));
    Check(VecCreateMPIWithArray(communicator, 1, count, PETSC_DETERMINE, nullptr, &left_));
    Check(PCCreate(communicator, &preconditioner_));
    Check(PCSetOptionsPrefix(preconditioner_, is_symmetric ? kSymmetric : kOther));
    Check(PCSetType(preconditioner_, PCGAMG));
    Check(PCSetOperators(preconditioner_, matrix_, matrix_));
    Check(PCSetFromOptions(preconditioner_));
    Check(PCSetUp(preconditioner_));
  }

  void Apply(const Vector& r, Vector& z) override {
    Check(VecPlaceArray(right_, r.data()));
    Check(VecPlaceArray(left_, z.data()));
    Check(PCApply(preconditioner_, right_, left_));
    Check(VecResetArray(left_));
    Check(VecResetArray(right_));
  }

 private:
  Mat matrix_ = nullptr;
  Vec right_ = nullptr, left_ = nullptr;
  PC preconditioner_ = nullptr;
};

}  // namespace

std::unique_ptr<MultigridCycle> MultigridCycle::Make(MPI_Comm communicator, const NumberedRows& rows,
                                                     bool is_symmetric) {
  auto cycle = std::make_unique<PetscCycle>();
  cycle->SetUp(communicator, rows, is_symmetric);
  return cycle;
}

void MultigridCycle::StartLibrary() {
  // Signals are the program's.
  Check(PetscOptionsSetValue(nullptr, "-no_signal_handler", "true"));
  Check(PetscInitializeNoArguments());
  Check(PetscPushErrorHandler(PetscReturnErrorHandler, nullptr));
  const std::string symmetric = std::string("-") + kSymmetric, other = std::string("-") + kOther;
  SetByDefault(symmetric + "mg_levels_ksp_type", "chebyshev");
  SetByDefault(symmetric + "mg_levels_pc_type", "jacobi");
  SetByDefault(other + "mg_levels_ksp_type", "richardson");
  SetByDefault(other + "mg_levels_pc_type", "sor");
  SetByDefault(other + "pc_gamg_agg_nsmooths", "0");
}

void MultigridCycle::EndLibrary() { PetscFinalize(); }

}  // namespace dlcs
