// SPDX-License-Identifier: Apache-2.0
// Prints the results of single complementarity problems as tables. (For JSON see message_json.h.)

#ifndef DLCS_CLIENT_CLI_OUTPUT_LCP_OUTPUT_H_
#define DLCS_CLIENT_CLI_OUTPUT_LCP_OUTPUT_H_

#include <cstdio>
#include <string>

#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Counts from 1, as the table does.
void PrintLcpTable(const v1::SolveLcpResponse& response, std::FILE* out);

struct DcpVerdict {
  bool solved = false;
  std::string message;
};

// That of the response, or of its certificate where the request holds a path to check. A path is a solution where v(0)
// and what v decreases by are at most 1e-6 of the largest |v|, -w at most 1e-6 of the largest |q| + |M| |v|, and the
// integrals of w_i dv_i, which are of first order in the steps of a solve, 1 % of the product of both.
DcpVerdict VerdictOf(const v1::SolveDcpRequest& request, const v1::SolveDcpResponse& response);

// The verdict, eleven even times of v if there are any, the certificate, and whether there may be other solutions.
void PrintDcpTable(const v1::SolveDcpResponse& response, const DcpVerdict& verdict, int width, std::FILE* out);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_LCP_OUTPUT_H_
