// SPDX-License-Identifier: Apache-2.0
// Time stepping: one coupled LCP per step, for any one-step scheme.

#ifndef DLCS_CORE_STEPPING_STEPPING_H_
#define DLCS_CORE_STEPPING_STEPPING_H_

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/context/coupled_step.h"
#include "core/context/progress.h"
#include "core/context/solve_context.h"
#include "core/discretization/scheme.h"
#include "core/discretization/sparse_step.h"
#include "core/lcp/lcp.h"
#include "core/stepping/newton_step.h"

namespace dlcs {

// The numbers of a matrix with a column for each of the steps that are taken between two sums of the certificate, where
// columns are long: 4 MB, or 16 MB where A is dense or steps are iterative.
inline constexpr Index kMostNumbersOfAChunk = Index{1} << 19, kMostNumbersOfALargeChunk = Index{1} << 21;

using SchemeFactory = std::function<Scheme(double step)>;

// The statistics of Newton's method over all steps.
struct NewtonAccount {
  Index iterations = 0;
  Index lcps = 0;
  Index substituted_steps = 0;    // steps that it could not solve
  Index hardest_node = 0;         // the end of the step with most iterations, ...
  std::vector<double> residuals;  // ... and its ‖F(u^k)‖_∞; empty before the first step
};

// Adds warnings about `departures` to the solution after the last step.
void WarnOf(const SelectionStats& departures, SolveContext& context);

// What advances a trajectory by steps of one length.
class SegmentStepper {
 public:
  virtual ~SegmentStepper() = default;

  // How x and y are interpolated between nodes, and the order.
  virtual const Scheme& scheme() const = 0;
  virtual Index lcps_of_a_step() const = 0;
  // The least number of steps that are worth one call.
  virtual Index least_steps() const { return 1; }

  // Prepares x and y at `time`, the start of a smooth interval, as dlcs::StartInterval() does.
  virtual bool StartInterval(SolveContext& context, double time, const Eigen::Ref<const Vector>& g,
                             Eigen::Ref<Vector> x, Eigen::Ref<Vector> y, bool& y_is_solution);

  // Takes all steps of `segment`: its sources are given, x and y hold the start in column 0, and the other columns are
  // filled. Returns kSolved, or the verdict of the LCP that failed. `solved` is the number of steps done, fewer than
  // all also if `stop` was requested (checked in every step). Adds to the counts in `departures`. The bits depend on
  // the segment alone, not on earlier calls.
  virtual LcpStatus TakeSteps(Segment& segment, const std::stop_token& stop, SelectionStats& departures,
                              Index& solved) = 0;
};

// A scheme with the solver of its coupled step LCP(q, M + K_0), K_0 = N y_after.
class Stepper final : public SegmentStepper {
 public:
  // Solver and scheme keep references to `problem`.
  Stepper(const Problem& problem, Scheme scheme, const SolutionChoice& choice);
  // The same with a given `solver` of the coupled step.
  Stepper(const Problem& problem, Scheme scheme, const SolutionChoice& choice, std::unique_ptr<LcpSolver> solver);

  // For a large sparse A: `sparse` instead of a scheme with matrices.
  Stepper(const Problem& problem, std::unique_ptr<const SparseStep> sparse, const SolutionChoice& choice,
          std::unique_ptr<LcpSolver> solver);

  // Solves the steps by Newton's method from now on, and by the coupled LCP only if that fails. Keeps a reference to
  // `account` and counts in it.
  void UseNewton(NewtonAccount& account);

  const Scheme& scheme() const override { return scheme_; }
  Index lcps_of_a_step() const override { return sparse_ && sparse_->has_stage() ? 2 : 1; }

  // A scheme with linear y stops with kInfeasible before the first step whose y is not the selected solution, since y
  // would oscillate. The first LCP starts from the basis of y in column 0. Cost: 2m² + 3mn and one warm-started LCP per
  // step.
  LcpStatus TakeSteps(Segment& segment, const std::stop_token& stop, SelectionStats& departures,
                      Index& solved) override;

 private:
  // The first stage of step j, if the scheme has one.
  LcpStatus TakeStage(const Segment& segment, const Vector& size_of_g, Index j, SelectionStats& departures);
  // A step in three parts, as in SparseStep: the terms of f in the columns 1.. of x; in x_j all other terms except that
  // of y_j; and that term.
  void StartWithSources(Segment& segment) const;
  void AddBefore(Segment& segment, Index j) const;
  void AddAfter(Segment& segment, Index j) const;

  // Both complete step j of `segment`, whose x.col(j) holds the explicit part of the scheme. SolveByNewton() does not
  // change it if it returns false.
  LcpStatus Substitute(Segment& segment, const Vector& size_of_g, Index j, SelectionStats& departures);
  bool SolveByNewton(Segment& segment, const Vector& size_of_g, Index j);

  const Problem& problem_;
  std::unique_ptr<const SparseStep> sparse_;
  Segment stage_;  // one step: the first stage of sparse_
  Matrix abs_N_;   // without sparse_
  Scheme scheme_;  // with sparse_ without matrices
  SolutionChoice choice_;
  CoupledStep coupled_;
  Vector q_;
  Vector size_;
  std::optional<NewtonStep> newton_;
  NewtonAccount* account_ = nullptr;  // with newton_
  Vector u_;
};

// Makes the stepper of a length. A stepper whose steps take seconds tells `progress` of each.
using StepperFactory = std::function<std::unique_ptr<SegmentStepper>(double step, Progress& progress)>;

// The stepper of the scheme `kind` for `step`, with scheme and solver shared (core/context/shared_setup.h).
Stepper MakeStepper(const SolveContext& context, const std::string& kind, double step,
                    const SchemeFactory& make_scheme);

// Takes all steps of the grid with the schemes of `make_scheme`, cached under the name `kind`. If `newton` is not null,
// steps are solved by Newton's method, whose statistics it receives. Returns whether the end was reached; otherwise the
// solution says why not.
bool StepThroughGrid(SolveContext& context, const std::string& kind, const SchemeFactory& make_scheme,
                     NewtonAccount* newton = nullptr);
// The same with the steppers that are made for each length of step.
bool StepThroughGrid(SolveContext& context, const StepperFactory& make_stepper);

}  // namespace dlcs

#endif  // DLCS_CORE_STEPPING_STEPPING_H_
