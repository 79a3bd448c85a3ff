// SPDX-License-Identifier: Apache-2.0
// The result of a solve on paper: a table for people, JSON and CSV for programs.
//
// JSON and CSV print every number so that reading it gives the same bits. What is not finite is null in JSON
// and an empty field in CSV.

#ifndef DLCS_CLIENT_CLI_RESULT_OUTPUT_H_
#define DLCS_CLIENT_CLI_RESULT_OUTPUT_H_

#include <cstdio>
#include <string>

#include "client/solve_result.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// One object, keys in a fixed order: name, termination, message, failure_time, method, reason, states, pairs (their
// names, where there are any), matrix_class,
// lipschitz, warnings, step, iterations, seconds, certificate, cost, kernel, realisation, contour, newton
// (null where no step was solved by it), jumps, times, x, y, w (a list per time; no w from servers that do not send
// it).
void PrintJson(const std::string& name, const SolveResult& result, std::FILE* out);

// A header t,x1,...,xm,y1,...,yn,w1,...,wn, or the names of these, and a line for each time of each chunk, as they
// come.
void PrintCsvHeader(const ComponentNames& names, std::size_t states, std::size_t constraints, bool has_w,
                    std::FILE* out);
void PrintCsvLines(const v1::TrajectoryChunk& chunk, std::FILE* out);

// Verdict, trajectory and certificate in words. Columns that do not fit into `width` letters follow in
// further blocks.
void PrintTable(const std::string& name, const SolveResult& result, int width, std::FILE* out);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_RESULT_OUTPUT_H_
