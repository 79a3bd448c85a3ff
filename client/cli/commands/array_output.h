// SPDX-License-Identifier: Apache-2.0
// Array formats of mathematical programs, and the formats that file endings stand for.

#ifndef DLCS_CLIENT_CLI_COMMANDS_ARRAY_OUTPUT_H_
#define DLCS_CLIENT_CLI_COMMANDS_ARRAY_OUTPUT_H_

#include <cstdio>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "client/cli/commands/commands.h"
#include "client/cli/output/result_arrays.h"
#include "client/result/solve_result.h"

namespace dlcs::client {

// Whether it is one of .npy, .npz, HDF5, .mat and the raw file of SPICE.
bool IsOfArrays(OutputFormat format);

// The format that the ending of `path` names, in small or large letters: .csv .json .npy .npz .h5 .hdf5 .mat .raw.
struct NamedFormat {
  const char* word;  // of --format
  OutputFormat format;
};
std::optional<NamedFormat> FormatByEnding(const std::string& path);

// Writes `result` to `out`, an empty file, in a `format` of arrays. Errors: as in client/cli/output/result_arrays.h.
absl::Status WriteArrays(OutputFormat format, const std::string& title, const SolveResult& result, std::FILE* out);

// The same for any arrays: .npz, HDF5 or .mat.
absl::Status WriteArrays(OutputFormat format, const ResultArrays& all, std::FILE* out);

// `error` about the file at `path`: "cannot write FILE: ...".
absl::Status WithFile(const absl::Status& error, const std::string& path);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMANDS_ARRAY_OUTPUT_H_
