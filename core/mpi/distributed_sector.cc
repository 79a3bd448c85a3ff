// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/distributed_sector.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/linalg/bounded_sum.h"
#include "core/mpi/distributed_krylov.h"
#include "core/mpi/halo.h"
#include "core/mpi/row_exchange.h"

namespace dlcs {
namespace {

RowMajorMatrix IdentityRows(const Ownership& rows, int rank) {
  RowWriter writer(rows.count(rank), rows.size(), rows.count(rank));
  for (const Index row : rows.rows(rank)) {
    writer.Add(row, 1);
    writer.EndRow();
  }
  return writer.Finish();
}

class DistributedProof {
 public:
  DistributedProof(const RowMajorMatrix& A, const RowMajorMatrix& transposed, const RowMajorMatrix& E,
                   const Ownership& rows, Workers& workers, MpiTeam& team)
      : symmetric_((A + transposed) / 2),
        skew_((A - transposed) / 2),
        mass_(E.rows() > 0 ? E : IdentityRows(rows, team.rank())),
        rows_(rows),
        workers_(workers),
        team_(team),
        numbers_(rows.rows(team.rank())) {
    skew_.prune(0.0);
    is_symmetric_ = !team.Any(skew_.nonZeros() > 0);
    if (E.rows() > 0) {
      const RowMajorMatrix E_transposed = Transposed(E, numbers_, rows.size(), rows, team);
      const bool is_own_symmetric = RowMajorMatrix(E - E_transposed).norm() == 0;
      has_inner_product_ = !team.Any(!is_own_symmetric) && IsPositive(mass_);
    }
  }

  bool is_symmetric() const { return is_symmetric_; }
  // Whether E is proven to be symmetric positive definite.
  bool has_inner_product() const { return has_inner_product_; }

  bool Holds(double angle, double shift) {
    const RowMajorMatrix real = shift * mass_ - symmetric_;
    if (is_symmetric_) return IsPositive(real);
    // |h_ij| on the union of both patterns.
    const RowMajorMatrix imaginary = skew_ / std::tan(angle);
    RowMajorMatrix sizes = (real.cwiseProduct(real) + imaginary.cwiseProduct(imaginary)).cwiseSqrt();
    for (Index i = 0; i < sizes.rows(); ++i) {
      const Index diagonal = numbers_[static_cast<std::size_t>(i)];
      for (RowMajorMatrix::InnerIterator entry(sizes, i); entry; ++entry) {
        if (entry.col() == diagonal) entry.valueRef() = real.coeff(i, diagonal);  // with its sign; K has none there
      }
    }
    return IsPositive(std::move(sizes));
  }

 private:
  // Whether v exists for an H with these rows, or entries of these sizes off the diagonal.
  bool IsPositive(RowMajorMatrix C) {
    bool is_dominant = true, has_diagonal = true;
    for (Index i = 0; i < C.rows(); ++i) {
      double diagonal = 0, others = 0;
      for (RowMajorMatrix::InnerIterator entry(C, i); entry; ++entry) {
        if (entry.col() == numbers_[static_cast<std::size_t>(i)]) {
          diagonal = entry.value();
        } else {
          others += std::abs(entry.value());
          entry.valueRef() = -std::abs(entry.value());
        }
      }
      has_diagonal = has_diagonal && diagonal > 0;
      is_dominant = is_dominant && diagonal >= (1 - RoundingOf(32)) * others;
    }
    if (team_.Any(!has_diagonal)) return false;
    if (!team_.Any(!is_dominant)) return true;
    return HasPositiveSolution(C);
  }

  bool HasPositiveSolution(const RowMajorMatrix& C) {
    constexpr double kResidual = 0.5;  // C v is then at least as much
    constexpr Index kMostIterations = 200;
    const DistributedRows distributed(C, rows_, team_);
    DistributedKrylov solver(distributed, rows_, /*is_symmetric=*/true, workers_, team_);
    solver.Fix(std::vector<std::uint8_t>(static_cast<std::size_t>(C.rows()), 0));
    const Vector ones = Vector::Ones(C.rows());
    Vector v = Vector::Zero(C.rows());
    solver.Start(ones, v, {});
    solver.Reduce(kResidual, kMostIterations);
    solver.Refresh();
    return solver.residual() <= kResidual && !team_.Any(!(v.size() == 0 || v.minCoeff() > 0));
  }

  RowMajorMatrix symmetric_, skew_, mass_;
  const Ownership& rows_;
  Workers& workers_;
  MpiTeam& team_;
  const std::vector<Index> numbers_;
  bool is_symmetric_ = false, has_inner_product_ = true;
};

}  // namespace

std::optional<Sector> FindDistributedSector(const RowMajorMatrix& A, const RowMajorMatrix& transposed,
                                            const RowMajorMatrix& E, double horizon, const Ownership& rows,
                                            Workers& workers, MpiTeam& team) {
  DistributedProof proof(A, transposed, E, rows, workers, team);
  if (!proof.has_inner_product()) return std::nullopt;
  const auto holds = [&proof](double angle, double shift) { return proof.Holds(angle, shift); };
  return FindSector(holds, proof.is_symmetric(), horizon);
}

}  // namespace dlcs
