// SPDX-License-Identifier: Apache-2.0
#include "client/cli/solve_options.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/option_kinds.h"
#include "client/names.h"

namespace dlcs::client {
namespace {

// "auto", "whole" or a number of steps, as the wire counts them.
std::int64_t ParseWindow(const std::string& text) {
  if (text == "auto") return 0;
  if (text == "whole") return -1;
  const NumberRule rule = WholeAtLeast("auto, whole or a whole number of at least 1", 1);
  return static_cast<std::int64_t>(CheckedNumber(text, rule, "--window"));
}

// What serves here as `method` does in other programs.
std::optional<std::string> MethodLike(const std::string& method) {
  static const std::map<std::string, std::vector<std::string>> kElsewhere = {
      {"event-located",
       {"rk45", "rk23", "dop853", "dopri5", "radau", "bdf", "lsoda", "cvode", "ode45", "ode23", "ode15s", "rk4",
        "event"}},
      {"time-stepping",
       {"euler", "implicit-euler", "backward-euler", "theta", "trapezoidal", "crank-nicolson", "moreau",
        "moreau-jean"}},
      {"exponential-march", {"expm", "etd", "etd2", "exponential-euler", "exponential-integrator"}}};
  std::string lower = method;
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char c) { return c == '_' ? '-' : static_cast<char>(std::tolower(c)); });
  for (const auto& [here, elsewhere] : kElsewhere) {
    if (std::ranges::find(elsewhere, lower) != elsewhere.end()) return here;
  }
  return std::nullopt;
}

}  // namespace

void AddGrid(CLI::App& app, v1::SolveOptions& options, std::string& grid) {
  CLI::Option* step = AddNumber(
      app, "--step", "H", Positive(), [&](double v) { options.set_step(v); }, "Length of a step, at most");
  CLI::Option* steps = AddNumber(
      app, "--steps", "J", Whole("a whole number from 1 to 1000000000; leave it out for the default", 1, 1e9),
      [&](double v) { options.set_steps(static_cast<std::int64_t>(v)); }, "Steps over [0, T]");
  steps->excludes(step);
  app.add_option_function<std::string>(
         "--grid",
         [&](const std::string& text) {
           grid = text;
           const std::vector<double> times = ParseTimesOrFile(text, "--grid");
           options.mutable_grid_times()->mutable_times()->Assign(times.begin(), times.end());
         },
         "The nodes themselves instead of equal steps, in any order, or a file with them; 0, T and break "
         "points "
         "are added")
      ->type_name("FILE|T1,T2,...")
      ->excludes(step)
      ->excludes(steps);
  AddNumber(
      app, "--tolerance", "E", Within("between 1e-13 and 1", 1e-13, 1), [&](double v) { options.set_error_tolerance(v); },
      "An error instead of a step: of each component of x, relative to its largest value (1e-6 where neither is given). "
      "Steps are then as short as that needs; --step, --steps and --grid only say where output is wanted");
  app.add_option_function<std::string>(
         "--at",
         [&](const std::string& text) {
           const std::vector<double> times = ParseTimes(text, "--at");
           options.mutable_output_times()->Assign(times.begin(), times.end());
         },
         "Only these times, in any order, or ranges begin:step:end; they become nodes of the grid. Otherwise a table shows 11 even "
         "times, "
         "JSON and CSV every node")
      ->type_name("T1,T2,...");
}

void AddMethod(CLI::App& app, v1::SolveOptions& options) {
  AddWord<v1::Method>(
      app, "--method", MethodNames(), ParseMethod, [&](v1::Method method) { options.set_method(method); },
      "auto chooses from the class of M and says why", MethodLike);
  AddNumber(
      app, "--theta", "THETA", Within("between 0 and 1", 0, 1), [&](double v) { options.set_theta(v); },
      "time-stepping: 0 implicit (default), 0.5 trapezoidal, 1 explicit in x");
  AddWord<v1::StepSolver>(
      app, "--step-solver", StepSolverNames(), ParseStepSolver,
      [&](v1::StepSolver step_solver) { options.set_step_solver(step_solver); },
      "time-stepping: how a step is solved, by one substituted LCP (default) or Newton's method");
  app.add_flag_function(
      "--average-y", [&](std::int64_t) { options.set_average_y(true); },
      "time-stepping: the trapezoidal rule in y too, of second order");
  app.add_option_function<std::string>(
         "--window", [&](const std::string& text) { options.set_window_steps(ParseWindow(text)); },
         "laplace-iteration: steps of a window; auto adapts (default), whole takes the horizon at once")
      ->type_name("auto|whole|STEPS");
  AddWord<v1::KernelSource>(
      app, "--kernel", KernelSourceNames(), ParseKernelSource,
      [&](v1::KernelSource kernel) { options.set_kernel(kernel); },
      "laplace-iteration: the kernel from phi-functions of h A or from its transfer function on contours; "
      "auto "
      "takes the cheaper");
  AddWord<v1::Interpolation>(
      app, "--interpolation", InterpolationNames(), ParseInterpolation,
      [&](v1::Interpolation interpolation) { options.set_interpolation(interpolation); },
      "paper-iteration: y and f between nodes; linear (default) or a cubic spline");
  AddNumber(
      app, "--iteration-tolerance", "TOL", Within("above 0 and at most 1", 1e-300, 1),
      [&](double v) { options.set_iteration_tolerance(v); },
      "Iterate until the change that is left is this small, relatively (1e-12)");
  AddNumber(
      app, "--max-iterations", "K", WholeAtLeast("a whole number of at least 1", 1),
      [&](double v) { options.set_max_iterations(static_cast<std::int64_t>(v)); },
      "Iterations per window, at most (300, or 1000 for windows that cannot shrink)");
}

void AddRealisation(CLI::App& app, v1::SolveOptions& options) {
  AddWord<v1::Realisation>(
      app, "--realisation", RealisationNames(), ParseRealisation,
      [&](v1::Realisation realisation) { options.set_realisation(realisation); },
      "How the state is carried to the constraints; auto chooses by the structure and the size of A");
  AddNumber(
      app, "--acceleration", "DEPTH", Within("a number from 0 to 20", 0, 20),
      [&](double v) { options.set_acceleration(static_cast<std::int32_t>(v)); },
      "laplace-iteration: depth of Anderson acceleration (0: the plain iteration)");
  AddNumber(
      app, "--windows-in-flight", "F", Within("a whole number from 1 to 64", 1, 64),
      [&](double v) { options.set_windows_in_flight(static_cast<std::int64_t>(v)); },
      "laplace-iteration: windows that are iterated on at the same time (1)");
  app.add_option_function<std::string>(
         "--max-memory",
         [&](const std::string& text) { options.set_max_memory_bytes(ParseBytes(text, "--max-memory")); },
         "Refuse a solve that would allocate more (8GB; on a server what it allows)")
      ->type_name("BYTES|MB|GB");
}

void AddContour(CLI::App& app, v1::SolveOptions& options) {
  AddWord<v1::ContourChoice>(
      app, "--contour", ContourChoiceNames(), ParseContourChoice,
      [&](v1::ContourChoice choice) { options.mutable_contour()->set_choice(choice); },
      "paper-iteration: the parameters of Theorem 2.2, or those of Remark 2.4 for the sector of the "
      "spectrum; auto "
      "takes the first where it serves");
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

void AddProblem(CLI::App& app, std::string& path) {
  app.add_option("PROBLEM", path, "Problem file in JSON; - reads standard input")->required()->type_name("FILE");
}

void AddRule(CLI::App& app, std::optional<v1::SolutionRule>& rule) {
  AddWord<v1::SolutionRule>(
      app, "--rule", RuleNames(), ParseRule, [&rule](v1::SolutionRule value) { rule = value; },
      "Which solution of the LCP where there are several; overrides the file");
}

void AddOutput(CLI::App& app, std::string& output, const char* what) {
  app.add_option("-o,--output", output, fmt::format("Write {} there, whole or not at all, instead of printing it; - prints it", what))
      ->type_name("FILE");
}

void AddQuiet(CLI::App& app, bool& quiet, const char* what) { app.add_flag("-q,--quiet", quiet, what); }

void AddFormat(CLI::App& app, const std::vector<std::string>& words, OutputFormat& format, const std::string& help) {
  const auto parse = [words](const std::string& text) -> std::optional<OutputFormat> {
    if (std::find(words.begin(), words.end(), text) == words.end()) return std::nullopt;
    if (text == "json") return OutputFormat::kJson;
    if (text == "name") return OutputFormat::kName;
    return text == "csv" ? OutputFormat::kCsv : OutputFormat::kTable;
  };
  AddWord<OutputFormat>(
      app, std::find(words.begin(), words.end(), "name") == words.end() ? "-f,--format" : "-o,-f,--format", words, parse,
      [&format](OutputFormat value) { format = value; }, help);
}

void AddHowToSolve(CLI::App& app, v1::SolveOptions& options, std::string& grid,
                   std::optional<v1::SolutionRule>& rule) {
  AddMethod(app, options);
  AddGrid(app, options, grid);
  AddRule(app, rule);
  AddJumps(app, options);
  app.add_flag_function(
      "--estimate-error,!--no-estimate-error", [&](std::int64_t count) { options.set_estimate_error(count > 0); },
      "With --steps, --step or --grid: whether to estimate the error by solves of twice and four times the step (yes; "
      "three quarters of the cost)");
  AddRealisation(app, options);
  AddContour(app, options);
}

}  // namespace dlcs::client
