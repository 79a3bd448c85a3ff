// SPDX-License-Identifier: Apache-2.0
#include "server/session/request_check.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/problem/source_periods.h"
#include "core/problem/violation_list.h"
#include "fmt/format.h"
#include "proto/wire/matrix_shape.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

std::vector<Violation> CheckOptions(const Problem& problem, const Options& options) {
  return CheckPeriod(problem, options);
}

// The violations that the engine would report, with the field names of the wire.
template <typename System>
std::vector<Violation> AllViolations(const System& problem, const Options& options) {
  std::vector<Violation> violations = Validate(problem);
  for (Violation& violation : Validate(options, problem.horizon)) {
    violations.push_back({WireOptionName(violation.field), std::move(violation.description)});
  }
  if (violations.empty()) violations = CheckOptions(problem, options);
  return violations;
}

// Fields of requests that hold the problem.
constexpr const char* kLinear = "problem";
constexpr const char* kNonlinear = "nonlinear";

// The name in the contract for the name of a problem's field in files and formulas; matrices are lower case there.
std::string WireProblemName(const std::string& name) {
  if (name == "T") return "horizon";
  if (name == "states") return "state_names";
  if (name == "pairs") return "pair_names";
  const bool matrix = name.size() == 1 && name[0] >= 'A' && name[0] <= 'Z';
  return matrix ? std::string(1, static_cast<char>(name[0] - 'A' + 'a')) : name;
}

bool IsOption(const std::string& name) {
  const auto& options = *v1::SolveOptions::descriptor();
  return options.FindFieldByName(name) != nullptr || options.FindOneofByName(name) != nullptr;
}

// InRequest() for one field.
std::string PathOf(const std::string& field, const std::string& system) {
  constexpr std::string_view kMembers = "members[";
  if (field == "members") return field;
  if (field.starts_with(kMembers)) {
    const std::size_t end = field.find("].");
    if (end == std::string::npos) return field;
    return field.substr(0, end + 2) + PathOf(field.substr(end + 2), "");
  }
  const std::size_t end = std::min(field.find_first_of(".[:"), field.size());
  const std::string name = field.substr(0, end);
  if (!system.empty() && IsOption(name)) return "options." + field;
  const std::string prefix = system.empty() ? "" : system + ".";
  if (field.starts_with("selector.C")) return prefix + "selector.c" + field.substr(10);
  if (field.starts_with("outputs.C")) return prefix + "outputs.c" + field.substr(9);
  if (field.starts_with("outputs.D")) return prefix + "outputs.d" + field.substr(9);
  return prefix + WireProblemName(name) + field.substr(end);
}

// Checks the declared shapes against the limits before anything is read: a sparse matrix of a few bytes may declare any
// size, for which memory would be allocated.
class ShapeCheck {
 public:
  explicit ShapeCheck(const SessionLimits& limits) : limits_(limits) {}

  void States(std::int64_t count) { Check("max_states", count, limits_.max_states); }
  void Constraints(std::int64_t count) { Check("max_constraints", count, limits_.max_constraints); }
  void Dense(const v1::Matrix& a) {
    if (a.has_dense()) Check("max_dense_states", a.dense().rows(), limits_.max_dense_states);
  }
  const absl::Status& status() const { return status_; }

 private:
  void Check(const char* name, std::int64_t asked, std::int64_t limit) {
    status_.Update(CheckLimit(name, static_cast<double>(asked), limit));
  }

  const SessionLimits& limits_;
  absl::Status status_;
};

absl::Status CheckShapes(const v1::Problem& problem, const SessionLimits& limits) {
  ShapeCheck check(limits);
  for (const std::int64_t count :
       {ShapeOf(problem.a()).rows, ShapeOf(problem.a()).columns, ShapeOf(problem.e()).rows,
        ShapeOf(problem.e()).columns, ShapeOf(problem.b()).rows, ShapeOf(problem.n()).columns,
        ShapeOf(problem.f().lift()).rows, ShapeOf(problem.f().lift()).columns, ShapeOf(problem.g().lift()).columns,
        ShapeOf(problem.outputs().h().lift()).columns}) {
    check.States(count);
  }
  for (const std::int64_t count :
       {ShapeOf(problem.m()).rows, ShapeOf(problem.m()).columns, ShapeOf(problem.b()).columns,
        ShapeOf(problem.n()).rows, ShapeOf(problem.g().lift()).rows}) {
    check.Constraints(count);
  }
  check.Dense(problem.a());
  check.Dense(problem.e());
  return check.status();
}

absl::Status CheckShapes(const v1::EnsembleMember& member, const SessionLimits& limits) {
  ShapeCheck check(limits);
  check.States(ShapeOf(member.f().lift()).rows);
  check.States(ShapeOf(member.f().lift()).columns);
  check.Constraints(ShapeOf(member.g().lift()).rows);
  check.States(ShapeOf(member.g().lift()).columns);
  return check.status();
}

absl::Status CheckShapes(const v1::NonlinearProblem& problem, const SessionLimits& limits) {
  ShapeCheck check(limits);
  check.States(problem.f_size());
  check.States(ShapeOf(problem.w()).rows);
  check.States(ShapeOf(problem.w()).columns);
  check.Constraints(problem.g_size());
  return check.status();
}

Options Within(const SessionLimits& limits, Options options) {
  if (limits.max_memory_bytes > 0) options.max_memory = std::min(options.max_memory, limits.max_memory_bytes);
  return options;
}

template <typename System>
absl::StatusOr<ValidSystem> Checked(System problem, const char* field, const v1::SolveOptions& wire_options,
                                    std::vector<Violation> violations, const SessionLimits& limits,
                                    ComponentNames names) {
  Options options = OptionsFromProto(wire_options, names, problem.num_states(), problem.num_constraints(), violations);
  if (violations.empty()) violations = AllViolations(problem, options);
  AddNames(names, violations);
  if (!violations.empty()) return InvalidRequest(InRequest(violations, field));
  return ValidSystem{std::move(problem), Within(limits, std::move(options)), std::move(names)};
}

// An upper bound of the number of steps, as a double because T / step may be anything.
double CountSteps(double horizon, std::size_t break_points, const Options& options) {
  double steps = static_cast<double>(options.num_steps > 0 ? options.num_steps : Options::kDefaultSteps);
  if (options.step > 0) steps = std::ceil(horizon / options.step);
  if (!options.grid_times.empty()) steps = static_cast<double>(options.grid_times.size()) + 1;
  return steps + static_cast<double>(break_points + options.output_times.size());
}

double CountSteps(const Problem& problem, const Options& options) {
  return CountSteps(options.period > 0 ? options.period : problem.horizon, BreakPoints(problem).size(), options);
}
double CountSteps(const NonlinearProblem& problem, const Options& options) {
  return CountSteps(problem.horizon, BreakPoints(problem).size(), options);
}

}  // namespace

absl::Status CheckRanks(const v1::SolveOptions& options, int max_ranks) {
  const int ranks = options.ranks();
  if (ranks >= 0 && (ranks == 0 || max_ranks > 0)) return CheckLimit("max_ranks", ranks, max_ranks);
  return InvalidRequest(
      {{"options.ranks", fmt::format("{}; must be {}", ranks,
                                     max_ranks > 0 ? "at least 0"
                                                   : "0 here: ranks of MPI solve jobs, and no ensembles or "
                                                     "analyses, on a server with an --mpi-launcher; without a "
                                                     "server, mpirun starts dlcs-mpi")}});
}

absl::Status CheckLimit(const char* name, double asked, std::int64_t limit) {
  if (asked <= static_cast<double>(limit)) return absl::OkStatus();
  return LimitExceeded(name, limit, static_cast<std::int64_t>(std::min(asked, 9e18)));
}

absl::StatusOr<ValidSystem> ParseAndValidate(const v1::Problem& problem, const v1::SolveOptions& options,
                                             const SessionLimits& limits) {
  if (absl::Status limit = CheckShapes(problem, limits); !limit.ok()) return limit;
  std::vector<Violation> violations;
  Problem read = ProblemFromProto(problem, violations);
  return Checked(std::move(read), kLinear, options, std::move(violations), limits, NamesOf(problem));
}

absl::StatusOr<ValidSystem> ParseAndValidate(const v1::NonlinearProblem& problem, const v1::SolveOptions& options,
                                             const SessionLimits& limits) {
  if (absl::Status limit = CheckShapes(problem, limits); !limit.ok()) return limit;
  std::vector<Violation> violations;
  NonlinearProblem read = NonlinearProblemFromProto(problem, violations);
  return Checked(std::move(read), kNonlinear, options, std::move(violations), limits, NamesOf(problem));
}

absl::StatusOr<ValidEnsemble> ParseAndValidate(const v1::SolveEnsembleRequest& request, const SessionLimits& limits) {
  absl::Status limit = CheckRanks(request.options(), 0);
  limit.Update(CheckLimit("max_members", request.members_size(), limits.max_members));
  limit.Update(CheckShapes(request.problem(), limits));
  for (const v1::EnsembleMember& member : request.members()) limit.Update(CheckShapes(member, limits));
  if (!limit.ok()) return limit;

  std::vector<Violation> violations;
  ValidEnsemble read{ProblemFromProto(request.problem(), violations), {}, {}, NamesOf(request.problem())};
  read.options =
      OptionsFromProto(request.options(), read.names, read.base.num_states(), read.base.num_constraints(), violations);
  for (int k = 0; k < request.members_size(); ++k) {
    read.members.push_back(
        MemberFromProto(request.members(k), request.problem(), fmt::format("members[{}]", k), violations));
  }
  AddNames(read.names, violations);
  if (!violations.empty()) return InvalidRequest(InRequest(violations, kLinear));

  violations = Validate(read.base, read.members, read.options);
  for (Violation& violation : violations) violation.field = WireOptionName(violation.field);
  AddNames(read.names, violations);
  if (!violations.empty()) return InvalidRequest(InRequest(violations, kLinear));
  read.options = Within(limits, std::move(read.options));
  return read;
}

int AllowedThreads(int asked, const SessionLimits& limits) {
  return limits.max_threads > 0 && (asked == 0 || asked > limits.max_threads) ? limits.max_threads : asked;
}

Index NumbersPerTime(const std::variant<Problem, NonlinearProblem>& system) {
  const auto* linear = std::get_if<Problem>(&system);
  const Index outputs = linear != nullptr ? linear->outputs.shown() : 0;
  return std::visit(
      [&](const auto& problem) { return 1 + problem.num_states() + 2 * problem.num_constraints() + outputs; }, system);
}

absl::StatusOr<std::int64_t> CountResultBytes(const std::variant<Problem, NonlinearProblem>& system,
                                              const Options& options, const SessionLimits& limits) {
  const double steps = std::visit([&](const auto& problem) { return CountSteps(problem, options); }, system);
  const auto doubles_per_time = static_cast<double>(NumbersPerTime(system));
  const bool outputs_alone = options.output_times_only && std::holds_alternative<Problem>(system);
  const double times = outputs_alone ? static_cast<double>(options.output_times.size()) : steps + 1;
  const double bytes = times * doubles_per_time * sizeof(double);
  absl::Status limit = CheckLimit("max_steps", steps, limits.max_steps);
  limit.Update(CheckLimit("max_result_bytes", bytes, limits.max_result_bytes));
  if (!limit.ok()) return limit;
  return static_cast<std::int64_t>(std::min(bytes, 9e18));
}

std::vector<Violation> InRequest(std::vector<Violation> violations, const std::string& system) {
  for (Violation& violation : violations) violation.field = PathOf(violation.field, system);
  return violations;
}

absl::Status FromEngine(const absl::Status& status, const std::variant<Problem, NonlinearProblem>& system) {
  return FromEngine(status, std::holds_alternative<Problem>(system) ? kLinear : kNonlinear);
}

absl::Status FromEngine(const absl::Status& status, const std::string& system) {
  std::vector<Violation> violations = ViolationsOf(status);
  if (violations.empty()) return status;
  for (Violation& violation : violations) violation.field = WireOptionName(violation.field);
  return InvalidRequest(InRequest(std::move(violations), system));
}

}  // namespace dlcs
