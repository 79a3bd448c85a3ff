// SPDX-License-Identifier: Apache-2.0
// MAT files of level 5, the format of MATLAB's save -v6 and -v7, Octave's save -v7 and SciPy's savemat:
// https://www.mathworks.com/help/pdf_doc/matlab/matfile_format.pdf
//
// Files of save -v7.3 are HDF5 files with rules of their own, and are refused.

#ifndef DLCS_CLIENT_FILES_MAT_FILE_H_
#define DLCS_CLIENT_FILES_MAT_FILE_H_

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "absl/status/statusor.h"
#include "client/files/stored_array.h"

namespace dlcs::client {

// The numbers of the format that both reading and writing need.
namespace mat {

inline constexpr std::size_t kHeaderBytes = 128;
inline constexpr std::size_t kTextBytes = 116;  // of the header: free text
inline constexpr std::uint16_t kVersion = 0x0100;
inline constexpr std::uint16_t kByteOrder = 'M' << 8 | 'I';  // "IM" in a file of a little-endian machine

// How the bytes of an element are to be read.
enum Type : std::uint32_t {
  kInt8 = 1,
  kUint8 = 2,
  kInt16 = 3,
  kUint16 = 4,
  kInt32 = 5,
  kUint32 = 6,
  kSingle = 7,
  kDouble = 9,
  kInt64 = 12,
  kUint64 = 13,
  kMatrix = 14,
  kCompressed = 15
};

// What an array is to MATLAB.
enum Class : std::uint32_t {
  kCellClass = 1,
  kStructClass = 2,
  kObjectClass = 3,
  kCharClass = 4,
  kSparseClass = 5,
  kDoubleClass = 6,
  kUint64Class = 15,
  kFunctionClass = 16,
  kOpaqueClass = 17
};

inline constexpr std::uint32_t kComplexFlag = 0x0800;  // in the word that holds the class

}  // namespace mat

// Whether `bytes` begin as a MAT file of level 5 or 7.3 does.
bool IsMatFile(std::string_view bytes);

// The variables in `bytes`, the whole content of a MAT file of level 5 in either byte order. Arrays of numbers and
// booleans of every class are read, dense and sparse. Errors, which follow the name of the file: InvalidArgument if it
// is a file of save -v7.3, or if its structure is damaged. Those of a variable: DenseFromBytes(), and InvalidArgument
// if it is no real array of two dimensions, or if it is damaged.
absl::StatusOr<StoredVariables> ParseMat(std::string_view bytes, const Wanted& wanted, ReadingBudget& budget);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_MAT_FILE_H_
