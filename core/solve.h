// SPDX-License-Identifier: Apache-2.0
// The one entry point of the engine.

#ifndef DLCS_CORE_SOLVE_H_
#define DLCS_CORE_SOLVE_H_

#include <stop_token>

#include "absl/status/statusor.h"
#include "core/problem/observer.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs {

class SetupCache;

// Solves `problem` with `options`, reporting events to `observer`.
//
// If there is no solution, or the method fails (diverged, unsupported class, cancelled, ...), the result is a Solution
// with that termination and the trajectory up to that time, not an error. Errors: InvalidArgument when `problem` or
// `options` break a rule, with every violation: one per line in the message, and singly by ViolationsOf()
// (core/problem/violation_list.h).
// Threads: at most options.num_threads, and the result has the same bits for any number. `setups` may be null; it
// shares set-ups between solves of the same matrices (core/setup_cache.h), without changing the bits. `resume` may be
// null, or a checkpoint that `observer` received in an earlier call with the same problem and options (the number of
// threads may differ): the solve resumes there, and the solution is complete and has the same bits. InvalidArgument if
// it belongs to another solve or another version of the engine. Methods without checkpoints (wu_chen_iteration,
// event_driven, trials for a tolerance, inelastic impacts, and solves that another method may have to replace) start
// again from 0. `stop` is checked about every ten milliseconds, if matrices have at most some thousand rows: between
// pivots, columns of a factorization and panels of a product (core/parallel/stop_scope.h). `dlcs_load stops` measures
// the delay.
absl::StatusOr<Solution> Solve(const Problem& problem, const Options& options, Observer& observer, std::stop_token stop,
                               SetupCache* setups = nullptr, const ResumePoint* resume = nullptr);

// The same for a problem and options that have passed Validate() already.
absl::StatusOr<Solution> SolveValidated(const Problem& problem, const Options& options, Observer& observer,
                                        std::stop_token stop, SetupCache* setups = nullptr,
                                        const ResumePoint* resume = nullptr);

}  // namespace dlcs

#endif  // DLCS_CORE_SOLVE_H_
