// SPDX-License-Identifier: Apache-2.0
// Draws a result with gnuplot.

#ifndef DLCS_CLIENT_CLI_COMMANDS_RESULT_PLOT_H_
#define DLCS_CLIENT_CLI_COMMANDS_RESULT_PLOT_H_

#include <string>

#include "absl/status/status.h"
#include "client/result/solve_result.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Whether `output` names a picture, FILE.svg or FILE.png. Errors: InvalidArgument with `option`.
absl::Status CheckPictureName(const std::string& option, const std::string& output);

// Whether there is a gnuplot. Errors: FailedPrecondition with the package.
absl::Status FindGnuplot();

// Draws x, y and w of the trajectory over time, and the switching times, completely or not at all. `source` is the name
// of the result in messages. Errors: InvalidArgument where there is nothing to draw, or the file cannot be written;
// FailedPrecondition if there is no gnuplot; Internal if it fails.
absl::Status DrawResult(const v1::SolveResult& result, const std::string& source, const std::string& output);
absl::Status DrawResult(const std::string& title, const SolveResult& result, const std::string& output);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMANDS_RESULT_PLOT_H_
