// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/distributed_operator.h"

#include <utility>
#include <vector>

namespace dlcs {

DistributedOperator::DistributedOperator(RowMajorMatrix rows, Ownership ownership, MpiTeam& team)
    : own_(std::move(rows)), ownership_(std::move(ownership)), team_(team) {
  nonzeros_ = static_cast<Index>(team_.Sum(static_cast<double>(own_.nonZeros())));
}

void DistributedOperator::Multiply(const Eigen::Ref<const Matrix>& right, Eigen::Ref<Matrix> left) const {
  left = Collect(own_ * right, ownership_, team_);
}

Vector DistributedOperator::AbsTimes(const Eigen::Ref<const Vector>& v) const {
  return Collect(own_.cwiseAbs() * v, ownership_, team_);
}

SparseMatrix DistributedOperator::Entries() const {
  // Rows, columns and values as numbers, rank by rank.
  const std::vector<Index> numbers = ownership_.rows(team_.rank());
  Matrix own(own_.nonZeros(), 3);
  Index k = 0;
  for (Index i = 0; i < own_.rows(); ++i) {
    for (RowMajorMatrix::InnerIterator entry(own_, i); entry; ++entry) {
      own.row(k++) << static_cast<double>(numbers[static_cast<std::size_t>(i)]), static_cast<double>(entry.col()),
          entry.value();
    }
  }
  std::vector<Index> counts;
  for (const double count : team_.Gather(static_cast<double>(own_.nonZeros()))) {
    counts.push_back(static_cast<Index>(count));
  }
  const Matrix all = Collect(own, Ownership::BlocksOf(counts), team_);
  std::vector<Eigen::Triplet<double>> triplets;
  triplets.reserve(static_cast<std::size_t>(all.rows()));
  for (Index i = 0; i < all.rows(); ++i) {
    triplets.emplace_back(static_cast<int>(all(i, 0)), static_cast<int>(all(i, 1)), all(i, 2));
  }
  SparseMatrix whole(rows(), cols());
  whole.setFromTriplets(triplets.begin(), triplets.end());
  return whole;
}

Matrix Collect(const Matrix& part, const Ownership& rows, MpiTeam& team) {
  Matrix whole(rows.size(), part.cols());
  Matrix of_rank;
  for (int rank = 0; rank < team.size(); ++rank) {
    if (rank == team.rank()) {
      of_rank = part;
    } else {
      of_rank.resize(rows.count(rank), part.cols());
    }
    team.Share(rank, of_rank.data(), of_rank.size());
    whole(rows.rows(rank), Eigen::all) = of_rank;
  }
  return whole;
}

}  // namespace dlcs
