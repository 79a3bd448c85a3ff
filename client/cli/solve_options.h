// SPDX-License-Identifier: Apache-2.0
// The options that several commands have.

#ifndef DLCS_CLIENT_CLI_SOLVE_OPTIONS_H_
#define DLCS_CLIENT_CLI_SOLVE_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/commands/commands.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Each function adds options to `app` that set the other arguments, which must outlive `app`.

// All options of the table (solve_option_table.h) and --rule.
void AddHowToSolve(CLI::App& app, v1::SolveOptions& options, std::string& nodes_as_typed,
                   std::optional<v1::SolutionRule>& rule);
// --rule.
void AddRule(CLI::App& app, std::optional<v1::SolutionRule>& rule);

// PROBLEM, the file.
void AddProblem(CLI::App& app, std::string& path);
// -o, --output.
void AddOutput(CLI::App& app, std::string& output, const char* what);
// -q, --quiet.
void AddQuiet(CLI::App& app, bool& quiet, const char* what);
// -f, --format, one of `words`; Also -o if one of them is "name": commands that list things write no files.
void AddFormat(CLI::App& app, const std::vector<std::string>& words, OutputFormat& format, const std::string& help);
// The same, and --output. Without --format the ending of the file chooses, and must be that of one of `words`; formats
// of arrays need a file. Takes the callback of `app`.
void AddFormatAndOutput(CLI::App& app, const std::vector<std::string>& words, OutputFormat& format,
                        const std::string& help, std::string& output, const char* what);
// The formats of one trajectory, and their help.
inline const std::vector<std::string> kTrajectoryFormats = {"table", "json", "csv", "npy", "npz", "hdf5", "mat", "raw"};
inline constexpr const char* kTrajectoryHelp =
    "What to print or write (by the ending of the file, .json .csv .npy .npz .h5 .hdf5 .mat .raw, or table)";

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_SOLVE_OPTIONS_H_
