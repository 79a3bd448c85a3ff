// SPDX-License-Identifier: Apache-2.0
#include "client/cli/command_line.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "client/json_text.h"
#include "client/names.h"
#include "client/nearest_name.h"

namespace dlcs::client {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

constexpr const char* kExitCodes =
    "Exit codes: 0 solved; 1 the mathematics has no answer (the result says why); 2 bad input (file, "
    "option,\n"
    "problem); 3 the service failed, or the solve was cancelled or ran out of time.";

constexpr const char* kMainExamples =
    "Examples:\n"
    "  dlcs solve circuit.json                            solve here, print a table\n"
    "  dlcs solve circuit.json --server localhost:50051   the same on a server (start one with dlcsd)\n"
    "  dlcs analyze circuit.json                          what is known before solving, and how to solve\n"
    "  dlcs lcp lcp.json                                  one linear complementarity problem\n"
    "  dlcs solve --help                                  all options, more examples";

constexpr const char* kSolveExamples =
    "A problem file is one JSON object with the keys A B N M x0 T and f and g (or pieces), of\n"
    "    x' = A x + B y + f(t),  0 <= y, N x + g(t) + M y >= 0 complementary,  x(0) = x0,  t in [0, T]\n"
    "as in {\"A\": [[-1]], \"B\": [[1]], \"N\": [[1]], \"M\": [[1]], \"x0\": [0], \"T\": 5, \"f\": "
    "[\"sin(t)\"], \"g\": [\"-1\"]}\n"
    "\n"
    "Examples:\n"
    "  dlcs solve circuit.json --steps 100000 --estimate-error\n"
    "  dlcs solve circuit.json --method time-stepping --step 1e-4 --project-initial-state\n"
    "  dlcs solve circuit.json --at 0.5,1,2 --format json --quiet\n"
    "  dlcs solve circuit.json --grid nodes.txt\n"
    "  dlcs solve circuit.json --format csv --output circuit.csv --server localhost:50051\n"
    "  generate | dlcs solve - --window whole --format json\n"
    "\n"
    "Ctrl-C cancels the solve and prints what is known; a second one ends at once.";

constexpr const char* kAnalyzeExamples =
    "Says what is known about the system before it is solved: the class of M with witnesses, constants,\n"
    "warnings, and the command that solves it. The options are those that you have settled already.\n"
    "\n"
    "Examples:\n"
    "  dlcs analyze circuit.json\n"
    "  dlcs analyze circuit.json --method time-stepping --step 1e-3 --format json";

constexpr const char* kLcpExamples =
    "Finds y with 0 <= y, w = q + M y >= 0, y complementary to w. The file holds one JSON object, as in\n"
    "    {\"M\": [[2, 1], [1, 2]], \"q\": [-5, -6]}\n"
    "and may hold a \"rule\" (auto, unique, least-element).\n"
    "\n"
    "Examples:\n"
    "  dlcs lcp lcp.json\n"
    "  dlcs lcp lcp.json --rule least-element --format json";

constexpr const char* kModelExamples =
    "Prints a problem file, and on standard error what is known of the model. `input-output` is the dynamic\n"
    "economy x' = A x + B y + f(t), 0 <= y, (I - C) y - x >= 0 complementary, x(0) = d, as in\n"
    "    {\"C\": [[0.2]], \"A\": [[-1]], \"B\": [[0.5]], \"d\": [1], \"T\": 5, \"f\": [\"1+sin(t)\"]}\n"
    "\n"
    "Examples:\n"
    "  dlcs model input-output economy.json --output problem.json\n"
    "  dlcs model input-output economy.json | dlcs solve -";

constexpr const char* kCapabilitiesExamples =
    "Examples:\n"
    "  dlcs capabilities\n"
    "  dlcs capabilities --server localhost:50051 --format json";

// What a number must be, in words and as a test.
struct Rule {
  const char* words;
  std::function<bool(double)> holds;
};

Rule Positive() {
  return {"a number above 0", [](double v) { return v > 0; }};
}
Rule Within(const char* words, double least, double most) {
  return {words, [least, most](double v) { return v >= least && v <= most; }};
}
Rule WholeAtLeast(const char* words, double least) {
  return {words, [least](double v) { return v >= least && v <= 9e15 && v == std::floor(v); }};
}

// Reads the whole of `text` as a finite number: the same digits as in a file, and nothing else.
std::optional<double> ParseNumber(const std::string& text) {
  double value = 0;
  const char* begin = text.c_str() + (text.size() > 1 && text[0] == '+' ? 1 : 0);
  const char* end = text.c_str() + text.size();
  const auto [rest, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || rest != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

double CheckedNumber(const std::string& text, const Rule& rule, const std::string& option) {
  const auto value = ParseNumber(text);
  if (!value || !rule.holds(*value)) {
    throw CLI::ValidationError(option, fmt::format("\"{}\" is not {}", text, rule.words));
  }
  return *value;
}

CLI::Option* AddNumber(CLI::App& app, const std::string& name, const char* metavariable, const Rule& rule,
                       const std::function<void(double)>& set, const std::string& help) {
  return app
      .add_option_function<std::string>(
          name, [=](const std::string& text) { set(CheckedNumber(text, rule, name)); }, help)
      ->type_name(metavariable);
}

// An option whose values are words; the nearest one is proposed for a word that is none of them.
template <typename Value>
CLI::Option* AddWord(CLI::App& app, const std::string& name, const std::vector<std::string>& words,
                     const std::function<std::optional<Value>(const std::string&)>& parse,
                     const std::function<void(Value)>& set, const std::string& help) {
  const auto read = [=](const std::string& text) {
    const auto value = parse(text);
    if (value) return set(*value);
    const auto nearest = NearestName(text, words);
    throw CLI::ValidationError(name, fmt::format("\"{}\" is none of {}{}", text, fmt::join(words, ", "),
                                                 nearest ? fmt::format("; did you mean {}?", *nearest) : ""));
  };
  return app.add_option_function<std::string>(name, read, help)
      ->type_name(fmt::format("{}", fmt::join(words, "|")));
}

void AddRule(CLI::App& app, std::optional<v1::SolutionRule>& rule) {
  AddWord<v1::SolutionRule>(
      app, "--rule", RuleNames(), ParseRule, [&rule](v1::SolutionRule value) { rule = value; },
      "Which solution of the LCP where there are several; overrides the file");
}

void AddFormat(CLI::App& app, const std::vector<std::string>& words, OutputFormat& format,
               const std::string& help) {
  const auto parse = [words](const std::string& text) -> std::optional<OutputFormat> {
    if (std::find(words.begin(), words.end(), text) == words.end()) return std::nullopt;
    if (text == "json") return OutputFormat::kJson;
    return text == "csv" ? OutputFormat::kCsv : OutputFormat::kTable;
  };
  AddWord<OutputFormat>(
      app, "--format", words, parse, [&format](OutputFormat value) { format = value; }, help);
}

void AddServer(CLI::App& app, std::string& server) {
  app.add_option("--server", server, "Run on the dlcsd at this address instead of in this process")
      ->type_name("HOST:PORT");
}

void AddDeadline(CLI::App& app, double& deadline_s) {
  AddNumber(
      app, "--deadline", "SECONDS", Positive(), [&deadline_s](double v) { deadline_s = v; },
      fmt::format("Give up after this time ({})", deadline_s));
}

// "0.1,0.5" in any order; what comes out is increasing and distinct.
std::vector<double> ParseTimes(const std::string& text, const std::string& option) {
  const Rule rule = Within("a time: a number of at least 0", 0, kInfinity);
  std::vector<double> times;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    std::string entry = text.substr(begin, end - begin);
    entry.erase(0, entry.find_first_not_of(' '));
    times.push_back(CheckedNumber(entry, rule, option));
    begin = end + 1;
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

// The times of `text`, which is a list of them or the name of a file that holds them, separated by commas,
// blanks or new lines.
std::vector<double> ParseGrid(const std::string& text) {
  if (text.find_first_not_of("0123456789.,+-eE ") == std::string::npos) return ParseTimes(text, "--grid");
  const auto content = ReadTextFile(text);
  if (!content.ok()) throw CLI::ValidationError("--grid", std::string(content.status().message()));
  std::string list;
  for (const char c : *content) {
    const bool between = c == ',' || std::isspace(static_cast<unsigned char>(c)) != 0;
    if (!between)
      list += c;
    else if (!list.empty() && list.back() != ',')
      list += ',';
  }
  if (!list.empty() && list.back() == ',') list.pop_back();
  return ParseTimes(list, "--grid " + text);
}

// "auto", "whole" or a number of steps, as the wire counts them.
std::int64_t ParseWindow(const std::string& text) {
  if (text == "auto") return 0;
  if (text == "whole") return -1;
  const Rule rule = WholeAtLeast("auto, whole or a whole number of at least 1", 1);
  return static_cast<std::int64_t>(CheckedNumber(text, rule, "--window"));
}

void AddGrid(CLI::App& app, v1::SolveOptions& options, std::string& grid) {
  CLI::Option* step = AddNumber(
      app, "--step", "H", Positive(), [&](double v) { options.set_step(v); }, "Length of a step, at most");
  CLI::Option* steps = AddNumber(
      app, "--steps", "J", WholeAtLeast("a whole number of at least 1", 1),
      [&](double v) { options.set_steps(static_cast<std::int64_t>(v)); }, "Steps over [0, T] (1000)");
  steps->excludes(step);
  app.add_option_function<std::string>(
         "--grid",
         [&](const std::string& text) {
           grid = text;
           const std::vector<double> times = ParseGrid(text);
           options.mutable_grid_times()->mutable_times()->Assign(times.begin(), times.end());
         },
         "The nodes themselves instead of equal steps, in any order, or a file with them; 0, T and break "
         "points "
         "are added")
      ->type_name("FILE|T1,T2,...")
      ->excludes(step)
      ->excludes(steps);
  app.add_option_function<std::string>(
         "--at",
         [&](const std::string& text) {
           const std::vector<double> times = ParseTimes(text, "--at");
           options.mutable_output_times()->Assign(times.begin(), times.end());
         },
         "Only these times, in any order; they become nodes of the grid. Otherwise a table shows 11 even "
         "times, "
         "JSON and CSV every node")
      ->type_name("T1,T2,...");
}

void AddMethod(CLI::App& app, v1::SolveOptions& options) {
  AddWord<v1::Method>(
      app, "--method", MethodNames(), ParseMethod, [&](v1::Method method) { options.set_method(method); },
      "auto chooses from the class of M and says why");
  AddNumber(
      app, "--theta", "THETA", Within("between 0 and 1", 0, 1), [&](double v) { options.set_theta(v); },
      "time-stepping: 0 implicit (default), 0.5 trapezoidal, 1 explicit in x");
  app.add_option_function<std::string>(
         "--window", [&](const std::string& text) { options.set_window_steps(ParseWindow(text)); },
         "laplace-iteration: steps of a window; auto adapts (default), whole takes the horizon at once")
      ->type_name("auto|whole|STEPS");
  AddNumber(
      app, "--iteration-tolerance", "TOL", Within("above 0 and at most 1", 1e-300, 1),
      [&](double v) { options.set_tolerance(v); },
      "Iterate until the change that is left is this small, relatively (1e-12)");
  AddNumber(
      app, "--max-iterations", "K", WholeAtLeast("a whole number of at least 1", 1),
      [&](double v) { options.set_max_iterations(static_cast<std::int64_t>(v)); },
      "Iterations per window, at most (60, or 1000 for windows that cannot shrink)");
}

void AddContour(CLI::App& app, v1::SolveOptions& options) {
  AddNumber(
      app, "--contour-nodes", "P", WholeAtLeast("a whole number of at least 1", 1),
      [&](double v) { options.mutable_contour()->set_nodes(static_cast<std::int32_t>(std::min(v, 2e9))); },
      "paper-iteration: 2P + 1 nodes on the contour (25)");
  AddNumber(
      app, "--contour-gamma", "GAMMA", Positive(), [&](double v) { options.mutable_contour()->set_gamma(v); },
      "paper-iteration: the contour's angle (0.794)");
  AddNumber(
      app, "--contour-mu", "MU", Positive(), [&](double v) { options.mutable_contour()->set_mu(v); },
      "paper-iteration: the contour's scale (sqrt(P)/4)");
  AddNumber(
      app, "--contour-step", "DV", Positive(), [&](double v) { options.mutable_contour()->set_step(v); },
      "paper-iteration: distance of the nodes (2.06/sqrt(P))");
  app.add_flag_function(
      "--contour-initial-state",
      [&](std::int64_t) { options.mutable_contour()->set_for_initial_state(true); },
      "paper-iteration: e^{At} x0 by a contour too (Remark 2.3)");
}

void AddJumps(CLI::App& app, v1::SolveOptions& options) {
  app.add_flag_function(
      "--project-initial-state", [&](std::int64_t) { options.set_project_initial_state(true); },
      "Let an inconsistent state jump instead of refusing it");
  app.add_flag_function(
      "--inelastic-impact", [&](std::int64_t) { options.set_inelastic_impact(true); },
      "Solve relative degree two (contact) as inelastic impact, a law of its own, instead of refusing it");
}

void AddSolve(CLI::App& main, SolveCommand& command) {
  CLI::App& app = *main.add_subcommand("solve", "Solve a differential linear complementarity system");
  v1::SolveOptions& options = command.options;
  app.add_option("PROBLEM", command.problem_path, "Problem file in JSON; - reads standard input")
      ->required()
      ->type_name("FILE");
  AddServer(app, command.server);
  AddMethod(app, options);
  AddGrid(app, options, command.grid);
  AddRule(app, command.rule);
  AddJumps(app, options);
  app.add_flag_function(
      "--estimate-error", [&](std::int64_t) { options.set_estimate_error(true); },
      "Solve with half the step too and compare");
  AddContour(app, options);
  AddNumber(
      app, "--threads", "N", WholeAtLeast("a whole number of at least 0", 0),
      [&](double v) { options.set_threads(static_cast<std::int32_t>(std::min(v, 2e9))); },
      "At most so many; the result does not depend on it (0: all)");
  AddDeadline(app, command.deadline_s);
  AddFormat(app, {"table", "json", "csv"}, command.format, "What to print (table)");
  app.add_option("--output", command.output,
                 "Write the result there, whole or not at all, instead of printing it")
      ->type_name("FILE");
  app.add_flag("--quiet", command.quiet, "Nothing on standard error but errors");
  app.footer(fmt::format("{}\n\n{}", kSolveExamples, kExitCodes));
}

void AddAnalyze(CLI::App& main, AnalyzeCommand& command) {
  CLI::App& app = *main.add_subcommand("analyze", "Say what is known about a system, and how to solve it");
  app.add_option("PROBLEM", command.problem_path, "Problem file in JSON; - reads standard input")
      ->required()
      ->type_name("FILE");
  AddServer(app, command.server);
  AddMethod(app, command.options);
  AddGrid(app, command.options, command.grid);
  AddJumps(app, command.options);
  AddRule(app, command.rule);
  AddDeadline(app, command.deadline_s);
  AddFormat(app, {"table", "json"}, command.format, "What to print (table)");
  app.add_option("--output", command.output,
                 "Write the analysis there, whole or not at all, instead of printing it")
      ->type_name("FILE");
  app.footer(fmt::format("{}\n\n{}", kAnalyzeExamples, kExitCodes));
}

void AddLcp(CLI::App& main, LcpCommand& command) {
  CLI::App& app = *main.add_subcommand("lcp", "Solve one linear complementarity problem");
  app.add_option("FILE", command.path, "JSON file with M and q; - reads standard input")
      ->required()
      ->type_name("FILE");
  AddServer(app, command.server);
  AddRule(app, command.rule);
  AddDeadline(app, command.deadline_s);
  AddFormat(app, {"table", "json"}, command.format, "What to print (table)");
  app.footer(fmt::format("{}\n\n{}", kLcpExamples, kExitCodes));
}

void AddModel(CLI::App& main, ModelCommand& command) {
  CLI::App& app = *main.add_subcommand("model", "Make a problem file of a model");
  app.add_option("KIND", "The kind of model")
      ->required()
      ->type_name("input-output")
      ->check(CLI::IsMember({"input-output"}));
  app.add_option("FILE", command.path, "JSON file of the model; - reads standard input")
      ->required()
      ->type_name("FILE");
  app.add_option("--output", command.output,
                 "Write the problem there, whole or not at all, instead of printing it")
      ->type_name("FILE");
  app.footer(fmt::format("{}\n\n{}", kModelExamples, kExitCodes));
}

void AddCapabilities(CLI::App& main, CapabilitiesCommand& command) {
  CLI::App& app =
      *main.add_subcommand("capabilities", "What this program or a server can do, and its limits");
  AddServer(app, command.server);
  AddDeadline(app, command.deadline_s);
  AddFormat(app, {"table", "json"}, command.format, "What to print (table)");
  app.footer(kCapabilitiesExamples);
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

// The options that `app` and its command know, for "did you mean".
std::vector<std::string> KnownNames(const CLI::App& app) {
  std::vector<std::string> names;
  const auto subcommands = app.get_subcommands();
  const CLI::App& current = subcommands.empty() ? app : *subcommands.front();
  for (const CLI::Option* option : current.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  if (subcommands.empty()) {
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
      names.push_back(command->get_name());
    }
  }
  return names;
}

// A word that is no option or command here, with the nearest one that is.
std::string NotKnown(const CLI::App& app, const std::string& word) {
  const std::string name = word.substr(0, word.find('='));
  const auto nearest = NearestName(name, KnownNames(app));
  return fmt::format("\"{}\" is not known here{}", name,
                     nearest ? fmt::format("; did you mean {}?", *nearest) : "");
}

// What is wrong with `arguments`: CLI11's words, but for names that do not exist.
std::string WhatIsWrong(const CLI::App& app, const CLI::ParseError& error,
                        const std::vector<std::string>& arguments) {
  const auto is_option = [](const std::string& word) { return word.size() > 1 && word[0] == '-'; };
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr) {
    const std::vector<std::string> extras = app.remaining(/*recurse=*/true);
    // The values of an unknown option are left over as well.
    const auto option = std::find_if(extras.begin(), extras.end(), is_option);
    if (option != extras.end()) return NotKnown(app, *option);
    if (!extras.empty()) return NotKnown(app, extras.front());
  }
  if (app.get_subcommands().empty()) {
    const auto word = std::find_if_not(arguments.begin(), arguments.end(), is_option);
    if (word != arguments.end()) return NotKnown(app, *word);
    return "say what to do: solve, analyze, lcp, model or capabilities";
  }
  return error.what();
}

ExitCode Complain(const CLI::App& app, const CLI::ParseError& error,
                  const std::vector<std::string>& arguments) {
  const auto commands = app.get_subcommands();
  fmt::print(stderr, "dlcs: {}\nFor all options run: dlcs {}--help\n", WhatIsWrong(app, error, arguments),
             commands.empty() ? "" : commands.front()->get_name() + " ");
  return kBadInput;
}

}  // namespace

ParsedCommandLine ParseCommandLine(int argc, const char* const* argv) {
  SolveCommand solve;
  AnalyzeCommand analyze;
  LcpCommand lcp;
  ModelCommand model;
  CapabilitiesCommand capabilities;
  CLI::App app("dlcs solves differential linear complementarity systems, in this process or on a server.",
               "dlcs");
  app.set_version_flag("--version", std::string("dlcs ") + DLCS_VERSION);
  app.require_subcommand(1);
  app.footer(fmt::format("{}\n\n{}", kMainExamples, kExitCodes));
  AddSolve(app, solve);
  AddAnalyze(app, analyze);
  AddLcp(app, lcp);
  AddModel(app, model);
  AddCapabilities(app, capabilities);

  const std::vector<std::string> arguments = WithNegativeNumbersTied(argc, argv);
  try {
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));  // backwards, as CLI11 wants
  } catch (const CLI::CallForHelp& help) {
    app.exit(help);
    return kSolved;
  } catch (const CLI::CallForVersion& version) {
    app.exit(version);
    return kSolved;
  } catch (const CLI::ParseError& error) {
    return Complain(app, error, arguments);
  }
  if (app.got_subcommand("solve")) return solve;
  if (app.got_subcommand("analyze")) return analyze;
  if (app.got_subcommand("lcp")) return lcp;
  if (app.got_subcommand("model")) return model;
  return capabilities;
}

}  // namespace dlcs::client
