// SPDX-License-Identifier: Apache-2.0
// The contour that a set of options asks for.

#ifndef DLCS_CORE_LAPLACE_CONTOUR_CHOICE_H_
#define DLCS_CORE_LAPLACE_CONTOUR_CHOICE_H_

#include "core/laplace/contour.h"
#include "core/options.h"

namespace dlcs {

// The contour of paper_iteration: Theorem 2.2's parameters, with those that `options` give in their place.
Contour ContourOf(const Options& options);

}  // namespace dlcs

#endif  // DLCS_CORE_LAPLACE_CONTOUR_CHOICE_H_
