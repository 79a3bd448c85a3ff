// SPDX-License-Identifier: Apache-2.0
// The table of a result as the terminal shows it.

#ifndef DLCS_CLIENT_CLI_OUTPUT_RESULT_PAGE_H_
#define DLCS_CLIENT_CLI_OUTPUT_RESULT_PAGE_H_

#include <cstdio>
#include <string>

#include "client/result/solve_result.h"

namespace dlcs::client {

// PrintTable() (result_output.h) on `out`. On a terminal no line is longer than it is wide, as far as blanks allow it,
// and the verdict is green, yellow or red, unless the environment's NO_COLOR is set and not empty or TERM is "dumb".
void PrintPage(const std::string& name, const SolveResult& result, std::FILE* out);

// `line` in lines of at most `width` letters where blanks allow it; those behind the first begin below the text that
// follows the label of the first, which ends with two blanks.
std::string Wrapped(const std::string& line, std::size_t width);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_RESULT_PAGE_H_
