// SPDX-License-Identifier: Apache-2.0
#include "client/cli/model_command_line.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/help_text.h"
#include "client/cli/options/option_kinds.h"
#include "client/cli/solve_options.h"

namespace dlcs::client {
namespace {

using Kinds = std::vector<ModelKind>;

const std::vector<std::pair<std::string, ModelKind>>& Words() {
  static const std::vector<std::pair<std::string, ModelKind>> words = {
      {"input-output", ModelKind::kInputOutput}, {"signorini", ModelKind::kSignorini},
      {"obstacle", ModelKind::kObstacle},        {"american-option", ModelKind::kAmericanOption},
      {"drainage", ModelKind::kDrainage},        {"heat", ModelKind::kHeat}};
  return words;
}

const Kinds kOnGrid = {ModelKind::kSignorini, ModelKind::kObstacle, ModelKind::kAmericanOption, ModelKind::kDrainage};
const Kinds kFromFile = {ModelKind::kInputOutput, ModelKind::kHeat};
const Kinds kInTime = {ModelKind::kSignorini, ModelKind::kObstacle, ModelKind::kAmericanOption, ModelKind::kDrainage,
                       ModelKind::kHeat};

bool IsAmong(ModelKind kind, const Kinds& kinds) { return std::find(kinds.begin(), kinds.end(), kind) != kinds.end(); }

std::string NamesOf(const Kinds& kinds) {
  std::vector<std::string> names;
  for (const auto& [word, kind] : Words()) {
    if (IsAmong(kind, kinds)) names.push_back(word);
  }
  return kinds == kInTime ? "all but input-output" : fmt::format("{}", fmt::join(names, ", "));
}

struct NumberOption {
  const char* name;
  const char* metavariable;
  NumberRule rule;
  Kinds kinds;
  const char* help;
  std::function<void(ModelOptions&, double)> set;
};

template <typename Field>
std::function<void(ModelOptions&, double)> To(Field ModelOptions::*field) {
  return [field](ModelOptions& options, double value) { options.*field = value; };
}

std::function<void(ModelOptions&, double)> ToWhole(std::optional<std::int64_t> ModelOptions::*field) {
  return [field](ModelOptions& options, double value) {
    options.*field = static_cast<std::int64_t>(std::min(value, 1e9));
  };
}

const std::vector<NumberOption>& NumberOptions() {
  using O = ModelOptions;
  static const std::vector<NumberOption> options = {
      {"--cells", "N", Whole("a whole number of at least 2", 2), kOnGrid, "cells of the grid in each direction",
       ToWhole(&O::cells)},
      {"--dimensions", "D", Whole("1, 2 or 3", 1, 3), kOnGrid,
       "of space, or assets: 1 or 2 (1); of signorini 2 or 3 (2)", ToWhole(&O::dimensions)},
      {"--horizon", "T", Positive(), kInTime, "the end time T, or the maturity (1; 4 of signorini and drainage)",
       To(&O::horizon)},
      {"--coefficient",
       "C",
       Positive(),
       {ModelKind::kSignorini, ModelKind::kObstacle, ModelKind::kDrainage, ModelKind::kHeat},
       "c of u_t = c Δu (2e-4; 1; 0.05; 1)",
       To(&O::coefficient)},
      {"--rate",
       "R",
       Within("a number of at least 0", 0, 1e3),
       {ModelKind::kAmericanOption},
       "of interest (0.05)",
       To(&O::rate)},
      {"--volatility", "S", Positive(), {ModelKind::kAmericanOption}, "of each asset (0.2)", To(&O::volatility)},
      {"--correlation",
       "R",
       Within("a number from -1 to 1", -1, 1),
       {ModelKind::kAmericanOption},
       "of two assets (0)",
       To(&O::correlation)},
      {"--drains",
       "N",
       Whole("a whole number of at least 1", 1),
       {ModelKind::kDrainage},
       "drains in each direction (4)",
       ToWhole(&O::drains)},
      {"--conductance", "K", Positive(), {ModelKind::kDrainage}, "of a drain (1)", To(&O::conductance)}};
  return options;
}

struct FormulaOption {
  const char* name;
  Kinds kinds;
  const char* help;
  std::optional<std::string> ModelOptions::*field;
};

const std::vector<FormulaOption>& FormulaOptions() {
  static const std::vector<FormulaOption> options = {
      {"--load",
       {ModelKind::kObstacle, ModelKind::kHeat},
       "what pulls at the membrane (0), or the source of heat (-sin(2*pi*t)), a formula in t",
       &ModelOptions::load},
      {"--recharge", {ModelKind::kDrainage}, "rain, a formula in t (max(0, sin(2*pi*t)))", &ModelOptions::recharge}};
  return options;
}

struct GroupOption {
  const char* name;
  const char* help;
  std::vector<std::string> ModelOptions::*field;
};

const std::vector<GroupOption>& GroupOptions() {
  static const std::vector<GroupOption> options = {
      {"--contact", "physical groups of the surface where 0 <= u and the inward flux complement each other",
       &ModelOptions::contact},
      {"--fixed", "physical groups of the surface where u = 0", &ModelOptions::fixed}};
  return options;
}

}  // namespace

void AddModel(CLI::App& main, ModelCommand& command) {
  CLI::App& app = *main.add_subcommand("model", "Make a problem file from a model");
  std::vector<std::string> words;
  for (const auto& [word, kind] : Words()) words.push_back(word);
  AddWord<ModelKind>(
      app, "KIND", words,
      [](const std::string& wanted) -> std::optional<ModelKind> {
        for (const auto& [word, kind] : Words()) {
          if (word == wanted) return kind;
        }
        return std::nullopt;
      },
      [&command](ModelKind kind) { command.options.kind = kind; }, "The kind of model")
      ->required();
  CLI::Option* const file =
      app.add_option("FILE", command.path, "JSON file of input-output, or mesh of heat (MSH); - reads standard input")
          ->type_name("FILE");

  ModelOptions* const given = &command.options;
  std::vector<std::pair<CLI::Option*, Kinds>> options;
  for (const NumberOption& option : NumberOptions()) {
    options.emplace_back(AddNumber(
                             app, option.name, option.metavariable, option.rule,
                             [given, set = option.set](double value) { set(*given, value); },
                             fmt::format("{}: {}", NamesOf(option.kinds), option.help)),
                         option.kinds);
  }
  for (const FormulaOption& option : FormulaOptions()) {
    options.emplace_back(
        app.add_option_function<std::string>(
               option.name, [given, field = option.field](const std::string& text) { (*given).*field = text; },
               fmt::format("{}: {}", NamesOf(option.kinds), option.help))
            ->type_name("FORMULA"),
        option.kinds);
  }
  const Kinds heat = {ModelKind::kHeat};
  for (const GroupOption& option : GroupOptions()) {
    options.emplace_back(app.add_option(option.name, (*given).*option.field, fmt::format("heat: {}", option.help))
                             ->type_name("NAME,...")
                             ->delimiter(','),
                         heat);
  }
  app.callback([=] {
    const bool reads_file = IsAmong(given->kind, kFromFile);
    if (reads_file && file->count() == 0) {
      throw CLI::ValidationError("FILE", fmt::format("is required for {}", NamesOf({given->kind})));
    }
    if (!reads_file && file->count() > 0) {
      throw CLI::ValidationError("FILE", fmt::format("is for {}; models on a grid take --cells N", NamesOf(kFromFile)));
    }
    for (const auto& [option, kinds] : options) {
      if (!IsAmong(given->kind, kinds) && option->count() > 0) {
        throw CLI::ValidationError(option->get_name(), fmt::format("is for {}", NamesOf(kinds)));
      }
    }
    if (!reads_file && !given->cells) throw CLI::ValidationError("--cells", "is required for models on a grid");
  });
  AddOutput(app, command.output, "the problem");
  app.footer(fmt::format("{}\n\n{}", kModelExamples, kExitCodes));
}

}  // namespace dlcs::client
