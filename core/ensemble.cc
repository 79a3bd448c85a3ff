// SPDX-License-Identifier: Apache-2.0
#include "core/ensemble.h"

#include <mutex>
#include <string>
#include <utility>

#include "core/parallel/parallel.h"
#include "core/solve.h"
#include "core/soundness.h"
#include "core/violation_list.h"

namespace dlcs {
namespace {

// Enough for every scheme of an ordinary ensemble; what does not fit is made again.
constexpr double kOwnCacheBytes = 1e9;

std::string NameOf(Index member) { return "members[" + std::to_string(member) + "]"; }

// Whether a violation of a member's problem lies in what is its own.
bool IsOwn(const EnsembleMember& member, const std::string& field) {
  const auto begins = [&](const char* name) { return field.rfind(name, 0) == 0; };
  return (member.x0 && begins("x0")) || (member.f && begins("f")) || (member.g && begins("g")) ||
         (member.horizon && field == "T") || (member.break_points && begins("break_points"));
}

absl::Status CheckMembers(const Problem& base, const std::vector<EnsembleMember>& members, const Options& options) {
  std::vector<Violation> violations;
  if (members.empty()) violations.push_back({"members", "empty; an ensemble has at least one"});
  for (Index k = 0; k < static_cast<Index>(members.size()); ++k) {
    const EnsembleMember& member = members[static_cast<std::size_t>(k)];
    const Problem problem = MemberProblem(base, member);
    for (Violation& violation : Validate(problem)) {
      if (IsOwn(member, violation.field)) {
        violation.field = NameOf(k) + "." + violation.field;
      } else if (k > 0) {
        continue;  // the base has been said to be wrong
      }
      violations.push_back(std::move(violation));
    }
    for (Violation& violation : Validate(options, problem.horizon)) {
      if (member.horizon) {
        violation.field = NameOf(k) + ": " + violation.field;
      } else if (k > 0) {
        continue;
      }
      violations.push_back(std::move(violation));
    }
    if (static_cast<Index>(violations.size()) > ViolationList::kMaxListed) break;
  }
  return StatusOf(violations);
}

Solution NotBegun() {
  Solution solution;
  solution.termination = Termination::kCancelled;
  solution.message = "Stopped on request before this member was begun.";
  solution.failure_time = 0;
  return solution;
}

}  // namespace

Problem MemberProblem(const Problem& base, const EnsembleMember& member) {
  Problem problem = base;
  if (member.x0) problem.x0 = *member.x0;
  if (member.f) problem.f = *member.f;
  if (member.g) problem.g = *member.g;
  if (member.horizon) problem.horizon = *member.horizon;
  if (member.break_points) problem.break_points = *member.break_points;
  return problem;
}

absl::Status SolveEnsemble(const Problem& base, const std::vector<EnsembleMember>& members, const Options& options,
                           const MemberFinished& finished, const std::stop_token& stop, SetupCache* setups) {
  if (absl::Status status = CheckMembers(base, members, options); !status.ok()) return status;
  SetupCache own(kOwnCacheBytes);
  Options of_member = options;
  of_member.num_threads = 1;
  std::mutex mutex;
  absl::Status first_error;
  Workers workers(options.num_threads);
  workers.ForBlocks(static_cast<Index>(members.size()), 1, [&](Index k, Index, Index) {
    absl::StatusOr<Solution> solution = NotBegun();
    if (!stop.stop_requested()) {
      Observer silent;
      solution = Solve(MemberProblem(base, members[static_cast<std::size_t>(k)]), of_member, silent, stop,
                       setups ? setups : &own);
    }
    const std::lock_guard lock(mutex);
    if (solution.ok()) {
      finished(k, *std::move(solution));
    } else {
      first_error.Update(absl::Status(solution.status().code(), NameOf(k) + ": " + std::string(solution.status().message())));
    }
  });
  return first_error;
}

}  // namespace dlcs
