// SPDX-License-Identifier: Apache-2.0
// The work of iterative steps.

#ifndef DLCS_CORE_STEPPING_ITERATIVE_ACCOUNT_H_
#define DLCS_CORE_STEPPING_ITERATIVE_ACCOUNT_H_

#include "core/types.h"

namespace dlcs {

// Sums over all steps.
struct IterativeAccount {
  Index linear_iterations = 0;
  Index set_changes = 0;   // of active sets
  Index direct_steps = 0;  // that were solved by sparse factors instead
};

}  // namespace dlcs

#endif  // DLCS_CORE_STEPPING_ITERATIVE_ACCOUNT_H_
