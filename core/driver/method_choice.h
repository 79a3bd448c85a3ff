// SPDX-License-Identifier: Apache-2.0
// Which method solves a problem, and why.

#ifndef DLCS_CORE_DRIVER_METHOD_CHOICE_H_
#define DLCS_CORE_DRIVER_METHOD_CHOICE_H_

#include <string>
#include <vector>

#include "core/matrix_classes/matrix_class.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"

namespace dlcs {

struct MethodChoice {
  Method method = Method::kAuto;
  std::string reason;
  // Why the problem, or the method that was asked for, cannot be served; empty when it can.
  std::string refusal;
  // Relative degree two, with inelastic impacts asked for.
  bool inelastic_impact = false;
  // time_stepping in two stages of second order, where steps were chosen and not asked for
  // (core/discretization/sparse_step.h).
  bool two_stages = false;
  // Constraints of relative degree two and more beside others of degree one or zero
  // (core/matrix_classes/relative_degree.h), where y is no function of x: served, as long as they do not become active.
  std::vector<Index> impulsive_rows = {};
  std::string impulsive = {};  // DescribeRows() of them
};

// Takes the method of the options, or chooses: event_driven where an error is asked for and modes are cheap to make;
// else for P- and Z-matrices exponential_integrator with exp-PL or, with sixteen threads and more, laplace_iteration,
// which converges to the same answer; exponential_integrator with exp-PC for all others. Refuses relative degree two
// and more (M = 0 and N B = 0; degree two only where inelastic impacts are not asked for), the iterations, Newton's
// method and averaged y where y is no Lipschitz function of x, and event_driven for solutions that a mode does not
// determine (hidden least elements, least norm, minimizers).
MethodChoice ChooseMethod(const Problem& problem, const Options& options, const MatrixClass& matrix_class,
                          Selection selection);

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_METHOD_CHOICE_H_
