// SPDX-License-Identifier: Apache-2.0
#include "client/cli/command_line.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "client/cli/commands/command_support.h"
#include "client/cli/commands/contexts.h"
#include "client/cli/completion.h"
#include "client/cli/help_text.h"
#include "client/cli/job_command_line.h"
#include "client/cli/man_page.h"
#include "client/cli/model_command_line.h"
#include "client/cli/options/option_kinds.h"
#include "client/cli/options/solve_option_table.h"
#include "client/cli/server_options.h"
#include "client/cli/solve_options.h"
#include "client/cli/workers_command_line.h"
#include "client/result/names.h"
#include "proto/shared/nearest_name.h"

namespace dlcs::client {
namespace {

constexpr const char* kServerHelp = "Run on the dlcsd at this address instead of in this process";

void AddDeadline(CLI::App& app, double& deadline_s) {
  AddNumber(
      app, "--deadline", "SECONDS", Seconds(), [&deadline_s](double v) { deadline_s = v; },
      fmt::format("Stop after this time ({})", deadline_s));
}

// The options that a solve and an ensemble share.
void AddSolveOptions(CLI::App& app, SolveCommand& command) {
  v1::SolveOptions& options = command.options;
  AddProblem(app, command.problem_path);
  AddServer(app, command.server, kServerHelp);
  AddHowToSolve(app, options, command.grid, command.rule);
  AddDeadline(app, command.deadline_s);
  AddQuiet(app, command.quiet, "Print only errors on standard error; the verdict is in the result and the exit code");
}

void AddSolve(CLI::App& main, SolveCommand& command) {
  CLI::App& app = *main.add_subcommand("solve", "Solve a differential linear complementarity system");
  AddSolveOptions(app, command);
  AddFormatAndOutput(app, kTrajectoryFormats, command.format, kTrajectoryHelp, command.output, "the result");
  app.add_option("--plot", command.plot, "Also draw x, y and w over time, with gnuplot: FILE.svg or FILE.png")
      ->type_name("FILE");
  app.add_flag("-v,--verbose", command.verbose, "On a terminal: print every iterate, not only a panel");
  app.footer(fmt::format("{}\n\n{}", kSolveExamples, kExitCodes));
}

void AddEnsemble(CLI::App& main, EnsembleCommand& command) {
  CLI::App& app = *main.add_subcommand("ensemble", "Solve a system for many initial states, sources or horizons");
  AddSolveOptions(app, command.solve);
  app.add_option("MEMBERS", command.members_path,
                 "JSON file with what each member replaces in the problem, or a table of initial states; without it "
                 "the points of .step in a deck (not with --detach)")
      ->type_name("FILE");
  AddFormatAndOutput(app, {"table", "json", "csv"}, command.solve.format,
                     "One line for each member (table); as they finish: JSON lines, or CSV", command.solve.output,
                     "the result");
  CLI::Option& detach = *app.add_flag(
      "--detach", command.detach,
      "Create a job on the server, print its name and end; watch, result and cancel take it. It keeps the end of each "
      "member, T or the last node before it breaks down");
  for (const char* option : {"--local", "--format", "--output"}) detach.excludes(app.get_option(option));
  CLI::Option& deadline = *app.get_option("--deadline");
  deadline.each([&command](const std::string& /*seconds*/) { command.has_deadline = true; });
  deadline.description(deadline.get_description() +
                       "; with --detach the deadline of the job, from now: it is refused if no shard can meet it, and "
                       "stopped then");
  app.add_flag("--extrema", command.extrema,
               "Also keep the smallest and largest value of each x, y, w and output, at all nodes or at the times "
               "of --at and the end")
      ->needs(&detach);
  app.footer(fmt::format("{}\n\n{}", kEnsembleExamples, kEnsembleExitCodes));
}

void AddAnalyze(CLI::App& main, AnalyzeCommand& command) {
  CLI::App& app = *main.add_subcommand("analyze", "Report what is known about a system, and how to solve it");
  AddProblem(app, command.problem_path);
  AddServer(app, command.server, kServerHelp);
  AddHowToSolve(app, command.options, command.grid, command.rule);
  AddDeadline(app, command.deadline_s);
  AddFormatAndOutput(app, {"table", "json"}, command.format, "What to print (table)", command.output, "the analysis");
  app.add_flag("-v,--verbose", command.verbose, "Print every finding, witness, constant and source");
  app.footer(fmt::format("{}\n\n{}", kAnalyzeExamples, kExitCodes));
}

void AddLcp(CLI::App& main, LcpCommand& command) {
  CLI::App& app = *main.add_subcommand("lcp", "Solve one linear complementarity problem");
  app.add_option("FILE", command.path, "JSON file with M and q; - reads standard input")->required()->type_name("FILE");
  AddServer(app, command.server, kServerHelp);
  AddRule(app, command.rule);
  app.add_flag("--all", command.all, "List all basic solutions, for at most 16 pairs");
  AddDeadline(app, command.deadline_s);
  AddFormat(app, {"table", "json"}, command.format, "What to print (table)");
  app.footer(fmt::format("{}\n\n{}", kLcpExamples, kExitCodes));
}

void AddDcp(CLI::App& main, DcpCommand& command) {
  CLI::App& app = *main.add_subcommand("dcp", "Solve a dynamic complementarity problem, or check a path");
  app.add_option("FILE", command.path, "JSON file with M and q; - reads standard input")->required()->type_name("FILE");
  AddServer(app, command.server, kServerHelp);
  CLI::Option* step = AddNumber(
      app, "--step", "H", Positive(), [&](double v) { command.step = v; },
      "Largest length of a step between the nodes of q (a thousandth of its time)");
  app.add_option("--check", command.check, "Check this path v instead of solving: JSON with times and values")
      ->type_name("FILE")
      ->excludes(step);
  AddDeadline(app, command.deadline_s);
  AddFormat(app, {"table", "json"}, command.format, "What to print (table)");
  app.footer(fmt::format("{}\n\n{}", kDcpExamples, kExitCodes));
}

void AddPlot(CLI::App& main, PlotCommand& command) {
  CLI::App& app = *main.add_subcommand("plot", "Draw a result: x, y and w over time, or over their components");
  app.add_option("RESULT", command.path, "The JSON of a solve (--format json); - reads standard input")
      ->type_name("FILE")
      ->required();
  app.add_option("-o,--output", command.output, "The picture, FILE.svg or FILE.png")->type_name("FILE")->required();
  app.add_option("--show", command.show,
                 "Only these components, by their names in CSV files or as x1, y1, w1; x, y, w: all of a kind")
      ->type_name("NAME,...")
      ->delimiter(',');
  app.add_flag("--profile", command.profile,
               "Draw over the components instead of over time, a curve for each time of the result");
  app.footer(fmt::format("{}\n\n{}", kPlotExamples, kExitCodes));
}

// How a deck is read.
void AddDeckOptions(CLI::App& app, DeckOptions& options) {
  AddWord<DiodeRule>(
      app, "--diode", {"tangent", "pwl", "ideal"},
      [](const std::string& word) {
        return word == "tangent" ? std::optional(DiodeRule::kTangent)
               : word == "pwl"   ? std::optional(DiodeRule::kPiecewise)
               : word == "ideal" ? std::optional(DiodeRule::kIdeal)
                                 : std::nullopt;
      },
      [&options](DiodeRule rule) { options.diode = rule; },
      "What a diode with IS, N and RS becomes: the tangent to its exponential at --diode-current, three chords from a "
      "hundredth to ten times that current (pwl), or an ideal diode (tangent)");
  AddNumber(
      app, "--diode-current", "AMPERES", Positive(), [&options](double value) { options.diode_current = value; },
      "The current at which the tangent touches (1)");
  AddNumber(
      app, "--current-limit", "FACTOR", Positive(), [&options](double value) { options.current_limit = value; },
      "Multiplies the largest current of each switch, which is twice what the sources can drive through it (1)");
  app.add_flag("--ideal-edges", options.ideal_edges, "Missing or zero ramps of PULSE are jumps, and not TSTEP long");
}

void AddNetlist(CLI::App& main, NetlistCommand& command) {
  CLI::App& app = *main.add_subcommand("netlist", "Make a problem file from a SPICE deck");
  app.add_option("DECK", command.path, "SPICE deck; - reads standard input")->required()->type_name("FILE");
  AddDeckOptions(app, command.options);
  AddOutput(app, command.output, "the problem file");
  app.add_flag("--message", command.message,
               "Write the serialized ProblemBody of the contract, for programs, instead of a problem file");
  AddQuiet(app, command.quiet, "Print no notes on what was ignored or assumed");
  app.footer(fmt::format("{}\n\n{}", kNetlistExamples, kExitCodes));
}

void AddCompletion(CLI::App& main, std::string& shell) {
  CLI::App& app = *main.add_subcommand("completion", "Print a script that completes commands and options in a shell");
  AddWord<std::string>(
      app, "SHELL", {"bash", "zsh", "fish"},
      [](const std::string& word) {
        return word == "bash" || word == "zsh" || word == "fish" ? std::optional(word) : std::nullopt;
      },
      [&shell](const std::string& word) { shell = word; }, "The shell")
      ->required();
  app.footer(kCompletionExamples);
}

void AddMan(CLI::App& main) {
  CLI::App& app = *main.add_subcommand("man", "Print the manual page of all commands, in roff");
  app.footer(kManExamples);
}

void AddCapabilities(CLI::App& main, CapabilitiesCommand& command) {
  CLI::App& app = *main.add_subcommand("capabilities", "Print the methods and limits of this program or of a server");
  AddServer(app, command.server, kServerHelp);
  AddDeadline(app, command.deadline_s);
  AddFormat(app, {"table", "json"}, command.format, "What to print (table)");
  app.footer(kCapabilitiesExamples);
}

void AddHealth(CLI::App& main, HealthCommand& command) {
  CLI::App& app = *main.add_subcommand("health", "Check whether a server serves");
  AddServer(app, command.server, fmt::format("The dlcsd at this address ({})", command.server.address));
  app.add_option("--service", command.service, "One of its services (default: the server as a whole)")
      ->type_name("NAME");
  AddDeadline(app, command.deadline_s);
  app.footer(kHealthExamples);
}

void AddContext(CLI::App& main, ContextCommand& command) {
  using Action = ContextCommand::Action;
  CLI::App& app = *main.add_subcommand("context", "Name servers, instead of typing --server and --tls-... each time");
  app.require_subcommand(1);
  app.footer(kContextExamples);
  const auto add = [&](const char* name, const char* what, Action action) -> CLI::App& {
    CLI::App& sub = *app.add_subcommand(name, what);
    sub.callback([&command, action] { command.action = action; });
    return sub;
  };
  const auto name_of = [&command](CLI::App& sub) {
    return sub.add_option("NAME", command.name, "Name of the context")->type_name("");
  };
  CLI::App& set = add("set", "Create or replace a context", Action::kSet);
  name_of(set)->required();
  AddServer(set, command.server, "The dlcsd at this address");
  set.get_option("--server")->required();
  for (const char* option : {"--local", "--context"}) set.remove_option(set.get_option(option));
  name_of(add("use", "Use this context from now on; without a name, use none", Action::kUse));
  add("list", "List the contexts; the current one has a star", Action::kList);
  name_of(add("delete", "Delete a context", Action::kDelete))->required();
  for (CLI::App* sub : app.get_subcommands({})) sub->footer(kContextExamples);
}

// CLI11 takes "-.5" for an option of that name, unlike "-0.5": tie a value that looks like a number to the
// option before it.
std::vector<std::string> WithNegativeNumbersTied(int argc, const char* const* argv) {
  std::vector<std::string> arguments;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const bool negative = argument.size() > 1 && argument[0] == '-' &&
                          (std::isdigit(static_cast<unsigned char>(argument[1])) != 0 || argument[1] == '.');
    const bool after_option = !arguments.empty() && arguments.back().rfind("--", 0) == 0 &&
                              arguments.back().find('=') == std::string::npos && arguments.back().size() > 2;
    if (negative && after_option) {
      arguments.back() += "=" + argument;
    } else {
      arguments.push_back(argument);
    }
  }
  return arguments;
}

// The command of `app` that was typed, down to the last subcommand.
const CLI::App& Current(const CLI::App& app) {
  const auto subcommands = app.get_subcommands();
  return subcommands.empty() ? app : Current(*subcommands.front());
}

std::vector<std::string> KnownCommands(const CLI::App& current) {
  std::vector<std::string> names;
  for (const CLI::App* command : current.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(command->get_name());
  }
  return names;
}

// The options and commands that `current` knows, for "did you mean".
std::vector<std::string> KnownNames(const CLI::App& current) {
  std::vector<std::string> names = KnownCommands(current);
  for (const CLI::Option* option : current.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

// "--step-solver newton" for "--newton": the option that has `name` as a value.
std::optional<std::string> OptionOfValue(const CLI::App& current, const std::string& name) {
  const std::string value = name.substr(std::min(name.find_first_not_of('-'), name.size()));
  for (const CLI::Option* option : current.get_options()) {
    std::istringstream words(option->get_type_name());
    for (std::string word; std::getline(words, word, '|');) {
      if (word == value && !option->get_lnames().empty())
        return fmt::format("--{} {}", option->get_lnames().front(), word);
    }
  }
  return std::nullopt;
}

// The option of `current` that another command, or another program, has by the name `name`.
std::optional<std::string> OptionMeantBy(const CLI::App& current, const std::string& name) {
  static const std::multimap<std::string, std::string> kMeant = {
      {"--deadline", "--within"}, {"--within", "--deadline"}, {"--rtol", "--tolerance"}, {"--atol", "--tolerance"},
      {"--dt", "--step"},         {"--host", "--server"},     {"--address", "--server"}};
  const auto [begin, end] = kMeant.equal_range(name);
  for (auto meant = begin; meant != end; ++meant) {
    if (current.get_option_no_throw(meant->second) != nullptr) return meant->second;
  }
  return std::nullopt;
}

// "dlcs solve takes PROBLEM alone"
std::string WordsTaken(const CLI::App& current) {
  std::vector<std::string> words;
  for (const CLI::Option* option : current.get_options()) {
    if (option->get_positional()) words.push_back(option->get_name(/*positional=*/true));
  }
  const std::string command = "dlcs " + current.get_name();
  if (words.empty()) return command + " takes options alone";
  return fmt::format("{} takes {}{}", command, fmt::join(words, " and "), words.size() == 1 ? " alone" : "");
}

bool IsFile(const std::string& word) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(word, ignored);
}

// The message for a word that is not an option or command here, with the nearest one that is.
std::string NotKnown(const CLI::App& app, const std::string& word) {
  const std::string name = word.substr(0, word.find('='));
  const CLI::App& current = Current(app);
  if (&current == &app && IsFile(word)) {
    return fmt::format("\"{}\" is a file, not a command; did you mean dlcs solve {}?", word, word);
  }
  auto meant = OptionOfValue(current, name);
  if (!meant) meant = OptionMeantBy(current, name);
  if (!meant) meant = NearestName(name, KnownNames(current));
  const bool is_word = word[0] != '-' && KnownCommands(current).empty();
  if (is_word && (!meant || IsFile(word))) {
    return fmt::format("\"{}\" is one word too many; {}", word, WordsTaken(current));
  }
  return fmt::format("\"{}\" is not known here{}", name, DidYouMean(meant));
}

// Refuses empty names of files, jobs and the like: most likely a variable of a script is not set.
void RefuseEmptyNames(CLI::App& command) {
  const auto not_empty = [](const std::string& text) {
    return std::string(text.empty() ? "is empty; is a variable of your script unset?" : "");
  };
  for (CLI::Option* option : command.get_options()) {
    if (option->get_positional() || option->get_type_name() == "FILE") option->check(CLI::Validator(not_empty, ""));
  }
}

// Groups of the help of a command that has many options.
constexpr const char* kEveryday = "Everyday";
constexpr const char* kOther = "Accuracy, model and machine";
constexpr const char* kServer = "Server";

std::string OnlyFor(v1::Method method) { return "Only " + Word(method); }

std::string GroupOf(const std::string& flag) {
  static const std::map<std::string, std::vector<std::string>> kGroups = {
      {kEveryday,
       {"--format", "--output", "--plot", "--quiet", "--verbose", "--deadline", "--help", "--title", "--wait"}},
      {kServer,
       {"--server", "--context", "--local", "--token-file", "--tls", "--tls-ca", "--tls-cert", "--tls-key",
        "--patience"}},
  };
  if (const SolveOption* row = FindSolveOption(flag)) {
    if (row->method != v1::METHOD_UNSPECIFIED) return OnlyFor(row->method);
    return row->group == OptionGroup::kEveryday ? kEveryday : kOther;
  }
  for (const auto& [group, flags] : kGroups) {
    if (std::find(flags.begin(), flags.end(), flag) != flags.end()) return group;
  }
  return kOther;
}

// In the order of the help.
std::vector<std::string> AllGroups() {
  return {"Options",
          kEveryday,
          kOther,
          OnlyFor(v1::METHOD_TIME_STEPPING),
          OnlyFor(v1::METHOD_LAPLACE_ITERATION),
          OnlyFor(v1::METHOD_WU_CHEN_ITERATION),
          kServer};
}

// Puts the options of a command that has many into groups.
void Group(CLI::App& app) {
  constexpr std::size_t kMany = 20;
  const auto options = app.get_options();
  for (CLI::Option* option : options) {
    if (!option->nonpositional()) continue;
    const std::string group = GroupOf("--" + option->get_lnames().front());
    if (options.size() > kMany || group == kServer) option->group(group);
  }
}

// Prints groups in a fixed order, not in that of the options. Of an option it prints names and value, but not which
// options it excludes or needs, since the error says that.
class GroupedHelp : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    return make_description(app) + make_usage(app, name) + make_positionals(app) + Groups(*app) +
           make_subcommands(app, mode) + '\n' + make_footer(app);
  }

  std::string make_option_name(const CLI::Option* option, bool is_positional) const override {
    std::string name = CLI::Formatter::make_option_name(option, is_positional);
    const std::size_t value = name.find("{false}");  // of a flag that says no
    return value == std::string::npos ? name : name.erase(value, std::string("{false}").size());
  }
  std::string make_option_opts(const CLI::Option* option) const override {
    const std::string text = CLI::Formatter::make_option_opts(option);
    return text.substr(0, std::min(text.find(" Excludes:"), text.find(" Needs:")));
  }
  // Wrapped at 70 characters, which CLI11 does not do.
  std::string make_option_desc(const CLI::Option* option) const override {
    constexpr std::size_t kLetters = 70;
    std::istringstream words(option->get_description());
    std::string text;
    std::size_t letters = 0;  // of the last line
    for (std::string word; words >> word;) {
      const bool fits = letters + 1 + word.size() <= kLetters;
      if (!text.empty()) text += fits ? " " : "\n";
      letters = (text.empty() || !fits ? 0 : letters + 1) + word.size();
      text += word;
    }
    return text;
  }

 private:
  std::string Groups(const CLI::App& app) const {
    std::string text;
    for (const std::string& group : AllGroups()) {
      const auto options = app.get_options(
          [&group](const CLI::Option* option) { return option->get_group() == group && option->nonpositional(); });
      if (!options.empty()) text += make_group(group, false, options);
    }
    return text;
  }
};

// What is wrong with `arguments`: the message of CLI11, except for names that do not exist.
std::string WhatIsWrong(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& arguments) {
  const auto is_option = [](const std::string& word) { return word.size() > 1 && word[0] == '-'; };
  // An unknown option comes first: other errors may follow from it. (Its values are left over as well.)
  const std::vector<std::string> extras = app.remaining(/*recurse=*/true);
  const auto option = std::find_if(extras.begin(), extras.end(), is_option);
  if (option != extras.end()) return NotKnown(app, *option);
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr && !extras.empty()) return NotKnown(app, extras.front());
  if (const CLI::App& group = Current(app); &group != &app && !KnownCommands(group).empty()) {
    const auto name = std::find(arguments.begin(), arguments.end(), group.get_name());
    const auto word = std::find_if_not(name == arguments.end() ? name : name + 1, arguments.end(), is_option);
    if (word != arguments.end()) return NotKnown(app, *word);
    return fmt::format("missing command: {}", fmt::join(KnownCommands(group), ", "));
  }
  if (app.get_subcommands().empty()) {
    const auto word = std::find_if_not(arguments.begin(), arguments.end(), is_option);
    if (word != arguments.end()) return NotKnown(app, *word);
    return "missing command: solve, ensemble, analyze, lcp, dcp, model, netlist, plot, capabilities, health, context, "
           "workers, completion, man, or with jobs submit, watch, get, list, cancel, delete, result, upload or "
           "problems";
  }
  if (dynamic_cast<const CLI::ExcludesError*>(&error) != nullptr) {
    return fmt::format("{}; give one of them", error.what());
  }
  if (const std::string what = error.what(); what.find(": At Most 1 required") != std::string::npos) {
    return fmt::format("{} is there more than once; give it once", what.substr(0, what.find(':')));
  } else if (const std::size_t at = what.find(": 1 required "); at != std::string::npos && what.ends_with(" missing")) {
    const std::size_t begin = at + std::string_view(": 1 required ").size();
    return fmt::format("{0} has no value; write {0} {1}", what.substr(0, at),
                       what.substr(begin, what.size() - begin - std::string_view(" missing").size()));
  }
  return error.what();
}

ExitCode PrintError(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& arguments) {
  std::string command;
  const CLI::App* current = &app;
  for (auto subs = app.get_subcommands(); !subs.empty(); subs = current->get_subcommands()) {
    current = subs.front();
    command += current->get_name() + " ";
  }
  fmt::print(stderr, "dlcs: {}\nFor all options run: dlcs {}--help\n", WhatIsWrong(app, error, arguments), command);
  return kBadInput;
}

// `command` with its server `target` completed from the environment, or the exit code if the environment is wrong.
template <typename Command>
ParsedCommandLine WithServer(Command& command, ServerTarget& target) {
  const absl::Status status = Complete(target);
  if (!status.ok()) return PrintError(status, kBadInput);
  return command;
}

}  // namespace

ParsedCommandLine ParseCommandLine(int argc, const char* const* argv) {
  SolveCommand solve;
  EnsembleCommand ensemble;
  AnalyzeCommand analyze;
  LcpCommand lcp;
  DcpCommand dcp;
  ModelCommand model;
  NetlistCommand netlist;
  PlotCommand plot;
  CapabilitiesCommand capabilities;
  HealthCommand health;
  ContextCommand context;
  WorkersCommand workers;
  JobCommands jobs;
  std::string shell;  // to complete
  CLI::App app("dlcs solves differential linear complementarity systems, in this process or on a server.", "dlcs");
  app.set_version_flag("--version", std::string("dlcs ") + DLCS_VERSION);
  app.require_subcommand(1);
  app.footer(fmt::format("{}\n\n{}", kMainExamples, kExitCodes));
  AddSolve(app, solve);
  AddEnsemble(app, ensemble);
  AddAnalyze(app, analyze);
  AddLcp(app, lcp);
  AddDcp(app, dcp);
  AddModel(app, model);
  AddNetlist(app, netlist);
  AddPlot(app, plot);
  AddCapabilities(app, capabilities);
  AddHealth(app, health);
  AddContext(app, context);
  AddWorkers(app, workers);
  AddCompletion(app, shell);
  AddMan(app);
  AddJobCommands(app, jobs);
  app.formatter(std::make_shared<GroupedHelp>());
  for (CLI::App* command : app.get_subcommands({})) {
    Group(*command);
    RefuseEmptyNames(*command);
    command->formatter(app.get_formatter());
  }

  std::vector<std::string> arguments = WithNegativeNumbersTied(argc, argv);
  // "dlcs help solve" is "dlcs solve --help".
  if (!arguments.empty() && arguments.front() == "help") {
    arguments.erase(arguments.begin());
    const std::vector<std::string> commands = KnownCommands(app);
    if (!arguments.empty() && std::find(commands.begin(), commands.end(), arguments.front()) == commands.end()) {
      fmt::print(stderr, "dlcs: {}\nFor all commands run: dlcs --help\n", NotKnown(app, arguments.front()));
      return kBadInput;
    }
    arguments.push_back("--help");
  }
  try {
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));  // backwards, as CLI11 wants
  } catch (const CLI::CallForHelp& help) {
    app.exit(help);
    return kSolved;
  } catch (const CLI::CallForVersion& version) {
    app.exit(version);
    return kSolved;
  } catch (const CLI::ParseError& error) {
    return PrintError(app, error, arguments);
  }
  if (app.got_subcommand("solve")) return WithServer(solve, solve.server);
  if (app.got_subcommand("ensemble")) return WithServer(ensemble, ensemble.solve.server);
  if (app.got_subcommand("analyze")) return WithServer(analyze, analyze.server);
  if (app.got_subcommand("lcp")) return WithServer(lcp, lcp.server);
  if (app.got_subcommand("dcp")) return WithServer(dcp, dcp.server);
  if (app.got_subcommand("model")) return model;
  if (app.got_subcommand("netlist")) return netlist;
  if (app.got_subcommand("plot")) return plot;
  if (app.got_subcommand("completion")) {
    fmt::print("{}", CompletionScript(app, shell));
    return kSolved;
  }
  if (app.got_subcommand("man")) {
    fmt::print("{}", ManPage(app, AllGroups()));
    return kSolved;
  }
  if (app.got_subcommand("health")) return WithServer(health, health.server);
  if (app.got_subcommand("context")) return context;
  if (app.got_subcommand("workers")) return workers;
  if (app.got_subcommand("submit")) return WithServer(jobs.submit, jobs.submit.target.server);
  if (app.got_subcommand("upload")) return WithServer(jobs.upload, jobs.upload.target.server);
  if (app.got_subcommand("problems")) return WithServer(jobs.problems, jobs.problems.target.server);
  if (app.got_subcommand("watch")) return WithServer(jobs.watch, jobs.watch.target.server);
  if (app.got_subcommand("get")) return WithServer(jobs.get, jobs.get.target.server);
  if (app.got_subcommand("list")) return WithServer(jobs.list, jobs.list.target.server);
  if (app.got_subcommand("cancel")) return WithServer(jobs.cancel, jobs.cancel.target.server);
  if (app.got_subcommand("delete")) return WithServer(jobs.remove, jobs.remove.target.server);
  if (app.got_subcommand("result")) return WithServer(jobs.result, jobs.result.target.server);
  return WithServer(capabilities, capabilities.server);
}

}  // namespace dlcs::client
