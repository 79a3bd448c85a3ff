// SPDX-License-Identifier: Apache-2.0
// Iterative steps whose rows are distributed over a team.

#ifndef DLCS_CORE_STEPPING_DISTRIBUTED_STEPS_H_
#define DLCS_CORE_STEPPING_DISTRIBUTED_STEPS_H_

#include <string>

#include "core/context/solve_context.h"
#include "core/discretization/step_rule.h"
#include "core/stepping/iterative_account.h"

namespace dlcs {

class DistributedSteps {
 public:
  virtual ~DistributedSteps() = default;

  // IterativeStep::WhyNot(), the same in all processes.
  virtual std::string WhyNot(const Problem& problem) = 0;

  // Takes all steps of the grid of `context`, whose problem is served by core/stepping/iterative_step.h, and fills
  // solution, recorder and certificate as StepThroughGrid() does, the same in all processes. Returns whether the end
  // was reached.
  virtual bool Take(SolveContext& context, SparseRule rule, IterativeAccount& account) = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_STEPPING_DISTRIBUTED_STEPS_H_
