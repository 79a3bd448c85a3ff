// SPDX-License-Identifier: Apache-2.0
// The states that follow from given y and f.

#ifndef DLCS_CORE_DISCRETIZATION_PROPAGATION_H_
#define DLCS_CORE_DISCRETIZATION_PROPAGATION_H_

#include "core/discretization/scheme.h"
#include "core/discretization/segment.h"

namespace dlcs {

// Fills the columns 1.. of x of `segment` from its first column, y and f, by the recursion of an exp-PL `scheme`. All
// four hold segment.steps + 1 columns.
void Propagate(const Scheme& scheme, Segment& segment);

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_PROPAGATION_H_
