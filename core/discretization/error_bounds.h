// SPDX-License-Identifier: Apache-2.0
// What the components of a computed vector may be off by.

#ifndef DLCS_CORE_DISCRETIZATION_ERROR_BOUNDS_H_
#define DLCS_CORE_DISCRETIZATION_ERROR_BOUNDS_H_

#include "core/types.h"

namespace dlcs {

// Bounds of the errors of each component.
struct ErrorBounds {
  Vector truncation;  // every error that a better computation would avoid
  Vector rounding;    // what an ulp of every term may do
};

// The truncation also with the signs that it has, since contributions may cancel.
struct SignedErrorBounds : ErrorBounds {
  Vector with_signs;

  static SignedErrorBounds Zero(Index size) { return {{Vector::Zero(size), Vector::Zero(size)}, Vector::Zero(size)}; }
  // The bound, unless the signs leave no more than rounding, as in a state that is zero by symmetry.
  Vector Truncation() const {
    return (with_signs.array().abs() <= rounding.array())
        .select(with_signs.cwiseAbs().cwiseMin(truncation), truncation);
  }
};

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_ERROR_BOUNDS_H_
