// SPDX-License-Identifier: Apache-2.0
#include "client/files/petsc_file.h"

#include <fmt/format.h>

#include <cstdint>
#include <string>

namespace dlcs::client {
namespace {

// MAT_FILE_CLASSID and VEC_FILE_CLASSID.
constexpr std::uint32_t kPetscMatrix = 1211216, kPetscVector = 1211214;
constexpr std::size_t kWordBytes = 4;

// An error; thrown and caught in this file only.
struct PetscFault {
  absl::Status status;
};

PetscFault PetscRefusal(const std::string& what) { return {absl::InvalidArgumentError(what)}; }

bool BeginsWith(std::string_view bytes, std::size_t at) {
  if (bytes.size() < kWordBytes * (at + 1)) return false;
  const std::uint32_t word = PetscIndex(bytes, at);
  return word == kPetscMatrix || word == kPetscVector;
}

// Whether a matrix follows, and no vector, whose class it takes from `bytes`.
bool BeginsWithMatrix(std::string_view& bytes) {
  if (!BeginsWith(bytes, 0)) {
    throw PetscRefusal(BeginsWith(bytes, 1) ? "has indices of 64 bits; must be of a PETSc with indices of 32 bits"
                                            : "is not a PETSc matrix or vector");
  }
  const bool is_matrix = PetscIndex(bytes, 0) == kPetscMatrix;
  bytes.remove_prefix(kWordBytes);
  return is_matrix;
}

// `count` of what follows, of `size` bytes each.
std::string_view TakeFrom(std::string_view& bytes, std::uint64_t count, std::size_t size, const char* what) {
  if (count > bytes.size() / size) throw PetscRefusal(fmt::format("ends before its {} {}", count, what));
  const std::string_view taken = bytes.substr(0, count * size);
  bytes.remove_prefix(taken.size());
  return taken;
}

void ExpectEnd(std::string_view bytes) {
  if (!bytes.empty()) {
    throw PetscRefusal(
        fmt::format("has {} bytes more than one matrix or vector of real numbers in double precision", bytes.size()));
  }
}

double ValueAt(std::string_view values, std::size_t k, const std::string& where) {
  const absl::StatusOr<double> value = NumberFromBytes(values, kPetscValues, k);
  if (!value.ok()) throw PetscRefusal(fmt::format("holds in {} {}", where, std::string(value.status().message())));
  return *value;
}

void TakeBudget(ReadingBudget& budget, std::uint64_t bytes) {
  if (absl::Status taken = budget.Take(bytes); !taken.ok()) throw PetscFault{std::move(taken)};
}

PetscMatrixHead ReadPetscHead(std::string_view& bytes) {
  constexpr std::uint32_t kMost = INT32_MAX;
  const std::string_view head = TakeFrom(bytes, 3, kWordBytes, "numbers of rows, columns and entries");
  const std::uint32_t rows = PetscIndex(head, 0), columns = PetscIndex(head, 1), entries = PetscIndex(head, 2);
  if (rows < 1 || rows > kMost || columns < 1 || columns > kMost) {
    throw PetscRefusal(fmt::format("is of {} x {}; must have from 1 to {} rows and columns", rows, columns, kMost));
  }
  if (entries > kMost) throw PetscRefusal("is a dense matrix; must be a sparse one (MATAIJ)");
  return {.rows = rows, .columns = columns, .entries = entries};
}

StoredArray ReadPetscMatrix(std::string_view bytes, ReadingBudget& budget) {
  const PetscMatrixHead head = ReadPetscHead(bytes);
  const auto [rows, columns, entries] = head;
  const std::string_view lengths = TakeFrom(bytes, rows, kWordBytes, "lengths of rows");
  const std::string_view of_columns = TakeFrom(bytes, entries, kWordBytes, "columns of entries");
  const std::string_view values = TakeFrom(bytes, entries, kPetscValues.bytes, "values");
  ExpectEnd(bytes);
  TakeBudget(budget, entries * (2 * sizeof(std::int32_t) + sizeof(double)));
  StoredArray array;
  v1::SparseMatrix& matrix = *array.matrix.mutable_sparse();
  matrix.set_rows(static_cast<std::int32_t>(rows));
  matrix.set_columns(static_cast<std::int32_t>(columns));
  std::uint64_t k = 0;
  for (std::uint64_t row = 0; row < rows; ++row) {
    const std::uint64_t end = k + PetscIndex(lengths, row);
    if (end > entries) break;
    for (; k < end; ++k) {
      const std::uint32_t column = PetscIndex(of_columns, k);
      if (column >= columns) {
        throw PetscRefusal(
            fmt::format("has an entry in row {}, column {} (from 0), and {} columns", row, column, columns));
      }
      matrix.add_row_indices(static_cast<std::int32_t>(row));
      matrix.add_column_indices(static_cast<std::int32_t>(column));
      matrix.add_values(ValueAt(values, k, fmt::format("row {}, column {} (from 0)", row, column)));
    }
    if (row + 1 == rows && k == entries) return array;
  }
  throw PetscRefusal(fmt::format("is damaged: the lengths of its rows do not add up to {} entries", entries));
}

StoredArray ReadPetscVector(std::string_view bytes, ReadingBudget& budget) {
  const std::uint32_t size = PetscIndex(TakeFrom(bytes, 1, kWordBytes, "number of values"), 0);
  const std::string_view values = TakeFrom(bytes, size, kPetscValues.bytes, "values");
  ExpectEnd(bytes);
  auto dense = DenseFromBytes(values, kPetscValues, size, 1, /*by_columns=*/false, budget);
  if (!dense.ok()) throw PetscFault{dense.status()};
  StoredArray array;
  array.dimensions = 1;
  *array.matrix.mutable_dense() = *std::move(dense);
  return array;
}

}  // namespace

bool IsPetscFile(std::string_view bytes) { return BeginsWith(bytes, 0) || BeginsWith(bytes, 1); }

std::uint32_t PetscIndex(std::string_view bytes, std::size_t k) {
  std::uint32_t word = 0;
  for (std::size_t b = 0; b < kWordBytes; ++b) {
    word = word << 8 | static_cast<unsigned char>(bytes[kWordBytes * k + b]);
  }
  return word;
}

absl::StatusOr<PetscMatrixHead> ParsePetscHead(std::string_view bytes) {
  try {
    if (!BeginsWithMatrix(bytes)) throw PetscRefusal("is a vector; must be a matrix");
    return ReadPetscHead(bytes);
  } catch (const PetscFault& fault) {
    return fault.status;
  }
}

absl::StatusOr<StoredArray> ParsePetsc(std::string_view bytes, ReadingBudget& budget) {
  try {
    const bool is_matrix = BeginsWithMatrix(bytes);
    return is_matrix ? ReadPetscMatrix(bytes, budget) : ReadPetscVector(bytes, budget);
  } catch (const PetscFault& fault) {
    return fault.status;
  }
}

}  // namespace dlcs::client
