// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/halo.h"

#include <algorithm>
#include <utility>

namespace dlcs {
namespace {

std::vector<Index> OutsideColumns(const RowMajorMatrix& rows, const Ownership& columns, int rank) {
  std::vector<Index> outside;
  for (Index i = 0; i < rows.rows(); ++i) {
    for (RowMajorMatrix::InnerIterator entry(rows, i); entry; ++entry) {
      if (columns.owner(entry.col()) != rank) outside.push_back(entry.col());
    }
  }
  return outside;
}

}  // namespace

Halo::Halo(std::vector<Index> wanted, const Ownership& columns, MpiTeam& team) : team_(team) {
  std::sort(wanted.begin(), wanted.end(), [&](Index a, Index b) { return columns.number(a) < columns.number(b); });
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
  const auto found = std::lower_bound(unknowns_.begin(), unknowns_.end(), unknown,
                                      [&](Index a, Index b) { return columns.number(a) < columns.number(b); });
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

DistributedRows::DistributedRows(const RowMajorMatrix& rows, const Ownership& columns, MpiTeam& team)
    : halo(OutsideColumns(rows, columns, team.rank()), columns, team) {
  const int rank = team.rank();
  Index own_entries = 0;
  for (Index k = 0; k < rows.nonZeros(); ++k) own_entries += columns.owner(rows.innerIndexPtr()[k]) == rank;
  RowWriter to_own(rows.rows(), columns.count(rank), own_entries);
  RowWriter to_outside(rows.rows(), halo.size(), rows.nonZeros() - own_entries);
  for (Index i = 0; i < rows.rows(); ++i) {
    for (RowMajorMatrix::InnerIterator entry(rows, i); entry; ++entry) {
      if (columns.owner(entry.col()) == rank) {
        to_own.Add(columns.local(entry.col()), entry.value());
      } else {
        to_outside.Add(halo.PlaceOf(entry.col(), columns), entry.value());
      }
    }
    to_own.EndRow();
    to_outside.EndRow();
  }
  to_own.Finish().swap(own);
  to_outside.Finish().swap(outside);
}

RowMajorMatrix DistributedMatrix::Rows(const Ownership& columns, const std::vector<Index>& own_columns) const {
  RowWriter whole_rows(rows(), columns.size(), nonzeros());
  for (Index i = 0; i < rows(); ++i) {
    for (RowMajorMatrix::InnerIterator entry(rows_.own, i); entry; ++entry) {
      whole_rows.Add(own_columns[static_cast<std::size_t>(entry.col())], entry.value());
    }
    for (RowMajorMatrix::InnerIterator entry(rows_.outside, i); entry; ++entry) {
      whole_rows.Add(rows_.halo.unknowns()[static_cast<std::size_t>(entry.col())], entry.value());
    }
    whole_rows.EndRow();
  }
  return whole_rows.Finish();
}

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
