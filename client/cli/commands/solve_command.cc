// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "client/cli/commands/array_output.h"
#include "client/cli/commands/command_support.h"
#include "client/cli/commands/commands.h"
#include "client/cli/commands/interrupt.h"
#include "client/cli/commands/problem_input.h"
#include "client/cli/commands/result_plot.h"
#include "client/cli/commands/solve_hooks.h"
#include "client/cli/options/solve_option_table.h"
#include "client/cli/output/atomic_file.h"
#include "client/cli/output/last_switchings.h"
#include "client/cli/output/message_json.h"
#include "client/cli/output/result_output.h"
#include "client/cli/output/result_page.h"
#include "client/cli/terminal/live_view.h"
#include "client/cli/terminal/progress_ticker.h"
#include "client/cli/terminal/terminal.h"
#include "client/result/names.h"
#include "client/rpc/retry.h"
#include "proto/shared/title_limit.h"
#include "proto/shared/truncate_text.h"

namespace dlcs::client {
namespace {

// Rows of the table if no times were requested.
constexpr int kTableIntervals = 10;
// Points of a curve in a picture if no times were requested: a multiple, so that the rows of the table are among them.
constexpr int kPictureIntervals = 100 * kTableIntervals;

// The node of the fixed steps in `options` that is nearest to `time`; `time` itself if there are none. Times that are
// not nodes would become nodes.
double NearestNode(const v1::SolveOptions& options, double horizon, double time) {
  const auto multiple = [&](double step) { return std::min(horizon, step * std::round(time / step)); };
  if (options.grid_case() == v1::SolveOptions::kSteps && options.steps() > 0) {
    return multiple(horizon / options.steps());
  }
  if (options.grid_case() == v1::SolveOptions::kStep && options.step() > 0) return multiple(options.step());
  if (options.grid_case() == v1::SolveOptions::kGridTimes && options.grid_times().times_size() > 0) {
    return *std::ranges::min_element(options.grid_times().times(), {},
                                     [time](double node) { return std::abs(node - time); });
  }
  return time;
}

// `intervals` + 1 even times in [0, T]; of few steps or the shortest horizons some are the same.
std::set<double> EvenTimes(const v1::SolveOptions& options, double horizon, int intervals) {
  std::set<double> times = {0, horizon};
  for (int k = 1; k < intervals; ++k) {
    // Rows of the table have the same bits among the points of a picture.
    const int per_row = intervals / kTableIntervals;
    const double even = k % per_row == 0 ? horizon * (k / per_row) / kTableIntervals : horizon * k / intervals;
    const double time = NearestNode(options, horizon, std::isfinite(even) ? even : horizon / intervals * k);
    constexpr double kSame = 1e-12;  // as 0 or T, which are there
    if (time > kSame * horizon && time < (1 - kSame) * horizon) times.insert(time);
  }
  return times;
}

// Whether the end time is unknown before the solve.
bool FindsPeriod(const v1::SolveOptions& options) { return options.period() < 0; }

// A table shows the solution at a few times, unless others were requested. Returns these times; empty: all.
std::set<double> TableTimes(const SolveCommand& command, double horizon) {
  const v1::SolveOptions& options = command.options;
  if (command.format != OutputFormat::kTable || !options.output_times().empty() || !(horizon > 0)) return {};
  if (FindsPeriod(options)) return {};
  return EvenTimes(options, horizon, kTableIntervals);
}

// `result` at `times` alone.
SolveResult Thinned(const SolveResult& result, const std::set<double>& times) {
  SolveResult thinned = result;
  for (std::vector<double>* values : {&thinned.times, &thinned.x, &thinned.y, &thinned.w, &thinned.outputs}) {
    values->clear();
  }
  const auto append = [](std::vector<double>& values, std::span<const double> more) {
    values.insert(values.end(), more.begin(), more.end());
  };
  for (std::size_t k = 0; k < result.times.size(); ++k) {
    if (times.count(result.times[k]) == 0) continue;
    thinned.times.push_back(result.times[k]);
    append(thinned.x, result.x_at(k));
    append(thinned.y, result.y_at(k));
    append(thinned.w, result.w_at(k));
    append(thinned.outputs, result.outputs_at(k));
  }
  thinned.left_limits.clear();  // a table has none
  return thinned;
}

bool HasStep(const v1::SolveOptions& options) { return options.grid_case() != v1::SolveOptions::GRID_NOT_SET; }

// `is_held`: CSV was not written as it arrived.
absl::Status Print(const SolveCommand& command, const SolveHooks& hooks, const std::string& name,
                   const SolveResult& result, bool is_held, AtomicFile* file) {
  std::FILE* const out = file ? file->stream() : stdout;
  switch (command.format) {
    case OutputFormat::kTable:
      PrintPage(name, result, out);
      break;
    case OutputFormat::kJson:
      PrintJson(name, result, out);
      break;
    case OutputFormat::kCsv:
      if (is_held) {
        PrintCsv(result, out);
      } else if (result.times.empty() && result.summary.times() == 0) {
        PrintCsvHeader(result.names, result.states, result.constraints, /*has_w=*/true, out);
      }
      break;  // was written as it arrived
    case OutputFormat::kName:
      break;  // of jobs alone
    case OutputFormat::kNpy:
    case OutputFormat::kNpz:
    case OutputFormat::kHdf5:
    case OutputFormat::kMat:
    case OutputFormat::kRaw:
      if (hooks.write_arrays) {
        if (const auto written = hooks.write_arrays(name, result, file ? file->written_path() : "")) return *written;
      }
      return WriteArrays(command.format, name, result, out);
  }
  return absl::OkStatus();
}

// For an iteration that does not converge.
const char* AdviceOnIteration(const SolveCommand& command, const v1::Summary& summary, bool is_nonlinear) {
  const bool given_window = summary.method() == v1::METHOD_LAPLACE_ITERATION && command.options.window_steps() != 0;
  if (is_nonlinear) return given_window ? "--window auto shrinks windows until they converge" : nullptr;
  if (given_window) {
    return "--window auto shrinks windows until they converge, --method exponential-integrator does not iterate";
  }
  return "--method exponential-integrator does not iterate";
}

// An option that may help. It is printed after the message of the engine, which does not know the options.
const char* Advice(const SolveCommand& command, const v1::Summary& summary, bool is_nonlinear) {
  const bool iterates =
      summary.method() == v1::METHOD_LAPLACE_ITERATION || summary.method() == v1::METHOD_WU_CHEN_ITERATION;
  // The iterations converged, and what is missing are steps.
  const bool too_few_steps = summary.accuracy().source() == v1::ACCURACY_SOURCE_CONTROLLED;
  switch (summary.termination()) {
    case v1::TERMINATION_INCONSISTENT_STATE:
      return "--project-initial-state lets the state jump";
    case v1::TERMINATION_DIVERGED:
    case v1::TERMINATION_ITERATION_LIMIT:
      return iterates && !too_few_steps ? AdviceOnIteration(command, summary, is_nonlinear) : nullptr;
    case v1::TERMINATION_DEADLINE:
      return "--deadline allows more time, --steps fewer steps";
    default:
      return nullptr;
  }
}

void PrintVerdict(const SolveCommand& command, const SolveResult& result, bool is_nonlinear) {
  const v1::Summary& summary = result.summary;
  const bool table_says_it = command.format == OutputFormat::kTable && IsStandardOutput(command.output);
  if (!table_says_it && !command.quiet) {
    for (const std::string& concern : summary.verdict().concerns()) fmt::print(stderr, "dlcs: {}\n", concern);
    for (const v1::MeasurementResult& one : summary.measurements()) {
      if (one.has_value()) {
        const std::string note = one.note().empty() ? "" : fmt::format(" ({})", one.note());
        fmt::print(stderr, "dlcs: {} = {}{}\n", one.name(), one.value(), note);
      } else {
        fmt::print(stderr, "dlcs: {}: none: {}\n", one.name(), one.reason());
      }
    }
  }
  if (Succeeded(summary)) return;
  if (!table_says_it) fmt::print(stderr, "dlcs: {}: {}\n", VerdictText(summary), summary.message());
  if (const std::string about = AboutLastSwitchings(summary, result.names); !about.empty()) {
    fmt::print(stderr, "dlcs: {}\n", about);
  }
  if (const char* advice = Advice(command, summary, is_nonlinear)) fmt::print(stderr, "dlcs: {}\n", advice);
}

// Prints to the file if there is one, to standard output otherwise.
absl::Status Deliver(const SolveCommand& command, const SolveHooks& hooks, const std::string& name,
                     const SolveResult& result, bool is_held, AtomicFile* file) {
  if (file == nullptr) {
    const absl::Status printed = Print(command, hooks, name, result, is_held, nullptr);
    return printed.ok() ? FlushStream(stdout, "standard output") : printed;
  }
  if (absl::Status printed = Print(command, hooks, name, result, is_held, file); !printed.ok()) {
    return WithFile(printed, file->path());
  }
  const bool whole = !IsStopped(result.summary.termination());
  const absl::Status committed = whole ? file->Commit() : file->CommitPartial();
  if (!committed.ok()) return committed;
  if (!whole) {
    fmt::print(stderr, "dlcs: wrote the incomplete trajectory to {}; {} is unchanged\n", file->path(), command.output);
  } else if (!command.quiet) {
    fmt::print(stderr, "dlcs: wrote {}\n", file->path());
  }
  return committed;
}

std::size_t ColumnsOf(const google::protobuf::RepeatedField<double>& values, const v1::TrajectoryChunk& chunk) {
  return static_cast<std::size_t>(values.size() / std::max(1, chunk.times_size()));
}

// Writes CSV to `out` as it arrives, so that it may be larger than memory; not where a second solve may replace it.
absl::StatusOr<SolveResult> Watch(const SolveCommand& command, const ProblemInput& input,
                                  const v1::SolveRequest& request, Backend& backend, std::FILE* out,
                                  const CallLimits& limits) {
  const bool as_it_comes = command.format == OutputFormat::kCsv && !input.HasLimits();
  const bool has_panel = !command.quiet && CanRedraw(stderr) && !(as_it_comes && CanRedraw(out));  // rows would hit it
  LiveView view(stderr, {.terminal = has_panel,
                         .color = UsesColor(stderr),
                         .utf8 = UsesUtf8(),
                         .verbose = command.verbose,
                         .width = WidthOf(stderr),
                         .horizon = command.options.period() > 0 ? command.options.period() : input.horizon(),
                         .warnings = command.format != OutputFormat::kTable || !IsStandardOutput(command.output),
                         .nonlinear = input.is_nonlinear(),
                         .default_error = !HasStep(command.options) && request.options().error_tolerance() == 0,
                         .estimates = !command.options.has_estimate_error() || command.options.estimate_error()});
  DisplayNames names;
  const EventCallback show = [&](const v1::SolveEvent& event) {
    if (!command.quiet) view.OnEvent(event);
    if (event.has_analysis()) names = NamesIn(event.analysis());
    if (!as_it_comes || !event.has_trajectory()) return;
    const v1::TrajectoryChunk& chunk = event.trajectory();
    if (chunk.first() == 0) {
      PrintCsvHeader(names, ColumnsOf(chunk.x(), chunk), ColumnsOf(chunk.y(), chunk), !chunk.w().empty(), out);
    }
    PrintCsvLines(chunk, out);
  };
  return backend.Solve(
      request, show,
      {.deadline = limits.deadline, .stop = limits.stop, .keep_trajectory = !as_it_comes || !command.plot.empty()});
}

// Solves again with higher limits, after a switch of a deck reached the largest current of its model: inductors, and
// capacitors that currents have charged, may drive more current through it than the sources can.
absl::StatusOr<SolveResult> SolveWithHigherLimits(const SolveCommand& command, v1::SolveRequest request,
                                                  ProblemInput& input, Backend& backend, std::FILE* out, double factor,
                                                  const CallLimits& limits) {
  if (!command.quiet) {
    PrintNotice(fmt::format(
        "a switch reaches the largest current of its model: solved once more, with {:g} times that current", factor));
  }
  if (absl::Status raised = input.RaiseLimits(factor); !raised.ok()) return raised;
  *request.mutable_problem() = input.SolveRequest({}).problem();
  if (!request.request_id().empty()) request.set_request_id(NewRequestId());
  return Watch(command, input, request, backend, out, limits);
}

}  // namespace

ExitCode Run(const SolveCommand& command) { return Run(command, SolveHooks()); }

ExitCode Run(const SolveCommand& command, SolveHooks hooks) {
  auto reading = !command.quiet && command.problem_path != "-"
                     ? std::make_unique<WaitView>("reads " + command.problem_path)
                     : nullptr;
  absl::StatusOr<ProblemInput> input =
      ProblemInput::Read(command.problem_path, command.server, command.rule, hooks.matrix_files);
  reading.reset();
  if (!input.ok()) return PrintError(input.status(), kBadInput);
  if (!command.quiet) input->PrintNotes();
  if (!command.plot.empty()) {
    if (const absl::Status name = CheckPictureName("--plot", command.plot); !name.ok()) {
      return PrintError(name, kBadInput);
    }
    // Not only after the solve, which may take long.
    if (const absl::Status found = FindGnuplot(); !found.ok()) return PrintError(found, kServiceFailed);
  }
  const auto output = OpenOutput(command.output, {command.problem_path});
  if (!output.ok()) return PrintError(output.status(), kBadInput);
  // After reading, which Ctrl-C ends as always.
  const Interrupt interrupt;
  if (absl::Status made = MakeIfAbsent(command.server, command.quiet, hooks.backend); !made.ok()) {
    return PrintError(made, kBadInput);
  }

  const CallLimits limits{.deadline = std::chrono::duration<double>(command.deadline_s), .stop = interrupt.token()};
  const absl::Status fetched = input->FetchUploaded(limits);
  if (!fetched.ok()) return PrintError(fetched, ExitCodeOf(fetched));
  v1::SolveRequest request = input->SolveRequest(command.options);
  const double horizon = command.options.period() > 0 ? command.options.period() : input->horizon();
  if (!command.quiet && horizon > 0 && command.options.step() > horizon) {
    fmt::print(stderr, "dlcs: --step {} is longer than T = {} and shortens no step; give a shorter one\n",
               command.options.step(), horizon);
  }
  const std::set<double> table_times = TableTimes(command, horizon);
  const bool curves = !command.plot.empty() && !table_times.empty();
  for (const double time : curves ? EvenTimes(command.options, horizon, kPictureIntervals) : table_times) {
    request.mutable_options()->add_output_times(time);
  }
  // The times of a period that is to be found are not known: its rows are those of so many steps.
  if (FindsPeriod(command.options) && command.format == OutputFormat::kTable && !HasStep(command.options)) {
    request.mutable_options()->set_steps(command.plot.empty() ? kTableIntervals : kPictureIntervals);
  }
  // So that a lost connection does not end the solve, if the server has jobs.
  if (!command.server.address.empty()) {
    request.set_request_id(NewRequestId());
    if (!input->is_uploaded()) request.set_title(TruncateUtf8(input->title(), kMaxTitleBytes));
  }

  std::FILE* const stream = *output ? (*output)->stream() : stdout;
  const auto begin = std::chrono::steady_clock::now();
  auto result = Watch(command, *input, request, *hooks.backend, stream, limits);
  for (double factor = 100; factor <= 1e6 && result.ok() && input->ReachedLimit(result->summary); factor *= 100) {
    const CallLimits left{.deadline = limits.deadline - (std::chrono::steady_clock::now() - begin),
                          .stop = limits.stop};
    result = SolveWithHigherLimits(command, request, *input, *hooks.backend, stream, factor, left);
  }
  if (!result.ok()) return PrintCallError(result.status(), input->source());
  input->AddConcerns(result->summary);

  const SolveResult thinned = curves ? Thinned(*result, table_times) : SolveResult();
  const SolveResult& shown = curves ? thinned : *result;
  const absl::Status delivered = Deliver(command, hooks, input->title(), shown, input->HasLimits(), output->get());
  if (!delivered.ok()) return PrintError(delivered, kServiceFailed);
  if (!command.quiet) {
    const v1::Method used = result->summary.method();
    for (const std::string& line : OptionsWithoutEffect(command.options, used, input->is_nonlinear()))
      PrintNotice(line);
  }
  PrintVerdict(command, *result, input->is_nonlinear());
  if (!command.plot.empty()) {
    const absl::Status drawn = DrawResult(input->title(), *result, command.plot);
    if (!drawn.ok()) return PrintError(drawn, absl::IsInvalidArgument(drawn) ? kBadInput : kServiceFailed);
    if (!command.quiet) fmt::print(stderr, "dlcs: wrote {}\n", command.plot);
  }
  if (!result->job.empty()) {
    fmt::print(stderr, "dlcs: {0} keeps the part solved so far: dlcs result {0}\n", result->job);
  }
  return ExitCodeOf(result->summary);
}

}  // namespace dlcs::client
