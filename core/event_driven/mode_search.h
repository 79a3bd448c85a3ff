// SPDX-License-Identifier: Apache-2.0
// Finds the mode in which a solution continues from a state.

#ifndef DLCS_CORE_EVENT_DRIVEN_MODE_SEARCH_H_
#define DLCS_CORE_EVENT_DRIVEN_MODE_SEARCH_H_

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "core/discretization/step_cache.h"
#include "core/discretization/step_sources.h"
#include "core/event_driven/mode.h"
#include "core/event_driven/mode_step.h"
#include "core/lcp/lcp.h"
#include "core/linalg/balance.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/problem/problem.h"

namespace dlcs {

// Finds active sets, and caches their modes.
//
// The active set after t is that of y at t + h as h → 0: if y_i and w_i both vanish at t, their derivatives decide, and
// then higher derivatives. The Laplace transforms of y and w decide all of that at once, as s → ∞: with s = 1/h
//
//     0 <= y ⟂ N (I - hA)⁻¹ (x + h f̂ + h B y) + ĝ + M y >= 0,    f̂ = s ∫ e^{-sτ} f(t + τ) dτ, and ĝ alike,
//
// is the rational complementarity problem, here for an h so short that nothing else happens, and so long that
// derivatives are larger than rounding. Fast states settle within h. The basis of its solution is a proposal; the
// caller has to check how long it lasts. Source: [Heemels 2000] W. P. M. H. Heemels, J. M. Schumacher, S. Weiland. The
// rational complementarity problem. Linear Algebra and its Applications 294.
//
// Where one guard ended the mode before, the first proposal has its pair on the other side. As series in h the guard
// that takes its place is minus that guard, divided by the pivot det M(s)_S' / det M(s)_S, and rises where that is
// positive. So only the signs of the other pairs are looked at, at one h, without an LCP. Where no guard fell, what
// followed the last active set before is looked at in the same way: gates open and close in cycles.
class ModeSearch {
 public:
  // Keeps references.
  ModeSearch(const Problem& problem, Selection selection, SourceSampler& sources);

  struct Proposal {
    LcpStatus verdict = LcpStatus::kPivotLimit;
    bool kept_selection = true;  // as LcpSolver::KeptSelection()
    const Mode* mode = nullptr;  // null if the LCP failed or the basis does not determine y
  };
  // Searches from the state `x` at `t`, whose rounding errors are `x_noise`. `scale` is the time scale of the system,
  // `longest` the time to the next break point. Attempt 0 has no LCP (above), and not always a proposal. Each other
  // `attempt` below kAttempts uses another h: first shorter ones, for modes that end soon, down to those of the fastest
  // states, then longer ones, to skip modes that are shorter than rounding. The LCP starts from the last active set or
  // from that of GuessAfter(). `sizes` are those of the states so far and of the sources.
  static constexpr int kAttempts = 9;
  Proposal Find(double t, const Eigen::Ref<const Vector>& x, const Vector& x_noise, const DataSizes& sizes,
                double scale, double longest, int attempt);

  // The mode just behind `t`, with the arguments of Find(): the shortest h by which all pairs are larger than their
  // rounding. What h that are shorter yet would show differs from it by no more than rounding, and longer ones look
  // beyond the next event. Pairs that no h shows are taken as three h in a row see them. Cost: some ten LCPs.
  Proposal FindBehind(double t, const Eigen::Ref<const Vector>& x, const Vector& x_noise, const DataSizes& sizes,
                      double scale, double longest);

  // Until a mode has lasted, searches are at 0, where x0 is exact and g is `g`. If some w_i is driven away from zero, a
  // solution begins on each side of it, and a look ahead does not see on which side w_i is. So a proposal that the
  // signs at 0 contradict is replaced by the active set of a solution of LCP(N x0 + g, M), if no pair vanishes in it.
  // Does nothing where y is a function of x, and for kHistory.
  void BeginAt(const Vector& x0, const Vector& g);

  // The next search starts from the active set of `mode` with `guard`, the index whose guard ended it, added or
  // removed. With kHistory it is the solution where it solves the LCP to rounding.
  void GuessAfter(const Mode& mode, Index guard);
  // The next search is at a time at which no guard fell.
  void ForgetGuess();

  // The mode in which the guard that fell last has changed sides, for where no LCP has a solution that lasts: once
  // after each event and each mode that a guard ended at once. Without kHistory only modes that constrain the state: of
  // a singular M only the product h N B tells pairs apart, and it is lost in M + h N B where h is short enough for fast
  // states. Null if there is none, and after twice as many as there are pairs of which none lasted.
  const Mode* Flipped(const DataSizes& sizes);

  // With the selection kHistory every search starts from the active set of the last mode that lasted: `mode` did. A
  // guess of GuessAfter() is taken until then where it is a solution itself, to rounding.
  void Lasted(const Mode& mode);

  // The mode of `active`, kept; null where it has none.
  const Mode* ModeOf(const std::vector<Index>& active, const DataSizes& sizes);

  // For steps of this length in a mode of ModeOf(). The last few are kept: with gates most lengths recur to the last
  // bit, since differences of times are multiples of the rounding of times.
  std::shared_ptr<const ModeStepper> StepperOf(const Mode& mode, double length);

  double rate() const { return rate_; }  // of the fastest states without y
  Index lcps() const { return lcps_; }
  Index modes_made() const { return modes_made_; }

 private:
  // (I - hA)⁻¹, and the LCP with the matrix M + N (I - hA)⁻¹ h B, for one h.
  struct LookAhead {
    Matrix resolvent;
    Matrix matrix;
    std::unique_ptr<LcpSolver> solver;
  };
  struct KeptMode {
    std::unique_ptr<Mode> mode;                          // null where there is none
    std::vector<std::shared_ptr<ModeStepper>> steppers;  // the one that was used last is last
  };
  struct Pairs {
    Vector values, noise;
  };
  std::optional<Pairs> PairsAtBegin(const Basis& basis) const;
  void CorrectAtBegin(Basis& basis);
  void AverageSources(double t, double h);
  bool IsSeen(const Matrix& matrix, const Basis& basis) const;
  LookAhead& LookAheadAt(double h, double t, const Eigen::Ref<const Vector>& x, const Vector& x_noise);
  const Mode* WithoutLcp(double h, double t, const Eigen::Ref<const Vector>& x, const Vector& x_noise,
                         const DataSizes& sizes);
  double StepOf(double t, double scale, double longest, int attempt) const;

  const Problem& problem_;
  const Selection selection_;
  SourceSampler& sources_;
  ModeMaker maker_;
  Matrix abs_N_;
  BalancedMatrix balanced_;  // A
  double rate_;              // of the fastest states without y
  StepCache<LookAhead> look_aheads_;
  std::map<std::vector<Index>, KeptMode> modes_;  // by their active sets
  Basis basis_;
  BasisSuccessors successors_;
  Basis history_;                   // empty without kHistory
  Basis guess_;                     // empty where there is none
  Basis flipped_;                   // likewise
  Basis ended_;                     // of the mode before that
  Index flips_ = 0;                 // since a mode lasted
  Vector q_begin_, q_begin_noise_;  // N x0 + g; empty where it is of no use any more
  Vector y_, f_, g_, q_, tolerance_;
  Index lcps_ = 0;
  Index modes_made_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_MODE_SEARCH_H_
