// SPDX-License-Identifier: Apache-2.0
// The options that say how to solve: one row for each field of SolveOptions. The flag, its help and its group, the name
// that an error of the field has, the recommended command and the notice about an option that had no effect follow from
// the row.

#ifndef DLCS_CLIENT_CLI_OPTIONS_SOLVE_OPTION_TABLE_H_
#define DLCS_CLIENT_CLI_OPTIONS_SOLVE_OPTION_TABLE_H_

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/options/option_kinds.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// The kind of value of an option, and of its field.
enum class OptionKind {
  kNumber,      // a number in its range
  kWord,        // an enumerator
  kFlag,        // nothing
  kNegatable,   // nothing: --name sets true, --no-name false
  kTimes,       // times and ranges of times
  kNodes,       // times, or a file with them
  kWindow,      // auto, whole or a number of steps
  kPeriod,      // auto or a number
  kBytes,       // 8GB
  kTolerances,  // a number for all components, and NAME=NUMBER
};

// The part of the help for an option that applies to every method.
enum class OptionGroup { kEveryday, kOther };

struct SolveOption {
  std::string_view field;  // its path in SolveOptions: "contour.nodes"
  std::string_view flag;   // "--contour-nodes"
  OptionKind kind;
  const char* value;  // what the help calls the value; words name themselves
  const char* help;
  std::optional<NumberRule> rule = {};  // for numbers that the engine has no range for
  OptionGroup group = OptionGroup::kOther;
  v1::Method method = v1::METHOD_UNSPECIFIED;     // the method that it applies to; unspecified: all
  bool linear_only = false;                       // no effect on nonlinear systems
  std::array<std::string_view, 2> excludes = {};  // options that it cannot go with
  // Translates words that other programs use.
  std::optional<std::string> (*meant_by)(const std::string&) = nullptr;
};

// In the order of the help. Threads: any.
std::span<const SolveOption> SolveOptionTable();

// The row of the option `flag`, or null.
const SolveOption* FindSolveOption(std::string_view flag);

// What the command line calls a field of SolveOptions, "--contour-nodes" for "contour.nodes"; empty for a field without
// an option.
std::string_view FlagOf(std::string_view field);

// Makes the option of `row` set its field of `options`, which must outlive `app`. The text of a kNodes option is stored
// in `nodes_as_typed`.
CLI::Option* AddSolveOption(CLI::App& app, const SolveOption& row, v1::SolveOptions& options,
                            std::string& nodes_as_typed);

// The options that are set, as typed on a command line: {"--method", "time-stepping", "--steps", "100"}.
// `nodes_as_typed`, unless empty, is used for the nodes.
std::vector<std::string> AsTyped(const v1::SolveOptions& options, const std::string& nodes_as_typed);

// A line for each option that is set but had no effect, because it applies to another method than `used`, or to linear
// systems only.
std::vector<std::string> OptionsWithoutEffect(const v1::SolveOptions& options, v1::Method used, bool nonlinear);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OPTIONS_SOLVE_OPTION_TABLE_H_
