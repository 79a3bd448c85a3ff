// SPDX-License-Identifier: Apache-2.0
#include "client/cli/job_command_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "client/cli/help_text.h"
#include "client/cli/jobs/job_support.h"
#include "client/cli/options/option_kinds.h"
#include "client/cli/server_options.h"
#include "client/cli/solve_options.h"
#include "client/result/names.h"

namespace dlcs::client {
namespace {

constexpr const char* kJobNames =
    "A job: the name that submit printed, or the first characters of its id, if no other job begins with them.";

constexpr const char* kSubmitExamples =
    "Prints the name of the job, jobs/..., and nothing else. The job survives this terminal, lost connections and "
    "restarts of the "
    "server.\n"
    "\n"
    "Examples:\n"
    "  dlcsd --store jobs.db &                           a server with jobs\n"
    "  job=$(dlcs submit circuit.json --tolerance 1e-8)\n"
    "  dlcs submit circuit.json --title 'diode, warm' --wait\n"
    "  dlcs submit circuit.json --check                  would it be accepted, and what would it need?";

constexpr const char* kWatchExamples =
    "Exits with the code of solve. Ctrl-C and SIGTERM end the watch; the job continues.\n"
    "Of an ensemble it prints how many members have ended.\n"
    "\n"
    "Examples:\n"
    "  dlcs watch $job\n"
    "  dlcs watch $job --format json          one event per line, for programs\n"
    "  dlcs watch $job --quiet && plot.sh     only the exit code";

constexpr const char* kGetExamples =
    "Examples:\n"
    "  dlcs get k3f                          the job whose id begins with k3f\n"
    "  dlcs get $job -o json\n"
    "  dlcs get problems/41cb                an uploaded problem";

constexpr const char* kListExamples =
    "Examples:\n"
    "  dlcs list\n"
    "  dlcs list --state queued,running\n"
    "  dlcs list -o name | xargs -n 1 dlcs cancel";

constexpr const char* kCancelExamples =
    "Examples:\n"
    "  dlcs cancel k3f\n"
    "  dlcs result k3f                       the part solved before the cancellation";

constexpr const char* kDeleteExamples =
    "Only a job that has ended can be deleted: cancel it first.\n"
    "\n"
    "Examples:\n"
    "  dlcs delete k3f\n"
    "  dlcs delete --all                     every job that has ended\n"
    "  dlcs delete --all --state failed,cancelled";

constexpr const char* kResultExamples =
    "Of an ensemble it prints the end of each member: as a table what all have in common, else a line or a row for "
    "each.\n"
    "It waits for members that have not ended; Ctrl-C and SIGTERM end the wait, and the job continues.\n"
    "\n"
    "Examples:\n"
    "  dlcs result $job                      a table\n"
    "  dlcs result $job --at 1,2.5           the stored times nearest to these\n"
    "  dlcs result $job --output circuit.csv   the ending chooses among .csv .json .npy .npz .h5 .mat\n"
    "  dlcs result $job --from 3 --to 4 --stride 10 --format json";

constexpr const char* kUploadExamples =
    "Prints the name of the problem, problems/..., which solve, submit, analyze and ensemble take instead of a file.\n"
    "\n"
    "Examples:\n"
    "  problem=$(dlcs upload membrane.json)\n"
    "  dlcs submit $problem --tolerance 1e-6";

constexpr const char* kProblemsExamples =
    "Examples:\n"
    "  dlcs problems\n"
    "  dlcs problems -o name";

void AddTarget(CLI::App& app, JobTarget& target, const std::string& footer) {
  AddServer(app, target.server, fmt::format("The dlcsd at this address ({})", target.server.address));
  AddNumber(
      app, "--patience", "SECONDS", {.words = "a number of at least 0", .least = 0, .of_clock = true},
      [&target](double v) {
        using Repeat = ConnectionOptions::Repeat;
        target.repeat = v > 0 ? Repeat::kAlways : Repeat::kNever;
        if (v > 0) target.patience_s = v;
      },
      fmt::format("Retry for this long when the connection is lost ({}). If given, also wait this long for a first "
                  "answer; 0: do not retry",
                  target.patience_s));
  app.footer(fmt::format("{}\n\n{}", footer, kExitCodes));
}

void AddName(CLI::App& app, std::string& name) { app.add_option("JOB", name, kJobNames)->required()->type_name("JOB"); }

void AddNameOfEither(CLI::App& app, std::string& name) {
  app.add_option("NAME", name,
                 std::string(kJobNames) + " Or an uploaded problem: problems/ and the first characters of its id")
      ->type_name("JOB|problems/ID");
}

CLI::Option& AddStates(CLI::App& app, std::vector<v1::JobState>& states) {
  return *AddWord<std::vector<v1::JobState>>(
      app, "--state", JobStateWords(), ParseJobStates,
      [&states](const std::vector<v1::JobState>& parsed) { states = parsed; },
      "Only jobs in this state, or in one of several: queued,running");
}

void AddSubmit(CLI::App& main, SubmitCommand& command) {
  CLI::App& app = *main.add_subcommand("submit", "Submit a system to a server as a job");
  SolveCommand& solve = command.solve;
  AddProblem(app, solve.problem_path);
  AddTarget(app, command.target, kSubmitExamples);
  AddHowToSolve(app, solve.options, solve.grid, solve.rule);
  app.add_option("--title", command.title, "Title of the job in lists, at most 256 bytes (the problem's name)")
      ->type_name("TEXT");
  app.add_flag("--wait", command.wait, "Then watch it to its end, and exit with the code of solve");
  app.add_option("--request-id", command.request_id,
                 "Identifies this job: submitting again with the same text gives the same job (random)")
      ->type_name("TEXT");
  AddNumber(
      app, "--priority", "N", Whole("a whole number between -100 and 100", -100, 100),
      [&command](double v) { command.priority = static_cast<std::int32_t>(v); },
      "Order among your own jobs, higher first (0)");
  AddNumber(
      app, "--within", "SECONDS", Seconds(), [&command](double v) { command.within_s = v; },
      "Deadline, from now: the job is refused if it cannot meet it, and stopped then");
  app.add_flag("--check", command.validate_only, "Validate the request and predict its cost; create no job");
  AddQuiet(app, command.quiet, "With --wait: show no progress");
}

void AddWatch(CLI::App& main, WatchCommand& command) {
  CLI::App& app = *main.add_subcommand("watch", "Follow a job to its end");
  AddName(app, command.name);
  AddTarget(app, command.target, kWatchExamples);
  AddNumber(
      app, "--after", "N", Whole("a whole number of at least 0", 0),
      [&command](double v) { command.after = static_cast<std::int64_t>(v); }, "Only events above this number (0)");
  AddNumber(
      app, "--interval", "SECONDS", Seconds(), [&command](double v) { command.interval_s = v; },
      "Minimum time between two iterates");
  AddFormat(app, {"table", "json"}, command.format, "What to print (table)");
  CLI::Option& quiet = *app.add_flag("-q,--quiet", command.quiet, "Print only the verdict, on standard error");
  CLI::Option& values = *AddWord<v1::WatchView>(
      app, "--values", {"sampled", "full"},
      [](const std::string& word) -> std::optional<v1::WatchView> {
        if (word == "sampled") return v1::WATCH_VIEW_SAMPLED;
        if (word == "full") return v1::WATCH_VIEW_FULL;
        return std::nullopt;
      },
      [&command](v1::WatchView view) { command.values = view; },
      "In JSON, include y of each iterate: at up to 65 times of its window, or at all (none)");
  values.excludes(&quiet);
  app.add_option("--components", command.components, "Only these components of y, from 0: 0,2 (all)")
      ->delimiter(',')
      ->allow_extra_args(false)  // JOB may follow
      ->type_name("N,...")
      ->needs(&values);
}

void AddResult(CLI::App& main, ResultCommand& command) {
  CLI::App& app =
      *main.add_subcommand("result", "Print the trajectory of a job that has ended, or the members of an ensemble");
  AddName(app, command.name);
  AddTarget(app, command.target, kResultExamples);
  app.add_option_function<std::string>(
         "--at", [&command](const std::string& text) { command.at = ParseTimes(text, "--at"); },
         "The stored times nearest to these, in any order; use submit --at to store exact times")
      ->type_name("T1,T2,...");
  AddNumber(
      app, "--stride", "N", Whole("a whole number of at least 1", 1),
      [&command](double v) { command.stride = static_cast<std::int64_t>(v); }, "Only every N-th time (1)");
  AddNumber(
      app, "--from", "T", {"a number", std::numeric_limits<double>::lowest()},
      [&command](double v) { command.from = v; }, "From this time on (0)");
  AddNumber(
      app, "--to", "T", {"a number", std::numeric_limits<double>::lowest()}, [&command](double v) { command.to = v; },
      "Up to this time (the end)");
  AddFormatAndOutput(app, kTrajectoryFormats, command.format, kTrajectoryHelp, command.output, "it");
}

void AddProblems(CLI::App& main, JobCommands& commands) {
  CLI::App& upload = *main.add_subcommand("upload", "Upload a problem to a server, to be solved many times");
  AddProblem(upload, commands.upload.problem_path);
  AddTarget(upload, commands.upload.target, kUploadExamples);
  AddRule(upload, commands.upload.rule);
  CLI::App& problems = *main.add_subcommand("problems", "List the uploaded problems, newest first");
  AddTarget(problems, commands.problems.target, kProblemsExamples);
  AddFormat(problems, {"table", "json", "name"}, commands.problems.format, "What to print (table)");
}

}  // namespace

void AddJobCommands(CLI::App& main, JobCommands& commands) {
  AddSubmit(main, commands.submit);
  AddWatch(main, commands.watch);

  CLI::App& get = *main.add_subcommand("get", "Print the state of a job, or of an uploaded problem");
  AddNameOfEither(get, commands.get.name);
  get.get_option("NAME")->required();
  AddTarget(get, commands.get.target, kGetExamples);
  AddFormat(get, {"table", "json", "name"}, commands.get.format, "What to print (table)");

  CLI::App& list = *main.add_subcommand("list", "List the jobs of a server, newest first");
  AddTarget(list, commands.list.target, kListExamples);
  AddStates(list, commands.list.states);
  AddNumber(
      list, "--most", "N", Whole("a whole number of at least 1", 1),
      [&commands](double v) { commands.list.most = static_cast<std::int64_t>(std::min(v, 1e6)); },
      "List at most this many (100)");
  AddFormat(list, {"table", "json", "name"}, commands.list.format, "What to print (table)");

  CLI::App& cancel = *main.add_subcommand("cancel", "Cancel a job; the part solved so far can still be read");
  AddName(cancel, commands.cancel.name);
  AddTarget(cancel, commands.cancel.target, kCancelExamples);

  commands.remove.deletes = true;
  CLI::App& remove =
      *main.add_subcommand("delete", "Delete a job that has ended, with its trajectory, or an uploaded problem");
  AddNameOfEither(remove, commands.remove.name);
  CLI::Option& all = *remove.add_flag("--all", commands.remove.all, "Delete all jobs that have ended");
  AddStates(remove, commands.remove.states).needs(&all);
  CLI::Option& one = *remove.get_option("NAME")->excludes(&all);
  remove.callback([&all, &one] {
    if (all.count() + one.count() == 0) throw CLI::ValidationError("NAME", "is required, or --all");
  });
  AddTarget(remove, commands.remove.target, kDeleteExamples);

  AddResult(main, commands.result);
  AddProblems(main, commands);
}

}  // namespace dlcs::client
