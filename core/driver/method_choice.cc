// SPDX-License-Identifier: Apache-2.0

#include "core/driver/method_choice.h"

#include <algorithm>

#include "core/format_number.h"
#include "core/matrix_classes/minor_classes.h"
#include "core/matrix_classes/relative_degree.h"
#include "core/parallel/parallel.h"
#include "core/problem/mass_matrix.h"
#include "core/problem/solution.h"

namespace dlcs {
namespace {

std::string WhyLipschitz(Selection selection) {
  if (selection == Selection::kUnique) return "M is a P-matrix, so y is a Lipschitz function of x";
  return std::string("M is a ") + (selection == Selection::kLeastElement ? "" : "hidden ") +
         "Z-matrix, whose least-element solution is Lipschitz in x";
}

// The reason why y is not known as a function of x between its jumps; empty if it is. The Jacobians of its pieces must
// be known. They are for a nondegenerate M with any selection (Theorem 3.2 of [Chen & Xiang]), and for a positive
// semidefinite M with the least norm.
std::string WhyNotPiecewise(const Matrix& M, const MatrixClass& matrix_class, Selection selection) {
  if (selection == Selection::kAny) {
    return " needs y to be a Lipschitz function of x (M a P-matrix, or a Z-matrix with the least element), and M is: " +
           matrix_class.description + ".";
  }
  if (selection == Selection::kLeastNorm && matrix_class.positive_semidefinite.yes()) return "";
  const Fact nondegenerate = ClassifyByMinors(M).nondegenerate;
  if (nondegenerate.yes()) return "";
  return " needs to know the pieces of y as a function of x, and those of " + std::string(SelectionName(selection)) +
         " are known for nondegenerate M only: " + nondegenerate.why + ".";
}

// Remark 3.1 of [Wu & Chen]: the iteration detects a jump of y if y changes faster than its steepest piece allows.
std::string WhyNotIterated(const Matrix& M, const MatrixClass& matrix_class, Selection selection) {
  const std::string why = WhyNotPiecewise(M, matrix_class, selection);
  if (!why.empty() || M.rows() <= kMaxSolutionEnumeration) return why;
  return " has to detect where " + std::string(SelectionName(selection)) +
         " jumps, from all principal submatrices of M: n = " + std::to_string(M.rows()) + ", which must be at most " +
         std::to_string(kMaxSolutionEnumeration) + ".";
}

// The iteration solves each LCP about ten times, but in parallel; time stepping solves it once, one step after the
// other. With this many threads the iteration is faster.
constexpr int kThreadsForIteration = 16;

// Whether modes can follow the selection. A mode ends when a component of y or w vanishes. The other selections may
// also change when another solution becomes the better one, without such an event.
bool HasModes(Selection selection) {
  return selection == Selection::kUnique || selection == Selection::kLeastElement || selection == Selection::kAny ||
         selection == Selection::kHistory;
}

// Each mode needs a Schur form. Up to this size few steps of high order are cheaper than trials with steps of second
// order, for every error. Measured on tests/cases and the examples of the papers (tests/bench).
constexpr Index kMaxStatesOfModes = 200;

bool PrefersEvents(const Problem& problem, const Options& options, Selection selection) {
  return options.error_tolerance > 0 && HasModes(selection) && problem.num_states() <= kMaxStatesOfModes &&
         !options.inelastic_impact;
}

std::vector<std::optional<int>> DegreesOf(const Problem& problem) {
  if (!problem.has_mass()) return RelativeDegrees(problem.A, problem.B, problem.N, problem.M);
  // As a rule there is one integration. To see that, solves with E are needed for the columns of B only.
  const SparseMatrix no_A(problem.num_states(), problem.num_states());
  auto degrees = RelativeDegrees(StructuredMatrix(no_A), StructuredMatrix(SolveMass(problem, problem.B.Dense())),
                                 problem.N, problem.M);
  const bool all_known = std::all_of(degrees.begin(), degrees.end(), [](const auto& degree) { return !!degree; });
  if (all_known || !problem.A.FitsDense()) return degrees;
  const Problem multiplied = WithoutMass(problem);
  return RelativeDegrees(multiplied.A, multiplied.B, multiplied.N, multiplied.M);
}

// Constraints that y reaches through two integrations and more need impulses.
void JudgeRelativeDegree(const Problem& problem, const Options& options, bool zero, MethodChoice& choice) {
  const auto degrees = DegreesOf(problem);
  if (const std::vector<Index> unreached = UnreachedRows(degrees); !unreached.empty())
    choice.unreached = DescribeRows(unreached, degrees);
  const std::vector<Index> rows = ImpulsiveRows(degrees);
  if (rows.empty()) return;
  const int least =
      *degrees[*std::min_element(rows.begin(), rows.end(), [&](Index i, Index j) { return degrees[i] < degrees[j]; })];
  const bool all = zero && std::none_of(degrees.begin(), degrees.end(), [](const auto& degree) { return degree == 1; });
  if (!all) {
    choice.impulsive_rows = rows;
    choice.impulsive = DescribeRows(rows, degrees);
  } else if (least == 2 && options.inelastic_impact) {
    choice.inelastic_impact = true;
    choice.refusal.clear();
    choice.method = Method::kTimeStepping;
    choice.reason = "relative degree two, solved as inelastic impact, as the options say";
    if (options.method != Method::kAuto && options.method != Method::kTimeStepping) {
      choice.refusal = std::string("Inelastic impacts are solved by time-stepping only, but the method is set to ") +
                       MethodName(options.method) + ".";
    }
  } else {
    choice.refusal = "The system has relative degree " + std::to_string(least) +
                     " (M = 0 and N B = 0): y acts on N x + g only through " + std::to_string(least) +
                     " integrations, so solutions need impulses, and y of time stepping would diverge like 1/h. "
                     "Model the impact explicitly, or add compliance or damping so that M or N B is not zero";
    choice.refusal +=
        least == 2
            ? "; or allow inelastic impacts (--inelastic-impact), an additional law that is not part of the system."
            : ".";
    if (rows.size() > 1) choice.refusal += " The constraints are " + DescribeRows(rows, degrees) + ".";
  }
}

}  // namespace

MethodChoice ChooseMethod(const Problem& problem, const Options& options, const MatrixClass& matrix_class,
                          Selection selection) {
  MethodChoice choice;
  const bool lipschitz = IsAlwaysLipschitz(selection);
  const bool iterates = options.method == Method::kLaplaceIteration || options.method == Method::kWuChenIteration;

  if (options.method != Method::kAuto) {
    choice.method = options.method;
    choice.reason = "asked for";
    if (choice.method == Method::kEventDriven && options.has_grid())
      choice.reason += ". It chooses its steps: those that are given are output times only";
  } else if (selection == Selection::kHistory) {
    choice.method = Method::kEventDriven;
    choice.reason = "of several solutions the one is followed that continues the one before";
  } else if (PrefersEvents(problem, options, selection)) {
    choice.method = Method::kEventDriven;
    choice.reason = "for an error of " + FormatNumber(options.error_tolerance) +
                    " a few steps of high order between switching times are enough";
  } else if (lipschitz) {
    const int threads = Workers(options.num_threads).max_threads();
    choice.method = threads >= kThreadsForIteration ? Method::kLaplaceIteration : Method::kExponentialIntegrator;
    choice.reason = WhyLipschitz(selection) + "; on " + std::to_string(threads) +
                    (threads == 1 ? " thread" : " threads") +
                    (threads >= kThreadsForIteration ? " the iteration is expected to be faster than stepping"
                                                     : " stepping is faster than the iteration, with the same answer");
  } else if (selection != Selection::kAny) {
    choice.method = Method::kExponentialIntegrator;
    choice.reason = std::string(SelectionName(selection)) +
                    " need not be a Lipschitz function of x: each step is solved for x and y together";
  } else {
    choice.method = Method::kExponentialIntegrator;
    choice.reason = "M is " + matrix_class.description +
                    ": it does not make y a function of x, and each step is solved for x and y together";
  }

  if (iterates && !lipschitz) {
    const std::string why_not = WhyNotIterated(problem.M, matrix_class, selection);
    if (why_not.empty()) {
      choice.reason += "; " + std::string(SelectionName(selection)) +
                       " is piecewise linear in N x + g: the solve ends where it jumps (Remark 3.1 of Wu & Chen)";
    } else {
      choice.refusal = MethodName(options.method) + why_not + " Use exponential-integrator or time-stepping.";
    }
  }
  if (choice.method == Method::kEventDriven && !HasModes(selection)) {
    choice.refusal =
        std::string("event-driven follows an active set until a component of y or w vanishes, and ") +
        SelectionName(selection) +
        " may change where none does, when another solution becomes the better one. Use exponential-integrator or "
        "time-stepping.";
  }
  if (selection == Selection::kHistory && choice.method != Method::kEventDriven) {
    choice.refusal = std::string("The rule history follows one of several solutions while it lasts, and ") +
                     MethodName(choice.method) + " may step from one to another. Use event-driven.";
  }
  if (choice.method == Method::kTimeStepping && !lipschitz && options.average_y) {
    choice.refusal =
        "Averaging y needs y to be a Lipschitz function of x (M a P-matrix, or a Z-matrix with the least "
        "element), and M is: " +
        matrix_class.description + ". Otherwise y oscillates from step to step (y⁺ = -y + ...). Do not average y.";
  } else if (choice.method == Method::kTimeStepping && !lipschitz && options.step_solver == StepSolver::kNewton) {
    const std::string why_not = WhyNotPiecewise(problem.M, matrix_class, selection);
    if (!why_not.empty()) choice.refusal = "Newton's method (3.3)" + why_not + " Solve the steps by substitution.";
  }
  if (matrix_class.zero_row && !lipschitz) JudgeRelativeDegree(problem, options, matrix_class.zero, choice);
  return choice;
}

}  // namespace dlcs
