// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/row_exchange.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/mpi/distributed_operator.h"

namespace dlcs {
namespace {

// A matrix that is filled in two passes: the first one counts the entries of each row.
class RowFiller {
 public:
  explicit RowFiller(Index rows, Index columns) : matrix_(rows, columns), next_(static_cast<std::size_t>(rows) + 1) {}

  void Count(Index row) { ++next_[static_cast<std::size_t>(row) + 1]; }
  void Allocate() {
    std::partial_sum(next_.begin(), next_.end(), next_.begin());
    CheckEntries(next_.back());
    matrix_.resizeNonZeros(next_.back());
    std::transform(next_.begin(), next_.end(), matrix_.outerIndexPtr(), [](Index k) { return static_cast<int>(k); });
  }
  void Put(Index row, Index column, double value) {
    const Index k = next_[static_cast<std::size_t>(row)]++;
    matrix_.innerIndexPtr()[k] = static_cast<int>(column);
    matrix_.valuePtr()[k] = value;
  }
  RowMajorMatrix Take() {
    RowMajorMatrix taken;
    taken.swap(matrix_);
    return taken;
  }
  // The same for rows whose entries were put in any order.
  RowMajorMatrix TakeSorted() {
    std::vector<std::pair<int, double>> entries;
    for (Index i = 0; i < matrix_.rows(); ++i) {
      const int begin = matrix_.outerIndexPtr()[i], end = matrix_.outerIndexPtr()[i + 1];
      entries.clear();
      for (int k = begin; k < end; ++k) entries.emplace_back(matrix_.innerIndexPtr()[k], matrix_.valuePtr()[k]);
      std::stable_sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
      for (int k = begin; k < end; ++k) {
        std::tie(matrix_.innerIndexPtr()[k], matrix_.valuePtr()[k]) = entries[static_cast<std::size_t>(k - begin)];
      }
    }
    return Take();
  }

 private:
  RowMajorMatrix matrix_;
  std::vector<Index> next_;
};

RowMajorMatrix RowsOfSparse(const SparseMatrix& whole, const Ownership& rows, int rank) {
  RowFiller filler(rows.count(rank), whole.cols());
  const auto for_own = [&](const auto& act) {
    for (Index j = 0; j < whole.outerSize(); ++j) {
      for (SparseMatrix::InnerIterator entry(whole, j); entry; ++entry) {
        if (rows.owner(entry.row()) == rank) act(rows.local(entry.row()), j, entry.value());
      }
    }
  };
  for_own([&](Index row, Index, double) { filler.Count(row); });
  filler.Allocate();
  for_own([&](Index row, Index column, double value) { filler.Put(row, column, value); });
  return filler.Take();
}

// As KroneckerSum::Assemble() makes them: diagonals add up in the order of factors, other entries never meet.
RowMajorMatrix RowsOfSum(const KroneckerSum& sum, const Ownership& rows, int rank) {
  std::vector<RowMajorMatrix> factors(sum.factors.begin(), sum.factors.end());
  std::vector<Index> stride(factors.size(), 1);  // of the index of each
  for (std::size_t k = factors.size() - 1; k-- > 0;) stride[k] = stride[k + 1] * factors[k + 1].rows();
  const std::vector<Index> numbers = rows.rows(rank);
  std::vector<std::pair<Index, double>> entries;
  const auto for_row = [&](Index row, const auto& act) {
    entries.clear();
    double diagonal = 0;
    bool has_diagonal = false;
    for (std::size_t k = 0; k < factors.size(); ++k) {
      const Index index = row / stride[k] % factors[k].rows();
      for (RowMajorMatrix::InnerIterator entry(factors[k], index); entry; ++entry) {
        if (entry.col() != index) {
          entries.emplace_back(row + (entry.col() - index) * stride[k], entry.value());
        } else {
          diagonal = has_diagonal ? diagonal + entry.value() : entry.value();
          has_diagonal = true;
        }
      }
    }
    if (has_diagonal) entries.emplace_back(row, diagonal);
    std::sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    act();
  };
  RowFiller filler(rows.count(rank), sum.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    for_row(numbers[i], [&] {
      for (std::size_t k = 0; k < entries.size(); ++k) filler.Count(static_cast<Index>(i));
    });
  }
  filler.Allocate();
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    for_row(numbers[i], [&] {
      for (const auto& [column, value] : entries) filler.Put(static_cast<Index>(i), column, value);
    });
  }
  return filler.Take();
}

// Sends each row of `matrix` as `put` says, with all ranks.
template <typename Put>
RowMajorMatrix Sent(const RowMajorMatrix& matrix, const Ownership& rows, Index columns, MpiTeam& team, const Put& put) {
  RowExchange exchange(rows, columns, team);
  Index row = 0;
  do {
    for (; row < matrix.rows() && !exchange.IsFull(); ++row) {
      for (RowMajorMatrix::InnerIterator entry(matrix, row); entry; ++entry) put(exchange, entry);
    }
    exchange.Send();
  } while (team.Any(row < matrix.rows()));
  return exchange.Finish();
}

}  // namespace

RowExchange::RowExchange(const Ownership& rows, Index columns, MpiTeam& team)
    : rows_(rows), columns_(columns), team_(team) {}

void RowExchange::Add(Index row, Index column, double value) {
  to_send_.push_back({static_cast<std::int32_t>(row), static_cast<std::int32_t>(column), value});
}

void RowExchange::Send() {
  const auto ranks = static_cast<std::size_t>(team_.size());
  const auto by_owner = [this](const Entry& a, const Entry& b) { return rows_.owner(a.row) < rows_.owner(b.row); };
  std::stable_sort(to_send_.begin(), to_send_.end(), by_owner);
  std::vector<int> sent(ranks, 0), received(ranks), sent_at(ranks, 0), received_at(ranks, 0);
  for (const Entry& entry : to_send_) ++sent[static_cast<std::size_t>(rows_.owner(entry.row))];
  MPI_Alltoall(sent.data(), 1, MPI_INT, received.data(), 1, MPI_INT, team_.communicator());
  std::partial_sum(sent.begin(), sent.end() - 1, sent_at.begin() + 1);
  std::partial_sum(received.begin(), received.end() - 1, received_at.begin() + 1);
  std::vector<Entry> arrived(static_cast<std::size_t>(received_at.back() + received.back()));
  MPI_Datatype type = MPI_DATATYPE_NULL;  // counts of MPI are int, and so count entries
  MPI_Type_contiguous(sizeof(Entry), MPI_BYTE, &type);
  MPI_Type_commit(&type);
  MPI_Alltoallv(to_send_.data(), sent.data(), sent_at.data(), type, arrived.data(), received.data(), received_at.data(),
                type, team_.communicator());
  MPI_Type_free(&type);
  to_send_.clear();
  received_.push_back(std::move(arrived));
}

RowMajorMatrix RowExchange::Finish() {
  std::size_t count = 0;
  for (const std::vector<Entry>& arrived : received_) count += arrived.size();
  CheckEntries(static_cast<Index>(team_.Max(static_cast<double>(count))));
  RowFiller filler(rows_.count(team_.rank()), columns_);
  const auto for_all = [this](const auto& act) {
    for (const std::vector<Entry>& arrived : received_) std::for_each(arrived.begin(), arrived.end(), act);
  };
  for_all([&](const Entry& entry) { filler.Count(rows_.local(entry.row)); });
  filler.Allocate();
  for_all([&](const Entry& entry) { filler.Put(rows_.local(entry.row), entry.column, entry.value); });
  received_.clear();
  return filler.TakeSorted();
}

RowMajorMatrix RowsOf(const StructuredMatrix& matrix, const Ownership& rows, MpiTeam& team) {
  if (const auto* distributed = dynamic_cast<const DistributedOperator*>(matrix.linear_operator())) {
    if (distributed->ownership() == rows) return distributed->own();
    const std::vector<Index> numbers = distributed->ownership().rows(team.rank());
    return Sent(distributed->own(), rows, matrix.cols(), team, [&](RowExchange& exchange, const auto& entry) {
      exchange.Add(numbers[static_cast<std::size_t>(entry.row())], entry.col(), entry.value());
    });
  }
  if (matrix.kronecker_sum()) return RowsOfSum(*matrix.kronecker_sum(), rows, team.rank());
  if (matrix.sparse()) return RowsOfSparse(*matrix.sparse(), rows, team.rank());
  return RowsOfSparse(matrix.Sparse(), rows, team.rank());
}

RowMajorMatrix Transposed(const RowMajorMatrix& matrix, const std::vector<Index>& numbers, Index rows,
                          const Ownership& columns, MpiTeam& team) {
  return Sent(matrix, columns, rows, team, [&](RowExchange& exchange, const auto& entry) {
    exchange.Add(entry.col(), numbers[static_cast<std::size_t>(entry.row())], entry.value());
  });
}

}  // namespace dlcs
