// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/halo.h"

#include <algorithm>
#include <tuple>

namespace dlcs {
namespace {

std::vector<Index> OutsideColumns(const RowMajorMatrix& whole, const Ownership& rows, const Ownership& columns,
                                  int rank) {
  std::vector<Index> outside;
  for (const Index row : rows.rows(rank)) {
    for (RowMajorMatrix::InnerIterator entry(whole, row); entry; ++entry) {
      if (columns.owner(entry.col()) != rank) outside.push_back(entry.col());
    }
  }
  return outside;
}

}  // namespace

Halo::Halo(std::vector<Index> wanted, const Ownership& columns, MpiTeam& team) : team_(team) {
  const auto place = [&](Index unknown) { return std::tuple(columns.owner(unknown), columns.local(unknown)); };
  std::sort(wanted.begin(), wanted.end(), [&](Index a, Index b) { return place(a) < place(b); });
  wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
  unknowns_ = std::move(wanted);

  const auto ranks = static_cast<std::size_t>(team.size());
  std::vector<int> received(ranks, 0), sent(ranks, 0);
  for (const Index unknown : unknowns_) ++received[static_cast<std::size_t>(columns.owner(unknown))];
  MPI_Alltoall(received.data(), 1, MPI_INT, sent.data(), 1, MPI_INT, team.communicator());
  std::vector<MPI_Request> requests;
  std::vector<std::vector<int>> asked(ranks);
  Index first = 0;
  for (std::size_t r = 0; r < ranks; ++r) {
    if (received[r] == 0 && sent[r] == 0) continue;
    Neighbor& neighbor = neighbors_.emplace_back();
    neighbor.rank = static_cast<int>(r);
    neighbor.first = first;
    neighbor.count = received[r];
    neighbor.sent.resize(static_cast<std::size_t>(sent[r]));
    for (Index k = first; k < first + neighbor.count; ++k) {
      asked[r].push_back(static_cast<int>(columns.local(unknowns_[static_cast<std::size_t>(k)])));
    }
    first += neighbor.count;
  }
  for (Neighbor& neighbor : neighbors_) {
    const std::vector<int>& to_neighbor = asked[static_cast<std::size_t>(neighbor.rank)];
    MPI_Irecv(neighbor.sent.data(), static_cast<int>(neighbor.sent.size()), MPI_INT, neighbor.rank, 0,
              team.communicator(), &requests.emplace_back());
    MPI_Isend(to_neighbor.data(), static_cast<int>(to_neighbor.size()), MPI_INT, neighbor.rank, 0, team.communicator(),
              &requests.emplace_back());
  }
  MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
}

Index Halo::PlaceOf(Index unknown, const Ownership& columns) const {
  const auto place = [&](Index i) { return std::tuple(columns.owner(i), columns.local(i)); };
  const auto found = std::lower_bound(unknowns_.begin(), unknowns_.end(), unknown,
                                      [&](Index a, Index b) { return place(a) < place(b); });
  return found - unknowns_.begin();
}

void Halo::Exchange(const Eigen::Ref<const Matrix>& own, Matrix& outside) const {
  const Index columns = own.cols();
  std::vector<Matrix> sent(neighbors_.size()), received(neighbors_.size());
  std::vector<MPI_Request> requests;
  requests.reserve(2 * neighbors_.size());
  for (std::size_t k = 0; k < neighbors_.size(); ++k) {
    const Neighbor& neighbor = neighbors_[k];
    received[k].resize(neighbor.count, columns);
    sent[k] = own(neighbor.sent, Eigen::all);
    MPI_Irecv(received[k].data(), static_cast<int>(received[k].size()), MPI_DOUBLE, neighbor.rank, 1,
              team_.communicator(), &requests.emplace_back());
    MPI_Isend(sent[k].data(), static_cast<int>(sent[k].size()), MPI_DOUBLE, neighbor.rank, 1, team_.communicator(),
              &requests.emplace_back());
  }
  outside.resize(size(), columns);
  MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
  for (std::size_t k = 0; k < neighbors_.size(); ++k) {
    outside.middleRows(neighbors_[k].first, neighbors_[k].count) = received[k];
  }
}

DistributedRows::DistributedRows(const RowMajorMatrix& whole, const Ownership& rows, const Ownership& columns,
                                 MpiTeam& team)
    : halo(OutsideColumns(whole, rows, columns, team.rank()), columns, team) {
  const int rank = team.rank();
  const std::vector<Index>& own_rows = rows.rows(rank);
  std::vector<Eigen::Triplet<double>> of_own, of_outside;
  for (std::size_t i = 0; i < own_rows.size(); ++i) {
    for (RowMajorMatrix::InnerIterator entry(whole, own_rows[i]); entry; ++entry) {
      const bool is_own = columns.owner(entry.col()) == rank;
      const Index column = is_own ? columns.local(entry.col()) : halo.PlaceOf(entry.col(), columns);
      (is_own ? of_own : of_outside).emplace_back(static_cast<int>(i), static_cast<int>(column), entry.value());
    }
  }
  own.resize(rows.count(rank), columns.count(rank));
  own.setFromTriplets(of_own.begin(), of_own.end());
  outside.resize(rows.count(rank), halo.size());
  outside.setFromTriplets(of_outside.begin(), of_outside.end());
}

DistributedMatrix::DistributedMatrix(const StructuredMatrix& whole, const Ownership& rows, const Ownership& columns,
                                     MpiTeam& team)
    : rows_(RowMajorMatrix(whole.Sparse()), rows, columns, team) {}

void DistributedMatrix::Multiply(const Eigen::Ref<const Matrix>& right, Eigen::Ref<Matrix> left) const {
  Matrix outside;
  rows_.halo.Exchange(right, outside);
  left.noalias() = rows_.own * right;
  left.noalias() += rows_.outside * outside;
}

Vector DistributedMatrix::AbsTimes(const Eigen::Ref<const Vector>& v) const {
  Matrix outside;
  rows_.halo.Exchange(v, outside);
  Vector sums = rows_.own.cwiseAbs() * v;
  sums += rows_.outside.cwiseAbs() * outside.col(0);
  return sums;
}

CompressedRows<double> Compressed(const RowMajorMatrix& matrix) {
  CompressedRows<double> rows{.cols = matrix.cols()};
  rows.start.assign(matrix.outerIndexPtr(), matrix.outerIndexPtr() + matrix.rows() + 1);
  rows.column.assign(matrix.innerIndexPtr(), matrix.innerIndexPtr() + matrix.nonZeros());
  rows.value.assign(matrix.valuePtr(), matrix.valuePtr() + matrix.nonZeros());
  return rows;
}

}  // namespace dlcs
