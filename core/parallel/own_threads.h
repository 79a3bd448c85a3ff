// SPDX-License-Identifier: Apache-2.0
// Long works side by side, each on a thread that may wait.

#ifndef DLCS_CORE_PARALLEL_OWN_THREADS_H_
#define DLCS_CORE_PARALLEL_OWN_THREADS_H_

#include <functional>

#include "core/types.h"

namespace dlcs {

// Calls body(k) once for each k of [0, count), begun in this order, on `num_threads` threads (0: one for each
// processor), the calling one included, and returns when all are done. The threads are made for this call: unlike those
// of Workers, which all solves of a process share, one that waits keeps nobody from working. What a body throws is
// thrown again here, and no further ones are begun.
void ForEachOnOwnThreads(Index count, int num_threads, const std::function<void(Index)>& body);

}  // namespace dlcs

#endif  // DLCS_CORE_PARALLEL_OWN_THREADS_H_
