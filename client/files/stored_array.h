// SPDX-License-Identifier: Apache-2.0
// Arrays of numbers in files of other programs: .npy, .npz and .mat.

#ifndef DLCS_CLIENT_FILES_STORED_ARRAY_H_
#define DLCS_CLIENT_FILES_STORED_ARRAY_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/files/json_text.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

struct StoredArray {
  int dimensions = 2;  // 2: a matrix; 1: a list, the column of `matrix`; 0: a number, `matrix` is 1 x 1
  v1::Matrix matrix;   // dense, or sparse where the file keeps it so; every value is finite
};

// Whether a variable of a file is wanted; others are not read.
using Wanted = std::function<bool(const std::string& name)>;

struct StoredVariables {
  std::vector<std::string> names;  // of all, in the order of the file
  // The wanted ones. The message of an error follows the name of the variable: "is text; must be an array of numbers".
  std::map<std::string, absl::StatusOr<StoredArray>> arrays;
};

// What may still be read from a file, in bytes, so that a small file cannot ask for much memory: by a shape that it
// declares, by what it unpacks to, or by naming the same bytes many times.
class ReadingBudget {
 public:
  explicit ReadingBudget(std::size_t bytes = kMaxFileBytes) : left_(bytes) {}

  std::size_t left() const { return left_; }
  // Errors: ResourceExhausted if fewer bytes are left.
  absl::Status Take(std::size_t bytes);

 private:
  std::size_t left_;
};

// How numbers are stored in a file.
struct NumberFormat {
  enum class Kind { kSigned, kUnsigned, kFloat };
  Kind kind = Kind::kFloat;
  std::size_t bytes = 8;  // of a number: 1, 2, 4 or 8; of a float at least 2
  bool big_endian = false;
};

// `rows` x `columns` numbers that follow each other in `bytes`, row by row or `by_columns`. Errors, which follow the
// name of the variable: InvalidArgument if the shape is empty or too large, `bytes` are not as many, a number is not
// finite, or no double is equal to it; ResourceExhausted.
absl::StatusOr<v1::DenseMatrix> DenseFromBytes(std::string_view bytes, const NumberFormat& format, std::uint64_t rows,
                                               std::uint64_t columns, bool by_columns, ReadingBudget& budget);

// The `k`-th number of `bytes`. Errors: InvalidArgument if it is not finite, or if no double is equal to it.
absl::StatusOr<double> NumberFromBytes(std::string_view bytes, const NumberFormat& format, std::size_t k);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_STORED_ARRAY_H_
