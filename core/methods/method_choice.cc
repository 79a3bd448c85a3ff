// SPDX-License-Identifier: Apache-2.0

#include "core/methods/method_choice.h"

#include <optional>

#include "core/analysis/minor_classes.h"
#include "core/analysis/relative_degree.h"
#include "core/solution.h"

namespace dlcs {
namespace {

std::string WhyLipschitz(Selection selection) {
  if (selection == Selection::kUnique) return "M is a P-matrix, so y is a Lipschitz function of x";
  return std::string("M is a ") + (selection == Selection::kLeastElement ? "" : "hidden ") +
         "Z-matrix, whose least-element solution is Lipschitz in x";
}

// Remark 3.1 of [Wu & Chen]: y is piecewise linear with pieces no steeper than a known slope, so that the iteration can
// see where it is not continuous: nondegenerate M with any selection, positive semidefinite M with the least norm.
bool MayIterate(const Matrix& M, const MatrixClass& matrix_class, Selection selection) {
  if (selection == Selection::kAny || M.rows() > kMaxSolutionEnumeration) return false;
  if (selection == Selection::kLeastNorm && matrix_class.positive_semidefinite.yes()) return true;
  return ClassifyByMinors(M).nondegenerate.yes();
}

// Theorem 3.2 of [Chen & Xiang]: the Jacobian of any continuous selection is at hand where M is nondegenerate.
bool NewtonMayServe(const Matrix& M, Selection selection) {
  return selection != Selection::kAny && M.rows() <= kMaxSolutionEnumeration && ClassifyByMinors(M).nondegenerate.yes();
}

}  // namespace

MethodChoice ChooseMethod(const Problem& problem, const Options& options, const MatrixClass& matrix_class,
                          Selection selection) {
  MethodChoice choice;
  const bool lipschitz = IsAlwaysLipschitz(selection);
  const bool iterates = options.method == Method::kLaplaceIteration || options.method == Method::kPaperIteration;

  if (options.method != Method::kAuto) {
    choice.method = options.method;
    choice.reason = "asked for";
  } else if (lipschitz) {
    choice.method = Method::kLaplaceIteration;
    choice.reason = WhyLipschitz(selection);
  } else if (selection != Selection::kAny) {
    choice.method = Method::kExponentialMarch;
    choice.reason = std::string(SelectionName(selection)) +
                    " need not be a Lipschitz function of x: each step is solved coupled, and exp-PC steps take any class";
  } else {
    choice.method = Method::kExponentialMarch;
    choice.reason = "M (" + matrix_class.description +
                    ") does not make y a function of x: each step is solved coupled, and exp-PC steps take any class";
  }

  if (iterates && !lipschitz && MayIterate(problem.M, matrix_class, selection)) {
    choice.reason += "; " + std::string(SelectionName(selection)) +
                     " is piecewise linear in N x + g: the solve ends where it jumps (Remark 3.1 of Wu & Chen)";
  } else if (iterates && !lipschitz) {
    choice.refusal = std::string(MethodName(options.method)) +
                     " needs y to be a Lipschitz function of x (M a P-matrix, or a Z-matrix with the least "
                     "element), and M is: " + matrix_class.description +
                     ". Use exponential-march or time-stepping.";
  }
  if (choice.method == Method::kTimeStepping && !lipschitz) {
    const std::string no_function = " needs y to be a Lipschitz function of x (M a P-matrix, or a Z-matrix with the "
                                    "least element), and M is: " + matrix_class.description + ". ";
    if (options.average_y) {
      choice.refusal = "Averaging y" + no_function +
                       "Elsewhere y rings from step to step (y⁺ = -y + ...) and never settles. Do not average y.";
    } else if (options.step_solver == StepSolver::kNewton && !NewtonMayServe(problem.M, selection)) {
      choice.refusal = "Newton's method (3.3)" + no_function + "Solve the steps by substitution.";
    }
  }
  if (matrix_class.zero && !lipschitz) {
    const std::optional<int> degree = RelativeDegree(problem.A, problem.B, problem.N);
    if (degree == 2 && options.inelastic_impact) {
      choice.inelastic_impact = true;
      choice.refusal.clear();
      choice.method = Method::kTimeStepping;
      choice.reason = "relative degree two, solved as inelastic impact, as asked for";
    } else if (degree && *degree >= 2) {
      choice.refusal = "The system has relative degree " + std::to_string(*degree) +
                       " (M = 0 and N B = 0): y acts on N x + g only through " + std::to_string(*degree) +
                       " integrations, so solutions need impulses and time stepping diverges like 1/h in silence. "
                       "Model the impact explicitly, or add compliance or damping so that M or N B is not zero";
      choice.refusal += degree == 2 ? "; or ask for inelastic impacts, a law that the system itself does not hold." : ".";
    }
  }
  return choice;
}

}  // namespace dlcs
