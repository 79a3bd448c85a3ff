// SPDX-License-Identifier: Apache-2.0
// Measures how well a trajectory satisfies a nonlinear problem, segment by segment.

#ifndef DLCS_CORE_NONLINEAR_NONLINEAR_CERTIFICATE_H_
#define DLCS_CORE_NONLINEAR_NONLINEAR_CERTIFICATE_H_

#include <vector>

#include "core/discretization/scheme.h"
#include "core/discretization/segment.h"
#include "core/nonlinear/functions.h"
#include "core/problem/solution.h"

namespace dlcs {

// Raises `certificate` (all NaN before the first segment) by the nodes and midpoints of `segment`, with f and g
// evaluated anew at x and y. segment.f holds the sources s = f - W x that the states follow by `scheme`; `times` the
// node times. Returns g(t, x, y) at the nodes, a column for each. At midpoints x solves x' = W x + s with s linear over
// the step, and y is linear. Not for the inner loop.
Matrix AddToCertificate(NonlinearFunctions& functions, const Scheme& scheme, const Matrix& W, const Segment& segment,
                        const std::vector<double>& times, Certificate& certificate);

}  // namespace dlcs

#endif  // DLCS_CORE_NONLINEAR_NONLINEAR_CERTIFICATE_H_
