// SPDX-License-Identifier: Apache-2.0
// How fine the formulas of f and g are: the cells on which each is a polynomial, so that no pulse is missed.

#ifndef DLCS_CORE_DISCRETIZATION_RESOLVED_CELLS_H_
#define DLCS_CORE_DISCRETIZATION_RESOLVED_CELLS_H_

#include <array>
#include <cstddef>
#include <initializer_list>
#include <memory>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "core/discretization/legendre.h"
#include "core/problem/formula_majorant.h"
#include "core/problem/problem.h"
#include "core/problem/time_function.h"

namespace dlcs {

// Divides time, from 0 on, into cells on each of which every formula of f and g differs from a polynomial of degree
// TaylorBounds::kOrder - 1 by less than the rounding of the largest value that it has had so far. This is proven by
// bounds of its derivatives (core/problem/formula_majorant.h), not seen in values: a pulse has cells shorter than
// itself however short it is. Sources that are not formulas have no cells: they are linear or polynomials between known
// times. Where the switches of a formula could not be found (FormulaSwitching::inside), since rounding hides them,
// cells are those of its smooth parts, and ProbeTimes() are checked besides.
class ResolvedCells {
 public:
  // The valid problem's formulas are analyzed, or their analysis is found in the cache; see AnalyzeFormula().
  explicit ResolvedCells(const Problem& problem) : ResolvedCells(problem, {&problem.f, &problem.g}) {}
  // The same for these functions of the problem.
  ResolvedCells(const Problem& problem, std::initializer_list<const TimeFunction*> functions);
  // No cells, as of a problem without formulas.
  ResolvedCells() = default;
  // Keeps the cells for other solves with the same sources.
  ~ResolvedCells();
  ResolvedCells(ResolvedCells&&) = default;
  ResolvedCells& operator=(ResolvedCells&&) = delete;

  // Whether no source is a formula in t.
  bool is_empty() const { return sources_.empty(); }

  // The end of the cell at which a step from `begin` to `end` should end at the latest: the last one of kMostOfAStep
  // cells behind `begin`, or `end`. Makes the cells up to there that no solve has made yet, each of which costs
  // FormulaMajorant::Evaluate() for each different formula and halving.
  double Reach(double begin, double end);
  // A polynomial of degree K that is right in so many cells has none of the features that made them short, beyond what
  // is allowed. So a step is not cut where it matters, and the work of making cells is bounded by that of steps.
  static constexpr std::ptrdiff_t kMostOfAStep = 64;

  // How many cells, of those made so far, end before `t`.
  std::size_t CountUntil(double t) const;

  // The ends of cells inside (begin, end), of those made so far.
  std::vector<double> EndsIn(double begin, double end) const;

  // The points of a cell at which a polynomial on it is compared, and what they weigh in its integral, for a length of
  // one: those of Chebyshev, increasing.
  struct Points {
    std::array<double, kLegendreSize> part, weight;
  };
  static const Points& PointsOfCell();
  // The cells that lie in [begin, end], of those made so far.
  std::vector<std::pair<double, double>> CellsIn(double begin, double end) const;
  // Increasing times inside [begin, end], at which to compare f and g with polynomials that approximate them there:
  // kTimesOfCell Chebyshev points of each of CellsIn(), and all probes inside. In a cell a formula turns hardly more
  // than once, as sin(t) in a length of 4: these times show more than nine tenths of what is missed.
  static constexpr int kTimesOfCell = 5;
  std::vector<double> TimesToCheck(double begin, double end) const;

 private:
  struct Source {
    std::shared_ptr<const AnalyzedFormula> formula;
    FormulaMajorant majorant;
    double from = 0, to = 0;  // its piece
    double value = 0;         // in the middle of the last interval
    double size = 0;          // the largest value so far

    bool IsOf(double lo, double hi) const { return from <= lo && hi <= to; }
  };
  enum class Resolution { kResolved, kSingular, kTooCoarse };
  struct Kept;

  void ResumeFromKept();
  void BeginAnewAt(double begin);
  // A formula and its piece: equal ones have the same cells.
  using Known = std::tuple<const AnalyzedFormula*, double, double>;
  void Add(const Problem& problem, const TimeFunction& function, std::set<Known>& known);
  void AddCell();
  bool IsHidden(double lo, double hi);
  Resolution Resolve(double lo, double hi);

  std::vector<Source> sources_;
  std::vector<double> breaks_;  // with the horizon
  double horizon_ = 0;
  std::vector<double> ends_{0.0};  // of the cells, increasing
  double used_ = 0;                // the end of the last one that was needed
  std::shared_ptr<const Kept> kept_;
  std::vector<double> probes_;
  std::size_t coarsest_ = 0;  // the source that was too coarse last
};

// Times in [0, T], at least one in every T/64, irregularly spaced so that no periodic source escapes: for a first
// impression of formulas. Empty if there are none, since all else is known at KnownKinks().
std::vector<double> ProbeTimes(const Problem& problem);

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_RESOLVED_CELLS_H_
