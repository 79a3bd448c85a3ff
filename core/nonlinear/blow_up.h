// SPDX-License-Identifier: Apache-2.0
// Whether the state of a nonlinear system grows without bound in finite time.

#ifndef DLCS_CORE_NONLINEAR_BLOW_UP_H_
#define DLCS_CORE_NONLINEAR_BLOW_UP_H_

#include <optional>

#include "core/matrix_classes/matrix_class.h"
#include "core/nonlinear/functions.h"
#include "core/types.h"

namespace dlcs {

struct BlowUp {
  double time = 0;
  Index state = 0;   // the one that grew most
  double value = 0;  // of it, at `time`
};

// Follows x from (t, x, y) by the classical Runge-Kutta method with steps in which it grows by a few percent, up to
// 1e30 times its size. That happens in finite time where the time for the next few percent shrinks meanwhile; in
// exponential growth it stays the same. Absent where x does not grow so, up to `horizon`, or y is not found. Cost: some
// thousand values of f and solves for y.
std::optional<BlowUp> FindBlowUp(NonlinearFunctions& functions, Selection selection, double t, double horizon,
                                 const Vector& x, const Vector& y);

}  // namespace dlcs

#endif  // DLCS_CORE_NONLINEAR_BLOW_UP_H_
