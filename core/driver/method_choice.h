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
  // Why the problem cannot be solved, or not by the method that the options name; empty if it can.
  std::string refusal;
  // The system has relative degree two, and the options ask for inelastic impacts.
  bool inelastic_impact = false;
  // time_stepping with two stages of second order, where the engine chose sparse steps
  // (core/discretization/sparse_step.h).
  bool two_stages = false;
  // wu_chen_iteration: φ-functions integrate all of A, and contours none of it. The same iteration without the error of
  // its contours, which is known from the difference.
  bool without_contours = false;
  // Constraints of relative degree two and more, if others have degree one or zero
  // (core/matrix_classes/relative_degree.h) and y is not a function of x. The solution is valid as long as they do not
  // become active.
  std::vector<Index> impulsive_rows = {};
  std::string impulsive = {};  // DescribeRows() of impulsive_rows
  // The same of the constraints that y never acts on, not even on its own: where w_i is zero, y_i may be any number.
  std::string unreached = {};
};

// Returns the method of the options, or chooses one:
// - event_driven, if an error tolerance is set and modes are cheap to compute;
// - otherwise, for P- and Z-matrices, exponential_integrator with exp-PL, or with sixteen threads and more
//   laplace_iteration, which converges to the same answer;
// - otherwise exponential_integrator with exp-PC.
//
// Refuses relative degree two and more (M = 0 and N B = 0; degree two only if the options do not ask for inelastic
// impacts); the iterations, Newton's method and averaged y if y is not a Lipschitz function of x; and event_driven for
// selections that a mode does not determine (hidden least element, least norm, minimizer).
MethodChoice ChooseMethod(const Problem& problem, const Options& options, const MatrixClass& matrix_class,
                          Selection selection);

}  // namespace dlcs

#endif  // DLCS_CORE_DRIVER_METHOD_CHOICE_H_
