// SPDX-License-Identifier: Apache-2.0
// The options of the command line that say how to solve.

#ifndef DLCS_CLIENT_CLI_SOLVE_OPTIONS_H_
#define DLCS_CLIENT_CLI_SOLVE_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <string>

#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Each adds options to `app` that set fields of `options`, which must outlive it.

// --step, --steps, --grid (kept in `grid` as it was typed), --at.
void AddGrid(CLI::App& app, v1::SolveOptions& options, std::string& grid);
// --method and what belongs to one method.
void AddMethod(CLI::App& app, v1::SolveOptions& options);
// --realisation, --acceleration, --windows-in-flight, --max-memory.
void AddRealisation(CLI::App& app, v1::SolveOptions& options);
// --contour-...
void AddContour(CLI::App& app, v1::SolveOptions& options);
// --project-initial-state, --inelastic-impact.
void AddJumps(CLI::App& app, v1::SolveOptions& options);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_SOLVE_OPTIONS_H_
