// SPDX-License-Identifier: Apache-2.0
#include "server/access/permissions.h"

#include <array>
#include <utility>

namespace dlcs {
namespace {

constexpr MethodRule kOpen{Right::kNone, false};
constexpr MethodRule kLook{Right::kReader, false};
constexpr MethodRule kWork{Right::kSubmitter, false};
constexpr MethodRule kChange{Right::kSubmitter, true};

// Which jobs a user sees is not decided here: users see their own jobs, admins all.
constexpr std::pair<std::string_view, MethodRule> kRules[] = {
    {"/dlcs.v1.SolverService/Solve", kWork},
    {"/dlcs.v1.SolverService/SolveEnsemble", kWork},
    {"/dlcs.v1.SolverService/StopSolve", kWork},
    {"/dlcs.v1.SolverService/SolveLcp", kWork},
    {"/dlcs.v1.SolverService/SolveDcp", kWork},
    {"/dlcs.v1.SolverService/AnalyzeProblem", kWork},
    {"/dlcs.v1.SolverService/GetCapabilities", kLook},
    {"/dlcs.v1.JobService/CreateSolveJob", kChange},
    {"/dlcs.v1.JobService/GetSolveJob", kLook},
    {"/dlcs.v1.JobService/ListSolveJobs", kLook},
    {"/dlcs.v1.JobService/CancelSolveJob", kChange},
    {"/dlcs.v1.JobService/DeleteSolveJob", kChange},
    {"/dlcs.v1.JobService/WatchSolveJob", kLook},
    {"/dlcs.v1.JobService/ReadTrajectory", kLook},
    {"/dlcs.v1.JobService/CreateEnsembleJob", kChange},
    {"/dlcs.v1.JobService/ReadEnsemble", kLook},
    {"/dlcs.v1.ProblemService/UploadProblem", kChange},
    {"/dlcs.v1.ProblemService/CreateProblem", kChange},
    {"/dlcs.v1.ProblemService/GetProblem", kLook},
    {"/dlcs.v1.ProblemService/ListProblems", kLook},
    {"/dlcs.v1.ProblemService/DeleteProblem", kChange},
    // Load balancers and orchestrators have no token.
    {"/grpc.health.v1.Health/Check", kOpen},
    {"/grpc.health.v1.Health/Watch", kOpen},
    {"/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", kLook},
};

constexpr std::array kRightNames = {std::pair{Right::kReader, "reader"}, std::pair{Right::kSubmitter, "submitter"},
                                    std::pair{Right::kAdmin, "admin"}};

}  // namespace

const char* RightName(Right right) {
  for (const auto& [known, name] : kRightNames) {
    if (known == right) return name;
  }
  return "none";
}

std::optional<Right> RightNamed(std::string_view name) {
  for (const auto& [right, known] : kRightNames) {
    if (known == name) return right;
  }
  return std::nullopt;
}

std::optional<MethodRule> RuleOf(std::string_view path) {
  for (const auto& [known, rule] : kRules) {
    if (known == path) return rule;
  }
  return std::nullopt;
}

}  // namespace dlcs
