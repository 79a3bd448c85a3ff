// SPDX-License-Identifier: Apache-2.0
// Prints the result of a solve as a table or as CSV. (For JSON see message_json.h.)
//
// CSV numbers can be read back to the same bits. A value that is not finite is an empty field.

#ifndef DLCS_CLIENT_CLI_OUTPUT_RESULT_OUTPUT_H_
#define DLCS_CLIENT_CLI_OUTPUT_RESULT_OUTPUT_H_

#include <cstdio>
#include <string>

#include "client/result/solve_result.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// `text` as one field of CSV: in quotes if it needs them.
std::string CsvField(const std::string& text);

// A header t,x1,...,xm,y1,...,yn,w1,...,wn, or the names of these, and a line for each time of each chunk, as they
// come. If there are outputs, they take the place of x, y and w.
void PrintCsvHeader(const DisplayNames& names, std::size_t states, std::size_t constraints, bool has_w, std::FILE* out);
void PrintCsvLines(const v1::TrajectoryChunk& chunk, std::FILE* out);
// The header and all lines.
void PrintCsv(const SolveResult& result, std::FILE* out);

// Verdict, trajectory (the outputs if there are any, else x, y and w), measurements and certificate. Columns that do
// not fit into `width` characters follow in further blocks.
void PrintTable(const std::string& name, const SolveResult& result, int width, std::FILE* out);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_RESULT_OUTPUT_H_
