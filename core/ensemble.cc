// SPDX-License-Identifier: Apache-2.0
#include "core/ensemble.h"

#include <mutex>
#include <set>
#include <string>
#include <utility>

#include "core/context/shared_setup.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/parallel/parallel.h"
#include "core/parallel/stop_scope.h"
#include "core/problem/problem_checks.h"
#include "core/problem/validate.h"
#include "core/problem/violation_list.h"
#include "core/solve.h"

namespace dlcs {
namespace {

// This is enough for every scheme of an ordinary ensemble. Schemes that do not fit are computed again.
constexpr Index kOwnCacheBytes = 1'000'000'000;

std::string NameOf(Index member) { return "members[" + std::to_string(member) + "]"; }

// Whether a violation concerns data of the member itself, and not of the base.
bool IsOwn(const EnsembleMember& member, const std::string& field) {
  const auto begins = [&](const char* name) { return field.rfind(name, 0) == 0; };
  return (member.x0 && begins("x0")) || (member.f && begins("f")) || (member.g && begins("g")) ||
         (member.h && begins("outputs.h")) || (member.horizon && field == "T") ||
         (member.break_points && begins("break_points"));
}

// The rules that the problem and the options of `member` break. If only the initial state differs from that of the
// base, nothing else is checked again: an ensemble may have a hundred thousand members.
std::vector<Violation> MemberViolations(const Problem& base, const EnsembleMember& member, const Options& options) {
  const bool has_own_times = member.f || member.g || member.h || member.horizon || member.break_points;
  if (has_own_times) return Validate(MemberProblem(base, member), options);
  ViolationList list;
  if (member.x0) CheckInitialState(*member.x0, base.num_states(), list);
  return std::move(list).Take();
}

// Errors: InvalidArgument if M does not admit the rule. Returns OK if it was stopped before that was known; then no
// member starts.
absl::Status CheckRule(const Problem& base, SetupCache* setups, const std::stop_token& stop) {
  const StopScope scope(stop);
  try {
    return SelectRule(base.rule, SharedClass(base, setups)).status();
  } catch (const Stopped&) {
    return absl::OkStatus();
  }
}

// Returns the error of a member with the member's name.
absl::Status OfMember(Index member, const absl::Status& error) {
  std::vector<Violation> violations = ViolationsOf(error);
  if (violations.empty()) return absl::Status(error.code(), NameOf(member) + ": " + std::string(error.message()));
  for (Violation& violation : violations) {
    violation = {NameOf(member), violation.field + ": " + violation.description};
  }
  return StatusOf(violations);
}

Solution NotBegun() {
  Solution solution;
  solution.termination = Termination::kCancelled;
  solution.message = "Stopped on request before this member was started.";
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
  if (member.h) problem.outputs.h = *member.h;
  return problem;
}

std::vector<Violation> Validate(const Problem& base, const std::vector<EnsembleMember>& members,
                                const Options& options) {
  std::vector<Violation> violations = Validate(base, options);
  if (members.empty()) violations.push_back({"members", "empty; an ensemble has at least one"});
  std::set<std::string> said;  // fields of the base; not reported again for each member
  for (const Violation& violation : violations) said.insert(violation.field);
  for (Index k = 0; k < static_cast<Index>(members.size()); ++k) {
    const EnsembleMember& member = members[static_cast<std::size_t>(k)];
    for (const Violation& violation : MemberViolations(base, member, options)) {
      if (IsOwn(member, violation.field)) {
        violations.push_back({NameOf(k) + "." + violation.field, violation.description});
      } else if (!said.contains(violation.field)) {
        violations.push_back({NameOf(k), violation.field + ": " + violation.description});
      }
    }
    if (static_cast<Index>(violations.size()) > ViolationList::kMaxListed) break;
  }
  return violations;
}

absl::Status SolveEnsemble(const Problem& base, const std::vector<EnsembleMember>& members, const Options& options,
                           const MemberFinished& finished, const std::stop_token& stop, SetupCache* setups,
                           const MemberMayBegin& may_begin) {
  if (absl::Status status = StatusOf(Validate(base, members, options)); !status.ok()) return status;
  return SolveEnsembleValidated(base, members, options, finished, stop, setups, may_begin);
}

absl::Status SolveEnsembleValidated(const Problem& base, const std::vector<EnsembleMember>& members,
                                    const Options& options, const MemberFinished& finished, const std::stop_token& stop,
                                    SetupCache* setups, const MemberMayBegin& may_begin) {
  SetupCache own(kOwnCacheBytes);
  if (!setups) setups = &own;
  if (absl::Status status = CheckRule(base, setups, stop); !status.ok()) return status;
  Options of_member = options;
  of_member.num_threads = 1;
  std::mutex mutex;
  absl::Status first_error;
  ForEachOnOwnThreads(static_cast<Index>(members.size()), options.num_threads, [&](Index k) {
    if (may_begin && !may_begin(k)) return;
    absl::StatusOr<Solution> solution = NotBegun();
    if (!stop.stop_requested()) {
      Observer silent;
      const Problem problem = MemberProblem(base, members[static_cast<std::size_t>(k)]);
      solution = SolveValidated(problem, of_member, silent, stop, setups);
    }
    const std::lock_guard lock(mutex);
    if (solution.ok()) {
      finished(k, *std::move(solution));
    } else {
      first_error.Update(OfMember(k, solution.status()));
    }
  });
  return first_error;
}

}  // namespace dlcs
