// SPDX-License-Identifier: Apache-2.0
// Writes the result of a solve as arrays that other programs load: .npy, .npz, .mat and HDF5. Every double keeps its
// bits, NaN and infinities too.
//
//     t                        K times
//     x, y, w                  a row for each time and a column for each component; no w from servers that send none
//     switching_times          the times of the summary
//     left_times               L times at which y or w jumps,
//     left_y, left_w           and a row for each with the limits from the left
//     state_names, pair_names  those of the columns
//     outputs, left_outputs,   likewise, if the problem has outputs
//     output_names
//     summary                  the v1::SolveResult without its trajectory, as JSON text

#ifndef DLCS_CLIENT_CLI_OUTPUT_RESULT_ARRAYS_H_
#define DLCS_CLIENT_CLI_OUTPUT_RESULT_ARRAYS_H_

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/result/solve_result.h"

namespace dlcs::client {

// A matrix row by row, or a list of one column. The values are those of the result or of ResultArrays.
struct ResultArray {
  const char* name;
  std::span<const double> values;
  std::size_t rows = 0;
  std::size_t columns = 1;
  bool is_list = false;
};

struct ResultArrays {
  std::vector<ResultArray> arrays;
  struct Names {
    const char* name;
    std::vector<std::string> names;
  };
  std::vector<Names> names;
  std::string summary;
  std::vector<double> switching_times, left_times, left_y, left_w, left_outputs;  // the values of some of `arrays`
};

// Whether there is a w, or would be if there were a time.
inline bool ShowsW(const SolveResult& result) { return result.has_w() || result.times.empty(); }

// Those of `result`, which must outlive them.
ResultArrays ArraysOf(const std::string& title, const SolveResult& result);

// All write to `out`, a file that is still empty. Errors: Internal if it cannot be written to (the rest may still be in
// the buffers of `out`, and is lost or not when they are flushed); OutOfRange if the format cannot hold as much.

// One array of two dimensions, with the columns of the CSV, t, x, y and w or t and the outputs, without their names.
absl::Status WriteNpy(const SolveResult& result, std::FILE* out);
// A zip archive of arrays and `summary.json`, not packed.
absl::Status WriteNpz(const ResultArrays& all, std::FILE* out);
// A MAT file of level 5, with the names as cell arrays of text. Every variable is smaller than 2 GB.
absl::Status WriteMat(const ResultArrays& all, std::FILE* out);
// The raw file of SPICE: the columns of the CSV with their names.
absl::Status WriteRaw(const std::string& title, const SolveResult& result, std::FILE* out);
// A dataset for each array and for the names; the summary is an attribute of the file.
absl::Status WriteHdf5(const ResultArrays& all, std::FILE* out);

// Such a file at `path` with room for the arrays that are not empty and have no values here: some are written later,
// perhaps by others. Returns where in the file the values of each begin, as numbers of 64 bits in the order of bytes of
// this machine; by their names. Errors: Internal if it cannot be written.
absl::StatusOr<std::map<std::string, std::uint64_t>> WriteHdf5WithRoom(const ResultArrays& all,
                                                                       const std::string& path);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_RESULT_ARRAYS_H_
