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

// Solves `problem` as `options` say, telling `observer` on the way.
//
// A verdict of the mathematics (no solution, diverged, unsupported class, cancelled, ...) is a Solution with
// that termination and the trajectory up to there. Errors: InvalidArgument when `problem` or `options` break
// a rule, with every violation in the message ("field: description", one per line; Validate() gives them
// singly).
// Threads: at most options.num_threads, and the result has the same bits for any number.
// `setups`, where given, lends and keeps what solves of the same matrices share (core/setup_cache.h); the bits are the
// same without it. `resume`, where given, is a checkpoint that `observer` got from an earlier call with the same
// problem and options (but for the threads): the solve goes on from there, and the solution is whole and has the same
// bits. InvalidArgument where it is of another solve or another version of the engine. Methods that leave no
// checkpoints (wu_chen_iteration, event_driven, trials for a tolerance, inelastic impacts; and where another method may
// yet have to take over) begin anew. `stop` is looked at every ten milliseconds or so while matrices have at most some
// thousand rows: between pivots, columns of a factorization and panels of a product (core/parallel/stop_scope.h).
// `dlcs_load stops` measures it.
absl::StatusOr<Solution> Solve(const Problem& problem, const Options& options, Observer& observer,
                               std::stop_token stop, SetupCache* setups = nullptr,
                               const ResumePoint* resume = nullptr);

// The same for a problem and options in which Validate() has found nothing: it is not called again.
absl::StatusOr<Solution> SolveValidated(const Problem& problem, const Options& options, Observer& observer,
                                        std::stop_token stop, SetupCache* setups = nullptr,
                                        const ResumePoint* resume = nullptr);

}  // namespace dlcs

#endif  // DLCS_CORE_SOLVE_H_
