// SPDX-License-Identifier: Apache-2.0
#include "core/discretization/resolved_cells.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <mutex>
#include <numbers>
#include <variant>

#include "core/linalg/bounded_sum.h"
#include "core/linalg/weyl_sequence.h"
#include "core/problem/formula_switching.h"
#include "core/setup_cache.h"

namespace dlcs {

// The cells of some sources, from 0 on, as far as a solve needed them. They do not depend on who makes them.
struct ResolvedCells::Kept {
  std::vector<std::shared_ptr<const AnalyzedFormula>> formulas;  // whose addresses are in the key: none is made there
  mutable std::mutex mutex;
  mutable std::vector<double> ends{0.0};
  mutable std::vector<double> sizes;  // of the sources, up to the last end
};

ResolvedCells::ResolvedCells(const Problem& problem, std::initializer_list<const TimeFunction*> functions)
    : breaks_(BreakPoints(problem)), horizon_(problem.horizon) {
  breaks_.push_back(problem.horizon);
  std::set<Known> known;
  for (const TimeFunction* function : functions) Add(problem, *function, known);
  if (!sources_.empty()) ResumeFromKept();
}

// More cells take longer to follow than to make.
constexpr std::size_t kMostKept = 8192;

ResolvedCells::~ResolvedCells() {
  if (!kept_ || ends_.size() > kMostKept) return;
  const std::lock_guard lock(kept_->mutex);
  if (ends_.size() <= kept_->ends.size()) return;
  kept_->ends = ends_;
  for (std::size_t k = 0; k < sources_.size(); ++k) kept_->sizes[k] = sources_[k].size;
}

void ResolvedCells::ResumeFromKept() {
  constexpr Index kCacheBytes = 64'000'000;
  static SetupCache& cache = *new SetupCache(kCacheBytes);
  SetupKey key("cells");
  key.Add(horizon_);
  for (const double time : breaks_) key.Add(time);
  for (const Source& source : sources_) {
    key.Add(static_cast<Index>(reinterpret_cast<std::intptr_t>(source.formula.get()))).Add(source.from).Add(source.to);
  }
  kept_ = cache.Get<Kept>(key, [this]() -> SetupCache::Made<Kept> {
    auto kept = std::make_shared<Kept>();
    for (const Source& source : sources_) kept->formulas.push_back(source.formula);
    kept->sizes.resize(sources_.size());
    return {std::move(kept), static_cast<double>(kMostKept * sizeof(double))};
  });
  const std::lock_guard lock(kept_->mutex);
  ends_ = kept_->ends;
  for (std::size_t k = 0; k < sources_.size(); ++k) sources_[k].size = kept_->sizes[k];
}

void ResolvedCells::Add(const Problem& problem, const TimeFunction& function, std::set<Known>& known) {
  for (AnalyzedComponent& component : AnalyzeFormulas(function, horizon_)) {
    const FormulaTree& tree = component.formula->tree;
    if (!tree.depends_on_t) continue;
    const std::vector<double>& inside = component.formula->switching.inside;
    const bool is_decided = std::none_of(inside.begin(), inside.end(), [](double t) { return std::isnan(t); });
    if (!is_decided && probes_.empty()) probes_ = ProbeTimes(problem);
    const std::size_t next = component.piece + 1;
    const double from = component.piece == 0 ? 0 : function.pieces[component.piece].start;
    const double to = next < function.pieces.size() ? function.pieces[next].start : horizon_;
    if (!known.emplace(component.formula.get(), from, to).second) continue;
    sources_.push_back({std::move(component.formula), FormulaMajorant(tree), from, to});
  }
}

// Steps of first order have passed, without cells.
void ResolvedCells::BeginAnewAt(double begin) {
  kept_.reset();
  ends_ = {begin};
  for (Source& source : sources_) source.size = 0;
}

double ResolvedCells::Reach(double begin, double end) {
  if (sources_.empty()) return end;
  if (used_ < begin) BeginAnewAt(begin);
  const auto cells_behind = [&] { return ends_.end() - std::upper_bound(ends_.begin(), ends_.end(), begin); };
  while (ends_.back() < end && cells_behind() < kMostOfAStep) AddCell();
  const std::ptrdiff_t count = cells_behind();
  const double reach = count < kMostOfAStep ? end : std::min(end, *(ends_.end() - count + kMostOfAStep - 1));
  used_ = std::max(used_, *std::lower_bound(ends_.begin(), ends_.end(), reach));
  return reach;
}

std::size_t ResolvedCells::CountUntil(double t) const {
  const auto behind = std::lower_bound(ends_.begin() + 1, ends_.end(), t);
  return static_cast<std::size_t>(behind - ends_.begin()) - 1;
}

std::vector<double> ResolvedCells::EndsIn(double begin, double end) const {
  return {std::upper_bound(ends_.begin(), ends_.end(), begin), std::lower_bound(ends_.begin(), ends_.end(), end)};
}

const ResolvedCells::Points& ResolvedCells::PointsOfCell() {
  static const Points all = [] {
    Points points;
    for (std::size_t j = 0; j < points.part.size(); ++j) {
      const double angle = std::numbers::pi * static_cast<double>(2 * j + 1) / (2 * kLegendreSize);
      points.part[j] = (1 - std::cos(angle)) / 2;
      points.weight[j] = std::numbers::pi / (2 * kLegendreSize) * std::sin(angle);
    }
    return points;
  }();
  return all;
}

std::vector<std::pair<double, double>> ResolvedCells::CellsIn(double begin, double end) const {
  std::vector<std::pair<double, double>> cells;
  for (auto cell = std::lower_bound(ends_.begin(), ends_.end(), begin); cell != ends_.end(); ++cell) {
    const auto next = cell + 1;
    if (next == ends_.end() || *next > end) break;
    cells.emplace_back(*cell, *next);
  }
  return cells;
}

std::vector<double> ResolvedCells::TimesToCheck(double begin, double end) const {
  static const std::array<double, kTimesOfCell> parts = [] {
    std::array<double, kTimesOfCell> all;
    for (int j = 0; j < kTimesOfCell; ++j) {
      all[static_cast<std::size_t>(j)] = (1 - std::cos(std::numbers::pi * (2 * j + 1) / (2 * kTimesOfCell))) / 2;
    }
    return all;
  }();
  std::vector<double> times;
  for (const auto& [from, to] : CellsIn(begin, end)) {
    for (const double part : parts) times.push_back(from + (to - from) * part);
  }
  const auto cell_times = static_cast<std::ptrdiff_t>(times.size());
  for (const double time : probes_) {
    if (time > begin && time < end) times.push_back(time);
  }
  std::inplace_merge(times.begin(), times.begin() + cell_times, times.end());
  return times;
}

// Up to twice as long as the last one, halved until it is resolved.
void ResolvedCells::AddCell() {
  // Singular cells are not cut further: an ulp of T.
  const double shortest = std::numeric_limits<double>::epsilon() * horizon_;
  const double lo = ends_.back();
  const double next_break = *std::upper_bound(breaks_.begin(), breaks_.end(), lo);
  const double twice = ends_.size() > 1 ? 2 * (lo - *(ends_.end() - 2)) : horizon_;
  double hi = lo + twice < next_break ? lo + twice : next_break;
  while (true) {
    const Resolution resolution = Resolve(lo, hi);
    const double middle = lo + (hi - lo) / 2;
    if (resolution == Resolution::kResolved || !(lo < middle && middle < hi)) break;
    if (resolution == Resolution::kSingular && (hi - lo <= shortest || IsHidden(lo, hi))) break;
    hi = middle;
  }
  ends_.push_back(hi);
  for (Source& source : sources_) {
    if (source.IsOf(lo, hi)) source.size = std::max(source.size, source.value);
  }
}

// Whether rounding hides an operand all over a cell, as that of the root in sqrt(1 - cos(t)) near 0: shorter cells show
// no more than the values in this one. It is not longer than a part of T, so that there are enough of them; see
// ShortPulseTest.OfOneIsNotMissedBesideAnything.
bool ResolvedCells::IsHidden(double lo, double hi) {
  constexpr Index kParts = 1024;
  constexpr int kLooks = 2 * kLegendreSize;
  if (hi - lo > horizon_ / kParts) return false;
  for (int look = 0; look < kLooks; ++look) {
    const double t = lo + WeylValue(look) * (hi - lo);
    if (Resolve(t, std::nextafter(t, HUGE_VAL)) != Resolution::kSingular) return false;
  }
  return true;
}

ResolvedCells::Resolution ResolvedCells::Resolve(double lo, double hi) {
  Resolution worst = Resolution::kResolved;
  for (std::size_t k = 0; k < sources_.size(); ++k) {
    // The one that was too coarse last is likely to be it again.
    Source& source = sources_[k == 0 ? coarsest_ : k <= coarsest_ ? k - 1 : k];
    if (!source.IsOf(lo, hi)) continue;
    source.majorant.Evaluate(lo, hi);
    source.value = source.majorant.value_at_middle();
    if (!std::isfinite(source.value)) source.value = 0;
    const double from_zero = source.majorant.bounds()[0];
    const double from_polynomial = source.majorant.bounds()[TaylorBounds::kOrder];
    const double negligible = std::max(std::numeric_limits<double>::min(), kUlp * std::max(source.size, source.value));
    if (from_polynomial <= negligible || from_zero <= negligible) continue;
    coarsest_ = static_cast<std::size_t>(&source - sources_.data());
    if (std::isfinite(from_polynomial)) return Resolution::kTooCoarse;
    worst = Resolution::kSingular;
  }
  return worst;
}

std::vector<double> ProbeTimes(const Problem& problem) {
  constexpr int kProbes = 128;
  const auto is_formula = [](const TimeFunction::Piece& piece) {
    return std::holds_alternative<FormulaFunction>(piece.function);
  };
  const auto has_formulas = [&](const TimeFunction& function) {
    return std::any_of(function.pieces.begin(), function.pieces.end(), is_formula);
  };
  std::vector<double> times;
  if (!has_formulas(problem.f) && !has_formulas(problem.g)) return times;
  for (int k = 0; k < kProbes; ++k) times.push_back(problem.horizon * (k + WeylValue(k)) / kProbes);
  return times;
}

}  // namespace dlcs
