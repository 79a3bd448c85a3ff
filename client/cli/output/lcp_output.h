// SPDX-License-Identifier: Apache-2.0
// Prints the results of single complementarity problems as tables. (For JSON see message_json.h.)

#ifndef DLCS_CLIENT_CLI_OUTPUT_LCP_OUTPUT_H_
#define DLCS_CLIENT_CLI_OUTPUT_LCP_OUTPUT_H_

#include <cstdio>

#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Counts from 1, as the table does.
void PrintLcpTable(const v1::SolveLcpResponse& response, std::FILE* out);

// Eleven even times of v, the certificate, and whether there may be other solutions.
void PrintDcpTable(const v1::SolveDcpResponse& response, bool measured, int width, std::FILE* out);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_LCP_OUTPUT_H_
