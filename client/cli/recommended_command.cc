// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>

#include "client/cli/analysis_output.h"
#include "client/names.h"

namespace dlcs::client {
namespace {

// As a shell reads it: quoted where it holds anything but letters that every shell leaves alone.
std::string ShellWord(const std::string& text) {
  constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./-+:,@%";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace

std::string RecommendedCommand(const Asked& asked, const v1::SolveOptions& options) {
  const v1::SolveOptions unset;
  std::string command = "dlcs solve " + ShellWord(asked.source);
  if (!asked.server.empty()) command += " --server " + ShellWord(asked.server);
  if (asked.rule) command += " --rule " + RuleName(*asked.rule);
  if (options.method() != unset.method()) command += " --method " + MethodName(options.method());
  if (options.has_steps()) command += fmt::format(" --steps {}", options.steps());
  if (options.has_step()) command += fmt::format(" --step {}", options.step());
  if (options.error_tolerance() > 0) command += fmt::format(" --tolerance {}", options.error_tolerance());
  if (options.has_grid_times()) command += " --grid " + ShellWord(asked.grid);
  if (!options.output_times().empty())
    command += fmt::format(" --at {}", fmt::join(options.output_times(), ","));
  if (options.theta() != 0) command += fmt::format(" --theta {}", options.theta());
  if (options.step_solver() == v1::STEP_SOLVER_NEWTON) command += " --step-solver newton";
  if (options.average_y()) command += " --average-y";
  if (options.window_steps() == -1) command += " --window whole";
  if (options.window_steps() > 0) command += fmt::format(" --window {}", options.window_steps());
  if (options.kernel() != unset.kernel()) command += " --kernel " + KernelSourceName(options.kernel());
  if (options.realisation() != unset.realisation())
    command += " --realisation " + RealisationName(options.realisation());
  if (options.windows_in_flight() != 0)
    command += fmt::format(" --windows-in-flight {}", options.windows_in_flight());
  if (options.acceleration() != 0) command += fmt::format(" --acceleration {}", options.acceleration());
  if (options.interpolation() == v1::INTERPOLATION_CUBIC_SPLINE) command += " --interpolation cubic-spline";
  if (options.contour().choice() != unset.contour().choice())
    command += " --contour " + ContourChoiceName(options.contour().choice());
  if (options.has_estimate_error() && !options.estimate_error()) command += " --no-estimate-error";
  if (options.project_initial_state()) command += " --project-initial-state";
  if (options.inelastic_impact()) command += " --inelastic-impact";
  return command;
}

}  // namespace dlcs::client
