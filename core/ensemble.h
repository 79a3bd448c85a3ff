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

// The fields of the base problem that a member of an ensemble replaces.
struct EnsembleMember {
  std::optional<Vector> x0;
  std::optional<TimeFunction> f;
  std::optional<TimeFunction> g;
  std::optional<double> horizon;
  std::optional<std::vector<double>> break_points;
  std::optional<TimeFunction> h = {};  // of the outputs
};

// The base problem with the fields of `member` in place of its own.
Problem MemberProblem(const Problem& base, const EnsembleMember& member);

// Every rule that the base, the options or a member break; empty if all are valid. Fields of the base and the options
// are named as in their own Validate(), fields of a member as members[3].x0[1]. If the horizon of a member contradicts
// the base or the options, the field is members[3] and the description says what it contradicts. Cost: one Validate()
// for each member.
std::vector<Violation> Validate(const Problem& base, const std::vector<EnsembleMember>& members,
                                const Options& options);

// Called once for each member as it finishes, in any order, one call at a time, from any thread.
using MemberFinished = std::function<void(Index member, Solution solution)>;

// Called before each member is started, from the thread that would solve it, in the order of the members. It may block,
// for example until there is memory for the solution. If it returns false, the member is not solved and not reported.
using MemberMayBegin = std::function<bool(Index member)>;

// Solves `base` for each of `members` with `options`. Classes, schemes and factors are computed once, in `setups` or in
// an own cache if that is null. Each solution has the same bits as from Solve(). If a member has no solution, its
// Solution says so. `stop` ends the running members and prevents others from starting; their solutions are kCancelled,
// except those that `may_begin` refused. Errors: InvalidArgument before anything is solved, if a member, the base or
// the options break a rule (with every violation, as named by Validate()), or if M does not admit the rule of the base.
// Threads: options.num_threads members at the same time (0: one per processor), each on its own thread, so that a
// member that waits in `may_begin` or `finished` does not block other work.
absl::Status SolveEnsemble(const Problem& base, const std::vector<EnsembleMember>& members, const Options& options,
                           const MemberFinished& finished, const std::stop_token& stop, SetupCache* setups = nullptr,
                           const MemberMayBegin& may_begin = {});

// The same for an ensemble in which Validate() has found nothing: it is not called again.
absl::Status SolveEnsembleValidated(const Problem& base, const std::vector<EnsembleMember>& members,
                                    const Options& options, const MemberFinished& finished, const std::stop_token& stop,
                                    SetupCache* setups = nullptr, const MemberMayBegin& may_begin = {});

}  // namespace dlcs

#endif  // DLCS_CORE_ENSEMBLE_H_
