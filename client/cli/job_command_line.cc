// SPDX-License-Identifier: Apache-2.0
#include "client/cli/job_command_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "client/cli/help_text.h"
#include "client/cli/job_support.h"
#include "client/cli/option_kinds.h"
#include "client/cli/server_options.h"
#include "client/cli/solve_options.h"
#include "client/names.h"

namespace dlcs::client {
namespace {

constexpr const char* kJobExamples =
    "Examples:\n"
    "  dlcsd --store jobs.db &                       a server that takes jobs\n"
    "  job=$(dlcs submit circuit.json --steps 1e6)   prints jobs/..., nothing else\n"
    "  dlcs watch $job                               until it has ended; exits as solve would\n"
    "  dlcs get $job                                 state and progress\n"
    "  dlcs result $job --format csv --output circuit.csv\n"
    "  dlcs list --state queued,running\n"
    "  dlcs cancel $job\n"
    "  problem=$(dlcs upload membrane.json)          once; then submit, solve, analyze and ensemble take $problem";

void AddTarget(CLI::App& app, JobTarget& target) {
  AddServer(app, target.server, fmt::format("The dlcsd at this address ({})", target.server.address));
  AddNumber(
      app, "--patience", "SECONDS", Positive(), [&target](double v) { target.patience_s = v; },
      fmt::format("Go on for so long through cuts and restarts ({})", target.patience_s));
  app.footer(fmt::format("{}\n\n{}", kJobExamples, kExitCodes));
}

void AddName(CLI::App& app, std::string& name) {
  app.add_option("JOB", name, "Its name, as submit prints it")->required()->type_name("jobs/ID");
}

void AddNameOfEither(CLI::App& app, std::string& name) {
  const auto not_empty = [](const std::string& word) { return std::string(word.empty() ? "must not be empty" : ""); };
  app.add_option("NAME", name, "As submit or upload prints it")
      ->required()
      ->type_name("jobs/ID|problems/ID")
      ->check(CLI::Validator(not_empty, ""));
}

void AddSubmit(CLI::App& main, SubmitCommand& command) {
  CLI::App& app = *main.add_subcommand("submit", "Leave a system to a server to solve, as a job");
  SolveCommand& solve = command.solve;
  AddProblem(app, solve.problem_path);
  AddTarget(app, command.target);
  AddHowToSolve(app, solve.options, solve.grid, solve.rule);
  app.add_option("--request-id", command.request_id, "The same for every attempt to submit this job (random)")
      ->type_name("TEXT");
  AddNumber(
      app, "--priority", "N", Within("a whole number between -100 and 100", -100, 100),
      [&command](double v) { command.priority = static_cast<std::int32_t>(v); }, "Among your jobs, higher first (0)");
  AddNumber(
      app, "--within", "SECONDS", Positive(), [&command](double v) { command.within_s = v; },
      "Of no use later: refuse it if that cannot be, stop it then");
  app.add_flag("--check", command.validate_only, "Say what would be said, but take nothing");
}

void AddWatch(CLI::App& main, WatchCommand& command) {
  CLI::App& app = *main.add_subcommand("watch", "Follow a job to its end");
  AddName(app, command.name);
  AddTarget(app, command.target);
  AddNumber(
      app, "--after", "N", WholeAtLeast("a whole number of at least 0", 0),
      [&command](double v) { command.after = static_cast<std::int64_t>(v); }, "Events above this number only (0)");
  AddNumber(
      app, "--interval", "SECONDS", Positive(), [&command](double v) { command.interval_s = v; },
      "Iterates no closer together than this");
  AddFormat(app, {"table", "json"}, command.format, "What to print (table)");
  CLI::Option& quiet = *app.add_flag("--quiet", command.quiet, "Nothing but the verdict, and that on standard error");
  CLI::Option& values = *AddWord<v1::WatchView>(
      app, "--values", {"sampled", "full"},
      [](const std::string& word) -> std::optional<v1::WatchView> {
        if (word == "sampled") return v1::WATCH_VIEW_SAMPLED;
        if (word == "full") return v1::WATCH_VIEW_FULL;
        return std::nullopt;
      },
      [&command](v1::WatchView view) { command.values = view; },
      "In JSON: y of each iterate too, at up to 65 times of its window, or at all (none)");
  values.excludes(&quiet);
  app.add_option("--components", command.components, "Those of y only, from 0: 0,2 (all)")
      ->delimiter(',')
      ->allow_extra_args(false)  // the job may stand behind it
      ->type_name("N,...")
      ->needs(&values);
}

void AddResult(CLI::App& main, ResultCommand& command) {
  CLI::App& app = *main.add_subcommand("result", "Print the trajectory of a job that has ended");
  AddName(app, command.name);
  AddTarget(app, command.target);
  AddNumber(
      app, "--stride", "N", WholeAtLeast("a whole number of at least 1", 1),
      [&command](double v) { command.stride = static_cast<std::int64_t>(v); }, "Every so many times (1)");
  AddNumber(
      app, "--from", "T", {"a number", [](double) { return true; }}, [&command](double v) { command.from = v; },
      "From this time on (0)");
  AddNumber(
      app, "--to", "T", {"a number", [](double) { return true; }}, [&command](double v) { command.to = v; },
      "Up to this time (the end)");
  AddFormat(app, {"table", "json", "csv"}, command.format, "What to print (table)");
  app.add_option("--output", command.output, "Write it there, whole or not at all, instead of printing it")
      ->type_name("FILE");
}

void AddProblems(CLI::App& main, JobCommands& commands) {
  CLI::App& upload = *main.add_subcommand("upload", "Send a problem to a server once, to be solved many times");
  AddProblem(upload, commands.upload.problem_path);
  AddTarget(upload, commands.upload.target);
  AddRule(upload, commands.upload.rule);
  CLI::App& problems = *main.add_subcommand("problems", "The problems that were uploaded, newest first");
  AddTarget(problems, commands.problems.target);
  AddFormat(problems, {"table", "json"}, commands.problems.format, "What to print (table)");
}

}  // namespace

void AddJobCommands(CLI::App& main, JobCommands& commands) {
  AddSubmit(main, commands.submit);
  AddWatch(main, commands.watch);

  CLI::App& get = *main.add_subcommand("get", "State and progress of a job, or what is known of a problem");
  AddNameOfEither(get, commands.get.name);
  AddTarget(get, commands.get.target);
  AddFormat(get, {"table", "json"}, commands.get.format, "What to print (table)");

  CLI::App& list = *main.add_subcommand("list", "The jobs of a server, newest first");
  AddTarget(list, commands.list.target);
  AddWord<std::vector<v1::JobState>>(
      list, "--state", JobStateWords(), ParseJobStates,
      [&commands](const std::vector<v1::JobState>& states) { commands.list.states = states; },
      "Those in this state only, or in one of several: queued,running");
  AddNumber(
      list, "--most", "N", WholeAtLeast("a whole number of at least 1", 1),
      [&commands](double v) { commands.list.most = static_cast<std::int64_t>(std::min(v, 1e6)); },
      "At most so many (100)");
  AddFormat(list, {"table", "json"}, commands.list.format, "What to print (table)");

  CLI::App& cancel = *main.add_subcommand("cancel", "Stop a job; what it has found can still be read");
  AddName(cancel, commands.cancel.name);
  AddTarget(cancel, commands.cancel.target);

  commands.remove.forget = true;
  CLI::App& remove = *main.add_subcommand("delete", "Forget a job that has ended with its trajectory, or a problem");
  AddNameOfEither(remove, commands.remove.name);
  AddTarget(remove, commands.remove.target);

  AddResult(main, commands.result);
  AddProblems(main, commands);
}

}  // namespace dlcs::client
