// SPDX-License-Identifier: Apache-2.0
// Many solves of the same matrices.

#ifndef DLCS_CORE_ENSEMBLE_H_
#define DLCS_CORE_ENSEMBLE_H_

#include <functional>
#include <optional>
#include <stop_token>
#include <vector>

#include "absl/status/status.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"
#include "core/setup_cache.h"

namespace dlcs {

// What a member of an ensemble has in place of the base problem's.
struct EnsembleMember {
  std::optional<Vector> x0;
  std::optional<TimeFunction> f;
  std::optional<TimeFunction> g;
  std::optional<double> horizon;
  std::optional<std::vector<double>> break_points;
};

// The base problem as `member` has it.
Problem MemberProblem(const Problem& base, const EnsembleMember& member);

// Every rule that the base, the options or a member break; empty when all are sound. Fields of the base and the options
// as their own Validate() names them; those that are a member's own as members[3].x0[1]; where a member's horizon
// breaks what the base or the options hold, members[3], and what it breaks in the description. Cost: a Validate() for
// each member.
std::vector<Violation> Validate(const Problem& base, const std::vector<EnsembleMember>& members,
                                const Options& options);

// Called once for each member as it finishes, in any order, one call at a time, from any thread.
using MemberFinished = std::function<void(Index member, Solution solution)>;

// Asked before each member is begun, from the thread that would solve it, in the order of the members; may wait, for
// room for the member's solution for example. Where it says no the member is not begun, and nobody hears of it again.
using MemberMayBegin = std::function<bool(Index member)>;

// Solves `base` for each of `members`, with `options`; classes, schemes and factors are made once (`setups`, or a cache
// of its own where that is null). Each solution has the bits of its own Solve(). Errors: InvalidArgument, before
// anything is solved, when a member, the base or the options break a rule (every violation, as Validate() names it) or
// M does not admit the rule of the base. A verdict of the mathematics is that member's solution; `stop` ends the
// members that run, and the others are not begun: their solutions are kCancelled, unless `may_begin` refused them.
// Threads: options.num_threads members at the same time (0: one for each processor), each on a thread of its own, so
// that one which waits for `may_begin` or `finished` keeps nobody else's work from being done.
absl::Status SolveEnsemble(const Problem& base, const std::vector<EnsembleMember>& members, const Options& options,
                           const MemberFinished& finished, const std::stop_token& stop, SetupCache* setups = nullptr,
                           const MemberMayBegin& may_begin = {});

}  // namespace dlcs

#endif  // DLCS_CORE_ENSEMBLE_H_
