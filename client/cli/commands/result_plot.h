// SPDX-License-Identifier: Apache-2.0
// Draws a result with gnuplot.

#ifndef DLCS_CLIENT_CLI_COMMANDS_RESULT_PLOT_H_
#define DLCS_CLIENT_CLI_COMMANDS_RESULT_PLOT_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/result/solve_result.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Whether `output` names a picture, FILE.svg or FILE.png. Errors: InvalidArgument with `option`.
absl::Status CheckPictureName(const std::string& option, const std::string& output);

// Whether there is a gnuplot. Errors: FailedPrecondition with the package.
absl::Status FindGnuplot();

struct PictureOptions {
  std::vector<std::string> show;  // names of components; empty: the outputs, or all of them
  bool profile = false;           // draw over the components, a curve for each time
};

// Draws outputs, or components of x, y and w, over time with the switching times, or over the components, completely or
// not at all.
// `source` is the name of the result in messages. Errors: InvalidArgument if `show` names something else, where there
// is nothing to draw, or the file cannot be written; FailedPrecondition if there is no gnuplot; Internal if it fails.
absl::Status DrawResult(const v1::SolveResult& result, const PictureOptions& options, const std::string& source,
                        const std::string& output);

// The same with all components over time.
absl::Status DrawResult(const std::string& title, const SolveResult& result, const std::string& output);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMANDS_RESULT_PLOT_H_
