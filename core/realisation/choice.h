// SPDX-License-Identifier: Apache-2.0
// How x0, f and y are to be carried to N x.

#ifndef DLCS_CORE_REALISATION_CHOICE_H_
#define DLCS_CORE_REALISATION_CHOICE_H_

#include <memory>
#include <string>

#include "core/options.h"
#include "core/problem.h"
#include "core/realisation/realisation.h"

namespace dlcs {

class SetupCache;

struct RealisationChoice {
  std::shared_ptr<RealisedSystem> system;  // null: dense matrices
  RealisationRecord record;                // before the solve
  std::string refusal;                     // why none serves; empty where one does
};

// For a solve by `method`. Left to itself: dense matrices where A is dense or small; else the form that its structure has; else
// dense ones again as far as their matrix functions are affordable, and where the method is left open too, not beside many
// constraints: time stepping with sparse factors serves there. `setups`, where given, lends and keeps what solves of the same
// matrices share, and must outlive the choice.
RealisationChoice ChooseRealisation(const Problem& problem, const Options& options, Method method,
                                    SetupCache* setups = nullptr);

}  // namespace dlcs

#endif  // DLCS_CORE_REALISATION_CHOICE_H_
