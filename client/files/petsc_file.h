// SPDX-License-Identifier: Apache-2.0
// Matrices and vectors as PETSc stores them: https://petsc.org/release/manualpages/Mat/MatLoad

#ifndef DLCS_CLIENT_FILES_PETSC_FILE_H_
#define DLCS_CLIENT_FILES_PETSC_FILE_H_

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "absl/status/statusor.h"
#include "client/files/stored_array.h"

namespace dlcs::client {

// Whether `bytes` begin as a matrix or a vector of PETSc does, with indices of 32 or of 64 bits.
bool IsPetscFile(std::string_view bytes);

// The header of a file with a sparse matrix. The lengths of its rows follow, then all columns, then all values, row by
// row; all in the order of bytes of networks, which is that of kPetscValues.
struct PetscMatrixHead {
  static constexpr std::uint64_t kBytes = 16, kIndexBytes = 4, kValueBytes = 8;
  std::uint64_t rows = 0, columns = 0, entries = 0;

  std::uint64_t lengths_at() const { return kBytes; }
  std::uint64_t columns_at() const { return lengths_at() + kIndexBytes * rows; }
  std::uint64_t values_at() const { return columns_at() + kIndexBytes * entries; }
  std::uint64_t file_bytes() const { return values_at() + kValueBytes * entries; }
};
// `bytes` begin as the file does. Errors: those of ParsePetsc(), and InvalidArgument for a vector.
absl::StatusOr<PetscMatrixHead> ParsePetscHead(std::string_view bytes);
std::uint32_t PetscIndex(std::string_view bytes, std::size_t k);
inline constexpr NumberFormat kPetscValues{.kind = NumberFormat::Kind::kFloat, .bytes = 8, .big_endian = true};

// The sparse matrix or the vector in `bytes`, the whole content of such a file: MatView() or VecView() of one object
// with a binary viewer, of real numbers in double precision and indices of 32 bits, which are the defaults of PETSc.
// Errors, which follow the name of the file: InvalidArgument if it is another one, is damaged or holds more, or a value
// is not finite; ResourceExhausted.
absl::StatusOr<StoredArray> ParsePetsc(std::string_view bytes, ReadingBudget& budget);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_PETSC_FILE_H_
