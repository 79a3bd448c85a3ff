// SPDX-License-Identifier: Apache-2.0
#include "client/mpi/rank_solve.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "client/cli/output/atomic_file.h"
#include "client/cli/output/result_arrays.h"
#include "client/local/local_backend.h"
#include "client/mpi/row_files.h"
#include "client/mpi/same_request.h"
#include "core/mpi/trajectory_parts.h"
#include "core/problem/problem.h"

namespace dlcs::client {
namespace {

// By the key of the problem file.
using Operators = std::map<std::string, std::shared_ptr<const DistributedOperator>>;

bool StepsIteratively(const v1::SolveOptions& options) {
  return options.method() == v1::METHOD_TIME_STEPPING && options.propagator() == v1::PROPAGATOR_KIND_ITERATIVE_STEPPING;
}

// Whether the trajectory may remain distributed: no rank needs more of it than its own rows.
bool MayStayWithRanks(const SolveCommand& command) {
  const v1::SolveOptions& options = command.options;
  const bool compares_solves = !options.has_estimate_error() || options.estimate_error();
  std::error_code ignored;
  const bool is_placed =
      !std::filesystem::exists(command.output, ignored) || std::filesystem::is_regular_file(command.output, ignored);
  return StepsIteratively(options) && options.grid_case() != v1::SolveOptions::GRID_NOT_SET && !compares_solves &&
         command.format == OutputFormat::kHdf5 && !IsStandardOutput(command.output) && is_placed &&
         std::endian::native == std::endian::little;
}

// A matrix of the same shape without entries, which stands for `matrix` in the problem.
v1::Matrix StandIn(const DistributedOperator& matrix) {
  v1::Matrix shape;
  shape.mutable_sparse()->set_rows(static_cast<std::int32_t>(matrix.rows()));
  shape.mutable_sparse()->set_columns(static_cast<std::int32_t>(matrix.cols()));
  return shape;
}

// Replaces the matrices of StandIn() by those that were read by rows.
void PutOperators(const Operators& operators, Problem& problem) {
  const std::pair<const char*, StructuredMatrix*> places[] = {{"A", &problem.A}, {"B", &problem.B}, {"N", &problem.N}};
  for (const auto& [key, matrix] : places) {
    if (const auto found = operators.find(key); found != operators.end()) {
      *matrix = StructuredMatrix(std::shared_ptr<const LinearOperator>(found->second));
    }
  }
}

// Writes the arrays of rank 0, and allocates those that all ranks write afterwards.
absl::StatusOr<std::map<std::string, std::uint64_t>> WriteFrame(const std::string& title, const SolveResult& result,
                                                                const TrajectoryParts& parts, const std::string& path) {
  ResultArrays all = ArraysOf(title, result);
  // Without default names such as x1, x2, ..., which would take as much room as a column.
  all.names.clear();
  if (!result.names.states.empty()) all.names.push_back({"state_names", result.names.states});
  if (!result.names.pairs.empty()) all.names.push_back({"pair_names", result.names.pairs});
  const auto count = [](Index size) { return static_cast<std::size_t>(size); };
  for (const LeftLimit& limit : parts.left_limits) {
    all.left_times.push_back(result.times[count(limit.column)]);
    all.left_y.insert(all.left_y.end(), limit.y.begin(), limit.y.end());
    all.left_w.insert(all.left_w.end(), limit.w.begin(), limit.w.end());
  }
  const std::size_t limits = all.left_times.size(), pairs = count(parts.pairs.size());
  all.arrays.clear();
  all.arrays.push_back({.name = "t", .values = result.times, .rows = result.times.size(), .is_list = true});
  const std::pair<const char*, Index> of_ranks[] = {
      {"x", parts.states.size()}, {"y", parts.pairs.size()}, {"w", parts.pairs.size()}};
  for (const auto& [name, columns] : of_ranks) {
    all.arrays.push_back({.name = name, .values = {}, .rows = result.times.size(), .columns = count(columns)});
  }
  all.arrays.push_back({.name = "switching_times", .values = {}, .is_list = true});
  all.arrays.push_back({.name = "left_times", .values = all.left_times, .rows = limits, .is_list = true});
  all.arrays.push_back({.name = "left_y", .values = all.left_y, .rows = limits, .columns = pairs});
  all.arrays.push_back({.name = "left_w", .values = all.left_w, .rows = limits, .columns = pairs});
  return WriteHdf5WithRoom(all, path);
}

// Called by all ranks. `own_path` is used on the first one.
absl::Status WriteParts(const std::string& title, const SolveResult& result, const std::string& own_path,
                        SolvingTeam& team) {
  const TrajectoryParts parts = *std::exchange(team.trajectory(), std::nullopt);
  std::map<std::string, std::uint64_t> places;
  absl::Status made;
  if (team.rank() == 0) {
    auto frame = WriteFrame(title, result, parts, own_path);
    made = frame.status();
    if (frame.ok()) places = *std::move(frame);
  }
  if (const std::string error = team.FirstText(std::string(made.message())); !error.empty()) {
    return absl::InternalError(error);
  }
  const std::string path = team.TextOf(0, own_path);
  const std::pair<const char*, const Matrix*> arrays[] = {{"x", &parts.x}, {"y", &parts.y}, {"w", &parts.w}};
  for (const auto& [name, part] : arrays) {
    double place = static_cast<double>(places[name]);  // exact up to 2⁵³
    team.Share(0, &place, 1);
    if (part->cols() == 0) continue;
    const Ownership& rows = part == &parts.x ? parts.states : parts.pairs;
    const std::string error = WriteTogether(path, static_cast<std::uint64_t>(place), *part, rows, team);
    if (!error.empty()) return absl::InternalError(error);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<SolveHooks> HooksForRanks(const SolveCommand& command, SolvingTeam& team) {
  if (absl::Status same = CheckSameOptions(command, team); !same.ok()) return same;
  SolveHooks hooks;
  LocalHooks of_backend;
  of_backend.check = [&team](const v1::SolveRequest& request) { return CheckSameRequest(request, team); };
  const bool in_groups = team.group() != nullptr && command.options.propagator() == v1::PROPAGATOR_KIND_CONTOUR;
  MpiTeam& readers = in_groups ? *team.group() : team;
  if (!(in_groups || StepsIteratively(command.options)) || !HaveSameText(command.problem_path, team)) {
    hooks.backend = std::make_unique<LocalBackend>(std::move(of_backend));
    return hooks;
  }
  if (!team.Any(!MayStayWithRanks(command))) team.KeepTrajectories();
  const auto operators = std::make_shared<Operators>();
  hooks.matrix_files = [&team, &readers, operators](
                           const std::string& place,
                           const std::string& path) -> std::optional<absl::StatusOr<v1::Matrix>> {
    if (place != "A" && place != "B" && place != "N") return std::nullopt;
    if (team.Any(!IsReadByRows(path))) return std::nullopt;
    auto matrix = ReadByRows(path, readers);
    if (!matrix.ok()) return matrix.status();
    operators->insert_or_assign(place, *matrix);
    return StandIn(**matrix);
  };
  of_backend.on_problem = [operators](Problem& problem) { PutOperators(*operators, problem); };
  of_backend.has_no_trajectory = [&team] { return team.trajectory().has_value(); };
  of_backend.processes = team.keeps_trajectories() ? team.size() : 1;
  hooks.backend = std::make_unique<LocalBackend>(std::move(of_backend));
  hooks.write_arrays = [&team](const std::string& title, const SolveResult& result,
                               const std::string& path) -> std::optional<absl::Status> {
    if (!team.trajectory()) return std::nullopt;
    return WriteParts(title, result, path, team);
  };
  return hooks;
}

}  // namespace dlcs::client
