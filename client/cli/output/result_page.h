// SPDX-License-Identifier: Apache-2.0
// The table of a result as the terminal shows it.

#ifndef DLCS_CLIENT_CLI_OUTPUT_RESULT_PAGE_H_
#define DLCS_CLIENT_CLI_OUTPUT_RESULT_PAGE_H_

#include <cstdio>
#include <string>

#include "client/result/solve_result.h"

namespace dlcs::client {

// PrintTable() (result_output.h) on `out`. On a terminal lines are wrapped to its width at blanks, and the verdict is
// green, yellow or red, unless the environment variable NO_COLOR is set and not empty or TERM is "dumb".
void PrintPage(const std::string& name, const SolveResult& result, std::FILE* out);

// `line` wrapped at blanks to at most `width` characters. Continuation lines are indented to the text after the label,
// which ends with two blanks.
std::string Wrapped(const std::string& line, std::size_t width);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_RESULT_PAGE_H_
