// SPDX-License-Identifier: Apache-2.0
// One array of NumPy: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html

#ifndef DLCS_CLIENT_FILES_NPY_ARRAY_H_
#define DLCS_CLIENT_FILES_NPY_ARRAY_H_

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "client/files/stored_array.h"

namespace dlcs::client {

// The first bytes of every .npy file.
inline constexpr std::string_view kNpyMagic = "\x93NUMPY";

// The array in `bytes`, the whole content of an .npy file: booleans, integers or floats (up to 64 bits) in either byte
// order, stored by rows or by columns, of at most two dimensions. Errors, which follow the name of the array: those of
// DenseFromBytes(); InvalidArgument if it is no .npy file, or if its elements are others, such as complex numbers, text
// and Python objects.
absl::StatusOr<StoredArray> ParseNpy(std::string_view bytes, ReadingBudget& budget);

// The header of a file. The elements follow it in the byte order of this machine, row by row. `type` is that of NumPy
// without the byte order: "f8".
std::string NpyHeader(std::string_view type, std::span<const std::size_t> shape);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_NPY_ARRAY_H_
