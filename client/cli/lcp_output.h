// SPDX-License-Identifier: Apache-2.0
// Single complementarity problems on paper: a table for people, JSON for programs.

#ifndef DLCS_CLIENT_CLI_LCP_OUTPUT_H_
#define DLCS_CLIENT_CLI_LCP_OUTPUT_H_

#include <cstdio>

#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// One object: verdict, message, y, w, residual, pivots, method, matrix_class, rule, only_choice, sets (J, I
// and K, indices from 0; null where it is not solved), all (null where it was not asked for: complete,
// solutions and faces).
void PrintLcpJson(const v1::SolveLcpResponse& response, std::FILE* out);
// Counts from 1, as the table does.
void PrintLcpTable(const v1::SolveLcpResponse& response, std::FILE* out);

// One object: solved (null where a path was measured), message, v (times and values, null likewise),
// certificate, unique (answer, why).
void PrintDcpJson(const v1::SolveDcpResponse& response, bool measured, std::FILE* out);
// Eleven even times of v, the certificate, and whether there may be other solutions.
void PrintDcpTable(const v1::SolveDcpResponse& response, bool measured, int width, std::FILE* out);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_LCP_OUTPUT_H_
