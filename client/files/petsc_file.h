// SPDX-License-Identifier: Apache-2.0
// Matrices and vectors as PETSc stores them: https://petsc.org/release/manualpages/Mat/MatLoad

#ifndef DLCS_CLIENT_FILES_PETSC_FILE_H_
#define DLCS_CLIENT_FILES_PETSC_FILE_H_

#include <string_view>

#include "absl/status/statusor.h"
#include "client/files/stored_array.h"

namespace dlcs::client {

// Whether `bytes` begin as a matrix or a vector of PETSc does, with indices of 32 or of 64 bits.
bool IsPetscFile(std::string_view bytes);

// The sparse matrix or the vector in `bytes`, the whole content of such a file: MatView() or VecView() of one object
// with a binary viewer, of real numbers in double precision and indices of 32 bits, which are the defaults of PETSc.
// Errors, which follow the name of the file: InvalidArgument if it is another one, is damaged or holds more, or a value
// is not finite; ResourceExhausted.
absl::StatusOr<StoredArray> ParsePetsc(std::string_view bytes, ReadingBudget& budget);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_PETSC_FILE_H_
