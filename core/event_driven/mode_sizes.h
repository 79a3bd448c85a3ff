// SPDX-License-Identifier: Apache-2.0
// The sizes that the components of a solution stand beside in its modes.

#ifndef DLCS_CORE_EVENT_DRIVEN_MODE_SIZES_H_
#define DLCS_CORE_EVENT_DRIVEN_MODE_SIZES_H_

#include "core/context/sizes.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs {

// R of core/context/sizes.h for `solution`, whose errors are estimated: of the modes that event_driven was in, and of
// that at the end for methods that form none. For dense problems; own sizes for others. Cost: the factorizations of
// each mode.
AllSizesBeside SizesBesideOf(const Problem& problem, Selection selection, const Solution& solution);

// JudgeComponents() with these sizes.
void JudgeBesideModes(const Problem& problem, Selection selection, const Options& options, Solution& solution);

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_MODE_SIZES_H_
