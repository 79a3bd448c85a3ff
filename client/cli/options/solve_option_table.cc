// SPDX-License-Identifier: Apache-2.0
#include "client/cli/options/solve_option_table.h"

#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>

#include "client/local/option_range.h"
#include "client/result/names.h"

namespace dlcs::client {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

// The method here that corresponds to `method` in other programs.
std::optional<std::string> MethodMeantBy(const std::string& method) {
  static const std::map<std::string, std::vector<std::string>> kElsewhere = {
      {"event-driven",
       {"rk45", "rk23", "dop853", "dopri5", "radau", "bdf", "lsoda", "cvode", "ode45", "ode23", "ode15s", "rk4",
        "event"}},
      {"time-stepping",
       {"euler", "implicit-euler", "backward-euler", "theta", "trapezoidal", "crank-nicolson", "moreau",
        "moreau-jean"}},
      {"exponential-integrator", {"expm", "etd", "etd2", "exponential-euler", "exponential-integrator"}}};
  std::string lower = method;
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char c) { return c == '_' ? '-' : static_cast<char>(std::tolower(c)); });
  for (const auto& [here, elsewhere] : kElsewhere) {
    if (std::ranges::find(elsewhere, lower) != elsewhere.end()) return here;
  }
  return std::nullopt;
}

constexpr OptionGroup kEveryday = OptionGroup::kEveryday;
constexpr double kMaxInt32 = std::numeric_limits<std::int32_t>::max();

using enum OptionKind;
constexpr v1::Method kLaplace = v1::METHOD_LAPLACE_ITERATION;
constexpr v1::Method kPaper = v1::METHOD_WU_CHEN_ITERATION;
constexpr v1::Method kStepping = v1::METHOD_TIME_STEPPING;

constexpr SolveOption kTable[] = {
    {.field = "method",
     .flag = "--method",
     .kind = kWord,
     .value = "",
     .help = "Solution method; auto chooses by the class of M and reports why",
     .group = kEveryday,
     .meant_by = MethodMeantBy},
    {.field = "error_tolerance",
     .flag = "--tolerance",
     .kind = kNumber,
     .value = "E",
     .help = "Largest error of each state, pair and output, relative to its largest value (1e-6, unless steps are "
             "given). The steps are chosen to meet it; --step, --steps and --grid then only set the output times",
     .group = kEveryday},
    {.field = "absolute_tolerances",
     .flag = "--absolute-tolerance",
     .kind = kTolerances,
     .value = "A|NAME=A,...",
     .help = "An error of at most A is accepted too, in every component, or in those that are named: states, pairs, "
             "w(PAIR), outputs. May be repeated",
     .group = kEveryday},
    {.field = "steps",
     .flag = "--steps",
     .kind = kNumber,
     .value = "J",
     .help = "Number of steps over [0, T]",
     .group = kEveryday},
    {.field = "step",
     .flag = "--step",
     .kind = kNumber,
     .value = "H",
     .help = "Largest length of a step",
     .group = kEveryday,
     .excludes = {"--steps"}},
    {.field = "grid_times",
     .flag = "--grid",
     .kind = kNodes,
     .value = "FILE|T1,T2,...",
     .help = "Nodes instead of equal steps, in any order, or a file with them; 0, T and break points are added",
     .excludes = {"--steps", "--step"}},
    {.field = "output_times",
     .flag = "--at",
     .kind = kTimes,
     .value = "T1,T2,...",
     .help =
         "Output times, in any order, or ranges begin:step:end such as 0:1m:20m (m, u, n, k, meg, ... as in SPICE); "
         "they become nodes of the grid. By default a table shows 11 even times, JSON and CSV show every node",
     .group = kEveryday},
    {.field = "period",
     .flag = "--periodic",
     .kind = kPeriod,
     .value = "PERIOD|auto",
     .help = "Find the periodic steady state, x(0) = x(PERIOD), and show one period of it; auto also finds the period, "
             "of an oscillation without time-dependent sources, if the solution from x0 comes near it before T",
     .group = kEveryday,
     .linear_only = true},
    {.field = "estimate_error",
     .flag = "--estimate-error",
     .kind = kNegatable,
     .value = "",
     .help =
         "With --steps, --step or --grid: estimate the error by solves with twice and four times the step (default; "
         "adds three quarters to the cost)"},
    {.field = "iteration_tolerance",
     .flag = "--iteration-tolerance",
     .kind = kNumber,
     .value = "TOL",
     .help = "Iterate until the estimated remaining change is below this, relative (1e-12); for iterative steps their "
             "residual"},
    {.field = "max_iterations",
     .flag = "--max-iterations",
     .kind = kNumber,
     .value = "K",
     .help = "Largest number of iterations per window (300, or 1000 for windows that cannot shrink)"},
    {.field = "project_initial_state",
     .flag = "--project-initial-state",
     .kind = kFlag,
     .value = "",
     .help = "Let an inconsistent state jump instead of refusing it",
     .linear_only = true},
    {.field = "inelastic_impact",
     .flag = "--inelastic-impact",
     .kind = kFlag,
     .value = "",
     .help = "Solve contact (relative degree two) as inelastic impact, an additional law, instead of refusing it",
     .linear_only = true},
    {.field = "propagator",
     .flag = "--propagator",
     .kind = kWord,
     .value = "",
     .help = "How the action of e^{tA} is computed; auto chooses by the structure and the size of A"},
    {.field = "max_memory_bytes",
     .flag = "--max-memory",
     .kind = kBytes,
     .value = "BYTES|MB|GB",
     .help = "Refuse a solve that would allocate more (8GB; a server has its own limit)"},
    {.field = "threads",
     .flag = "--threads",
     .kind = kNumber,
     .value = "N",
     .help = "Largest number of threads (0: all); the result does not depend on it"},
    {.field = "ranks",
     .flag = "--ranks",
     .kind = kNumber,
     .value = "N",
     .help = "For a job: solve on N MPI processes, if the server has a launcher; the bits depend on N",
     .rule = Whole("a whole number of at least 0", 0, kMaxInt32)},
    {.field = "theta",
     .flag = "--theta",
     .kind = kNumber,
     .value = "THETA",
     .help = "0 implicit (default), 0.5 trapezoidal, 1 explicit in x",
     .method = kStepping},
    {.field = "step_solver",
     .flag = "--step-solver",
     .kind = kWord,
     .value = "",
     .help = "How a step is solved: as one LCP by substitution (default), or by Newton's method",
     .method = kStepping},
    {.field = "average_y",
     .flag = "--average-y",
     .kind = kFlag,
     .value = "",
     .help = "Use the trapezoidal rule for y too, of second order",
     .method = kStepping},
    {.field = "window_steps",
     .flag = "--window",
     .kind = kWindow,
     .value = "auto|whole|STEPS",
     .help = "Steps of a window: auto adapts (default), whole takes the horizon at once",
     .method = kLaplace},
    {.field = "windows_in_flight",
     .flag = "--windows-in-flight",
     .kind = kNumber,
     .value = "F",
     .help = "Number of windows that are iterated at the same time (1)",
     .method = kLaplace},
    {.field = "acceleration",
     .flag = "--acceleration",
     .kind = kNumber,
     .value = "DEPTH",
     .help = "Depth of Anderson acceleration (0: the plain iteration)",
     .method = kLaplace},
    {.field = "kernel",
     .flag = "--kernel",
     .kind = kWord,
     .value = "",
     .help = "Compute the kernel from phi-functions of h A, or invert its transfer function on contours; auto takes "
             "the cheaper",
     .method = kLaplace,
     .linear_only = true},
    {.field = "interpolation",
     .flag = "--interpolation",
     .kind = kWord,
     .value = "",
     .help = "y and f between nodes: linear (default) or a cubic spline",
     .method = kPaper},
    {.field = "contour.choice",
     .flag = "--contour",
     .kind = kWord,
     .value = "",
     .help = "Contour of Theorem 2.2, or of Remark 2.4 for the sector of the spectrum; auto takes the first where it "
             "serves",
     .method = kPaper},
    {.field = "contour.nodes",
     .flag = "--contour-nodes",
     .kind = kNumber,
     .value = "P",
     .help = "P, for 2P + 1 nodes on the contour (25)",
     .method = kPaper},
    {.field = "contour.gamma",
     .flag = "--contour-gamma",
     .kind = kNumber,
     .value = "GAMMA",
     .help = "Angle of the contour (0.794)",
     .method = kPaper},
    {.field = "contour.mu",
     .flag = "--contour-mu",
     .kind = kNumber,
     .value = "MU",
     .help = "Scale of the contour (sqrt(P)/4)",
     .method = kPaper},
    {.field = "contour.step",
     .flag = "--contour-step",
     .kind = kNumber,
     .value = "DV",
     .help = "Distance of the nodes (2.06/sqrt(P))",
     .method = kPaper},
    {.field = "contour.for_initial_state",
     .flag = "--contour-initial-state",
     .kind = kFlag,
     .value = "",
     .help = "Compute e^{At} x0 by a contour too (Remark 2.3)",
     .method = kPaper},
};

// A field of SolveOptions, or of a message inside.
struct Place {
  const Message* message;
  const FieldDescriptor* field;

  const Reflection& reflection() const { return *message->GetReflection(); }
  bool is_set() const {
    return field->is_repeated() ? reflection().FieldSize(*message, field) > 0 : reflection().HasField(*message, field);
  }
};

Place Find(const v1::SolveOptions& options, std::string_view path) {
  const Message* message = &options;
  for (std::size_t dot = path.find('.'); dot != std::string_view::npos; dot = path.find('.')) {
    const FieldDescriptor* part = message->GetDescriptor()->FindFieldByName(std::string(path.substr(0, dot)));
    message = &message->GetReflection()->GetMessage(*message, part);
    path.remove_prefix(dot + 1);
  }
  return {message, message->GetDescriptor()->FindFieldByName(std::string(path))};
}

// The message that holds the field at `path`; created if it is not set.
Message& MutableParent(v1::SolveOptions& options, std::string_view path) {
  Message* message = &options;
  for (std::size_t dot = path.find('.'); dot != std::string_view::npos; dot = path.find('.')) {
    const FieldDescriptor* part = message->GetDescriptor()->FindFieldByName(std::string(path.substr(0, dot)));
    message = message->GetReflection()->MutableMessage(message, part);
    path.remove_prefix(dot + 1);
  }
  return *message;
}

void SetNumber(v1::SolveOptions& options, std::string_view path, double value) {
  Message& message = MutableParent(options, path);
  const FieldDescriptor* field = Find(options, path).field;
  const Reflection& reflection = *message.GetReflection();
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return reflection.SetInt32(&message, field, static_cast<std::int32_t>(value));
    case FieldDescriptor::CPPTYPE_INT64:
      return reflection.SetInt64(&message, field, static_cast<std::int64_t>(value));
    case FieldDescriptor::CPPTYPE_BOOL:
      return reflection.SetBool(&message, field, value != 0);
    case FieldDescriptor::CPPTYPE_ENUM:
      return reflection.SetEnumValue(&message, field, static_cast<int>(value));
    default:
      return reflection.SetDouble(&message, field, value);
  }
}

double NumberAt(const Place& place) {
  switch (place.field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return place.reflection().GetInt32(*place.message, place.field);
    case FieldDescriptor::CPPTYPE_INT64:
      return static_cast<double>(place.reflection().GetInt64(*place.message, place.field));
    case FieldDescriptor::CPPTYPE_BOOL:
      return place.reflection().GetBool(*place.message, place.field) ? 1 : 0;
    case FieldDescriptor::CPPTYPE_ENUM:
      return place.reflection().GetEnumValue(*place.message, place.field);
    default:
      return place.reflection().GetDouble(*place.message, place.field);
  }
}

// The rule for a number of `row`: its own, or the engine's. Where that has no largest whole number, `field` has one.
NumberRule RuleOf(const SolveOption& row, const FieldDescriptor& field) {
  if (row.rule) return *row.rule;
  const SolveOptionRange range = RangeOf(row.field);
  if (field.cpp_type() != FieldDescriptor::CPPTYPE_INT32) return {range.words, range.least, range.most};
  if (range.most <= kMaxInt32) return {range.words, range.least, range.most, /*whole=*/true};
  const char* words = range.least > 0 ? "between 1 and 2147483647" : "between 0 and 2147483647";
  return {words, range.least, kMaxInt32, /*whole=*/true};
}

// "auto", "whole" or a number of steps, as SolveOptions.window_steps counts them.
double ParseWindow(const std::string& text, const std::string& flag) {
  if (text == "auto") return 0;
  if (text == "whole") return -1;
  return CheckedNumber(text, Whole("auto, whole or a whole number from 1 to 2147483647", 1, kMaxInt32), flag);
}

// "auto" or a period, as SolveOptions.period counts them.
double ParsePeriod(const std::string& text, const std::string& flag) {
  NumberRule rule = Positive();
  rule.words = "auto or a number above 0";
  return text == "auto" ? -1 : CheckedNumber(text, rule, flag);
}

// The parts of `text` between commas that are not inside parentheses, since v(a,b) is a name.
std::vector<std::string> SplitAtCommas(const std::string& text) {
  std::vector<std::string> parts(1);
  int depth = 0;
  for (const char c : text) {
    depth += c == '(' ? 1 : c == ')' ? -1 : 0;
    if (c == ',' && depth == 0) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

// "1e-9", "iL=1e-9,v(a,b)=1e-6" or both.
void ReadTolerances(const std::string& text, const std::string& flag, v1::SolveOptions& options) {
  const NumberRule rule = Within("a number at least 0, or NAME=NUMBER", 0, std::numeric_limits<double>::max());
  for (const std::string& part : SplitAtCommas(text)) {
    const std::size_t equals = part.rfind('=');
    const double tolerance = CheckedNumber(equals == std::string::npos ? part : part.substr(equals + 1), rule, flag);
    if (equals == std::string::npos) {
      options.set_absolute_tolerance(tolerance);
      continue;
    }
    v1::ComponentTolerance& of_component = *options.add_absolute_tolerances();
    of_component.set_name(part.substr(0, equals));
    of_component.set_tolerance(tolerance);
  }
}

std::string TypedTolerances(const v1::SolveOptions& options) {
  std::vector<std::string> parts;
  if (options.has_absolute_tolerance()) parts.push_back(fmt::format("{}", options.absolute_tolerance()));
  for (const v1::ComponentTolerance& of_component : options.absolute_tolerances()) {
    parts.push_back(fmt::format("{}={}", of_component.name(), of_component.tolerance()));
  }
  return fmt::format("{}", fmt::join(parts, ","));
}

// Whether the option of `row` is set.
bool IsSet(const SolveOption& row, const v1::SolveOptions& options) {
  if (row.kind == OptionKind::kTolerances && options.has_absolute_tolerance()) return true;
  return Find(options, row.field).is_set();
}

// The text after the flag of `row` for the value at `place`.
std::string TypedValue(const SolveOption& row, const Place& place, const v1::SolveOptions& options) {
  const bool is_list = place.field->is_repeated() || row.kind == OptionKind::kNodes;
  const double number = is_list ? 0 : NumberAt(place);
  switch (row.kind) {
    case OptionKind::kTolerances:
      return TypedTolerances(options);
    case OptionKind::kWord:
      return EnumWord(*place.field->enum_type(), static_cast<int>(number));
    case OptionKind::kTimes:
      return fmt::format("{}", fmt::join(options.output_times(), ","));
    case OptionKind::kNodes:
      return fmt::format("{}", fmt::join(options.grid_times().times(), ","));
    case OptionKind::kWindow:
      return number < 0 ? "whole" : fmt::format("{}", number);
    case OptionKind::kPeriod:
      return number < 0 ? "auto" : fmt::format("{}", number);
    default:
      return fmt::format("{}", number);
  }
}

}  // namespace

std::span<const SolveOption> SolveOptionTable() { return kTable; }

const SolveOption* FindSolveOption(std::string_view flag) {
  for (const SolveOption& row : SolveOptionTable()) {
    if (row.flag == flag) return &row;
  }
  return nullptr;
}

std::string_view FlagOf(std::string_view field) {
  if (field == "grid") return "--step, --steps or --grid";  // the oneof of the three
  if (field == "absolute_tolerance") field = "absolute_tolerances";  // both of one option
  for (const SolveOption& row : SolveOptionTable()) {
    if (row.field == field) return row.flag;
  }
  return {};
}

CLI::Option* AddSolveOption(CLI::App& app, const SolveOption& row, v1::SolveOptions& options,
                            std::string& nodes_as_typed) {
  const std::string flag(row.flag);
  const auto set = [&options, &row](double value) { SetNumber(options, row.field, value); };
  const auto add_text = [&](const std::function<void(const std::string&)>& read) {
    return app.add_option_function<std::string>(flag, read, row.help)->type_name(row.value);
  };
  switch (row.kind) {
    case OptionKind::kNumber:
      return AddNumber(app, flag, row.value, RuleOf(row, *Find(options, row.field).field), set, row.help);
    case OptionKind::kWord: {
      const auto* words = Find(options, row.field).field->enum_type();
      return AddWord<int>(
          app, flag, EnumWords(*words), [words](const std::string& word) { return ParseEnumWord(*words, word); }, set,
          row.help, row.meant_by);
    }
    case OptionKind::kFlag:
      return app.add_flag_function(
          flag, [set](std::int64_t) { set(1); }, row.help);
    case OptionKind::kNegatable:
      return app.add_flag_function(
          flag + ",!--no" + flag.substr(1), [set](std::int64_t count) { set(count > 0 ? 1 : 0); }, row.help);
    case OptionKind::kTimes:
      return add_text([&options, flag](const std::string& text) {
        const std::vector<double> times = ParseTimes(text, flag);
        options.mutable_output_times()->Assign(times.begin(), times.end());
      });
    case OptionKind::kNodes:
      return add_text([&options, &nodes_as_typed, flag](const std::string& text) {
        nodes_as_typed = text;
        const std::vector<double> times = ParseTimesOrFile(text, flag);
        options.mutable_grid_times()->mutable_times()->Assign(times.begin(), times.end());
      });
    case OptionKind::kWindow:
      return add_text([set, flag](const std::string& text) { set(ParseWindow(text, flag)); });
    case OptionKind::kPeriod:
      return add_text([set, flag](const std::string& text) { set(ParsePeriod(text, flag)); });
    case OptionKind::kBytes:
      return add_text([set, flag](const std::string& text) { set(ParseBytes(text, flag)); });
    case OptionKind::kTolerances:
      return app
          .add_option_function<std::vector<std::string>>(
              flag,
              [&options, flag](const std::vector<std::string>& texts) {
                for (const std::string& text : texts) ReadTolerances(text, flag, options);
              },
              row.help)
          ->type_name(row.value)
          ->expected(1)
          ->take_all();
  }
  return nullptr;
}

std::vector<std::string> AsTyped(const v1::SolveOptions& options, const std::string& nodes_as_typed) {
  std::vector<std::string> words;
  for (const SolveOption& row : SolveOptionTable()) {
    const Place place = Find(options, row.field);
    if (!IsSet(row, options)) continue;
    const bool says_no = row.kind == OptionKind::kNegatable && NumberAt(place) == 0;
    words.push_back(says_no ? "--no" + std::string(row.flag.substr(1)) : std::string(row.flag));
    if (row.kind == OptionKind::kFlag || row.kind == OptionKind::kNegatable) continue;
    const bool as_typed = row.kind == OptionKind::kNodes && !nodes_as_typed.empty();
    words.push_back(as_typed ? nodes_as_typed : TypedValue(row, place, options));
  }
  return words;
}

std::vector<std::string> OptionsWithoutEffect(const v1::SolveOptions& options, v1::Method used, bool nonlinear) {
  std::vector<std::string> lines;
  for (const SolveOption& row : SolveOptionTable()) {
    if (!IsSet(row, options)) continue;
    if (row.linear_only && nonlinear) {
      lines.push_back(fmt::format("{} had no effect: it is for linear systems", row.flag));
    } else if (row.method != v1::METHOD_UNSPECIFIED && used != v1::METHOD_UNSPECIFIED && row.method != used) {
      lines.push_back(
          fmt::format("{} had no effect: it is for {}, and {} solved", row.flag, Word(row.method), Word(used)));
    }
  }
  return lines;
}

}  // namespace dlcs::client
