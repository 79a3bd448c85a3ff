// SPDX-License-Identifier: Apache-2.0
// Many solves of the same matrices.

#ifndef DLCS_CORE_ENSEMBLE_H_
#define DLCS_CORE_ENSEMBLE_H_

#include <functional>
#include <optional>
#include <stop_token>
#include <vector>

#include "absl/status/status.h"
#include "core/options.h"
#include "core/problem.h"
#include "core/setup_cache.h"
#include "core/solution.h"

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

// Called once for each member as it finishes, in any order, one call at a time, from any thread.
using MemberFinished = std::function<void(Index member, Solution solution)>;

// Solves `base` for each of `members`, with `options`; classes, schemes and factors are made once (`setups`, or a cache of its own
// where that is null). Each solution has the bits of its own Solve().
// Errors: InvalidArgument, before anything is solved, when a member, the base or the options break a rule: every violation, its
// field as members[3].x0[1] where it is a member's own. A verdict of the mathematics is that member's solution; `stop` ends the
// members that run, and the others are not begun: their solutions are kCancelled.
// Threads: options.num_threads members at the same time, each on one thread.
absl::Status SolveEnsemble(const Problem& base, const std::vector<EnsembleMember>& members, const Options& options,
                           const MemberFinished& finished, const std::stop_token& stop, SetupCache* setups = nullptr);

}  // namespace dlcs

#endif  // DLCS_CORE_ENSEMBLE_H_
