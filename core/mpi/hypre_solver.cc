// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/hypre_solver.h"

#include <HYPRE.h>
#include <HYPRE_IJ_mv.h>
#include <HYPRE_parcsr_ls.h>

#include <utility>

namespace dlcs {
namespace {

// The rows of the system with fixed unknowns, as hypre wants them.
struct Rows {
  std::vector<HYPRE_Int> lengths;
  std::vector<HYPRE_BigInt> numbers, columns;
  std::vector<double> values;
};

}  // namespace

void StartHypre() { HYPRE_Init(); }
void EndHypre() { HYPRE_Finalize(); }

// BoomerAMG for one set of fixed unknowns, with its vectors.
struct HypreSolver::Cycle {
  Cycle(MPI_Comm communicator, const Rows& rows, bool is_symmetric) : numbers(rows.numbers) {
    const HYPRE_BigInt first = numbers.front(), last = numbers.back();
    HYPRE_IJMatrixCreate(communicator, first, last, first, last, &matrix);
    HYPRE_IJMatrixSetObjectType(matrix, HYPRE_PARCSR);
    HYPRE_IJMatrixInitialize(matrix);
    std::vector<HYPRE_Int> lengths = rows.lengths;
    HYPRE_IJMatrixSetValues(matrix, static_cast<HYPRE_Int>(numbers.size()), lengths.data(), numbers.data(),
                            rows.columns.data(), rows.values.data());
    HYPRE_IJMatrixAssemble(matrix);
    void* object = nullptr;
    HYPRE_IJMatrixGetObject(matrix, &object);
    K = static_cast<HYPRE_ParCSRMatrix>(object);
    for (auto [vector, contents] : {std::pair(&right, &right_contents), std::pair(&left, &left_contents)}) {
      HYPRE_IJVectorCreate(communicator, first, last, vector);
      HYPRE_IJVectorSetObjectType(*vector, HYPRE_PARCSR);
      HYPRE_IJVectorInitialize(*vector);
      HYPRE_IJVectorAssemble(*vector);
      HYPRE_IJVectorGetObject(*vector, &object);
      *contents = static_cast<HYPRE_ParVector>(object);
    }
    HYPRE_BoomerAMGCreate(&multigrid);
    HYPRE_BoomerAMGSetPrintLevel(multigrid, 0);
    HYPRE_BoomerAMGSetTol(multigrid, 0);
    HYPRE_BoomerAMGSetMaxIter(multigrid, 1);
    if (is_symmetric) {
      constexpr HYPRE_Int kChebyshev = 16, kDown = 1, kUp = 2, kPmis = 8;
      HYPRE_BoomerAMGSetCycleRelaxType(multigrid, kChebyshev, kDown);
      HYPRE_BoomerAMGSetCycleRelaxType(multigrid, kChebyshev, kUp);
      HYPRE_BoomerAMGSetCoarsenType(multigrid, kPmis);
    }
    HYPRE_BoomerAMGSetup(multigrid, K, right_contents, left_contents);
    HYPRE_ClearAllErrors();
  }
  ~Cycle() {
    HYPRE_BoomerAMGDestroy(multigrid);
    HYPRE_IJVectorDestroy(left);
    HYPRE_IJVectorDestroy(right);
    HYPRE_IJMatrixDestroy(matrix);
  }
  Cycle(const Cycle&) = delete;
  Cycle& operator=(const Cycle&) = delete;

  void Apply(const Vector& r, Vector& z) {
    const auto count = static_cast<HYPRE_Int>(numbers.size());
    z.setZero();
    HYPRE_IJVectorSetValues(right, count, numbers.data(), r.data());
    HYPRE_IJVectorSetValues(left, count, numbers.data(), z.data());
    HYPRE_BoomerAMGSolve(multigrid, K, right_contents, left_contents);
    HYPRE_IJVectorGetValues(left, count, numbers.data(), z.data());
    HYPRE_ClearAllErrors();
  }

  std::vector<HYPRE_BigInt> numbers;
  HYPRE_IJMatrix matrix = nullptr;
  HYPRE_ParCSRMatrix K = nullptr;
  HYPRE_IJVector right = nullptr, left = nullptr;
  HYPRE_ParVector right_contents = nullptr, left_contents = nullptr;
  HYPRE_Solver multigrid = nullptr;
};

HypreSolver::HypreSolver(const DistributedRows& K, const Ownership& unknowns, bool is_symmetric, Workers& workers,
                         MpiTeam& team)
    : KrylovSolver(Compressed(K.own), is_symmetric, workers, team), mpi_(team), halo_(K.halo) {
  outside_ = Compressed(K.outside);
  first_number_ = unknowns.first(team.rank());
  for (const Index unknown : halo_.unknowns()) outside_numbers_.push_back(unknowns.number(unknown));
  TryDiagonal();
}

HypreSolver::~HypreSolver() = default;

void HypreSolver::Expand(const Vector& x) {
  halo_.Exchange(x, expanded_);
  outside_values_ = expanded_.col(0);
}

void HypreSolver::Precondition(const Vector& r, double /*size*/, Vector& z) {
  cycle_->Apply(r, z);
  for (std::size_t i = 0; i < fixed_in_cycle_.size(); ++i) {
    if (fixed_in_cycle_[i]) z[static_cast<Index>(i)] = 0;
  }
}

void HypreSolver::PrepareFixed(const std::vector<std::uint8_t>& is_fixed) {
  if (!mpi_.Any(!cycle_ || is_fixed != fixed_in_cycle_)) return;
  fixed_in_cycle_ = is_fixed;
  const Index size = K_.rows();
  Vector own(size);
  for (Index i = 0; i < size; ++i) own[i] = is_fixed[static_cast<std::size_t>(i)];
  Matrix outside;
  halo_.Exchange(own, outside);

  Rows rows;
  for (Index i = 0; i < size; ++i) {
    const std::size_t before = rows.columns.size();
    const auto add = [&](Index number, double value) {
      rows.columns.push_back(static_cast<HYPRE_BigInt>(number));
      rows.values.push_back(value);
    };
    for (int k = K_.start[i]; k < K_.start[i + 1]; ++k) {
      const int j = K_.column[k];
      if (j == i || (own[i] == 0 && own[j] == 0)) add(first_number_ + j, K_.value[k]);
    }
    for (int k = outside_.start[i]; k < outside_.start[i + 1]; ++k) {
      const int j = outside_.column[k];
      if (own[i] == 0 && outside(j, 0) == 0) add(outside_numbers_[static_cast<std::size_t>(j)], outside_.value[k]);
    }
    rows.numbers.push_back(static_cast<HYPRE_BigInt>(first_number_ + i));
    rows.lengths.push_back(static_cast<HYPRE_Int>(rows.columns.size() - before));
  }
  cycle_.reset();
  cycle_ = std::make_unique<Cycle>(mpi_.communicator(), rows, is_symmetric());
}

}  // namespace dlcs
