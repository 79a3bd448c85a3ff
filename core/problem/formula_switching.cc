// SPDX-License-Identifier: Apache-2.0
#include "core/problem/formula_switching.h"

#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "core/format_number.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/weyl_sequence.h"
#include "core/parallel/stop_scope.h"
#include "core/problem/formula_enclosure.h"
#include "core/setup_cache.h"

namespace dlcs {
namespace {

// Enclosures of single steps that a search may take; a smooth formula is only searched for poles.
constexpr Index kMaxWork = 10'000'000;
constexpr Index kMaxWorkOfSmooth = 100'000;
// Intervals are cut at a fraction that no formula is likely to contain.
constexpr double kCut = 0.48713;
// An enclosure no wider than this many times that of one point is due to rounding.
constexpr double kRoundingRatio = 16;
// Parts of the interval of the search: wider ranges do not count as a point in time.
constexpr double kNarrow = 1e-4;
constexpr double kPointlike = 1e-10;
// If rounding hides a sign at a point, shorter intervals are not cut, however wide the enclosure is.
constexpr double kShort = 1e-9;
// Intervals near 0 that are shorter are not cut.
constexpr double kAtom = 1e-40;

struct Range {
  double lo, hi;
};

// A range in which rounding hides the sign of the operand of a switch.
struct Cluster {
  int of_switch;
  Range range;
};

// The number with the fewest digits in [lo, hi].
double Shortest(double lo, double hi) {
  if (lo <= 0 && hi >= 0) return 0;
  const double middle = (lo + hi) / 2;
  const auto rounded = [&](int digits) {
    char text[40];
    const auto written = std::to_chars(text, text + sizeof text, middle, std::chars_format::scientific, digits - 1);
    double value = middle;
    std::from_chars(text, written.ptr, value);
    return value;
  };
  // More digits are never farther from the middle.
  int too_few = 0, enough = 17;
  double shortest = middle;
  while (enough - too_few > 1) {
    const int digits = (too_few + enough) / 2;
    const double value = rounded(digits);
    if (value >= lo && value <= hi) {
      enough = digits;
      shortest = value;
    } else {
      too_few = digits;
    }
  }
  return shortest;
}

double CenterOf(Range range) {
  const double center = range.lo + (range.hi - range.lo) / 2;
  return range.hi - range.lo <= 64 * kUlp * std::abs(center) ? Shortest(range.lo, range.hi) : center;
}

// The limit of values[k] at distance 0 from the distances[k], which fall, by polynomials through some of them.
struct Extrapolated {
  double value = std::nan("");
  double error = std::numeric_limits<double>::infinity();
};
Extrapolated Extrapolate(const std::vector<double>& distances, const std::vector<double>& values,
                         const std::vector<double>& noise) {
  constexpr std::size_t kMaxColumns = 8;
  Extrapolated best;
  std::vector<double> row;  // of Neville's scheme: through the last 1, 2, ... values
  for (std::size_t k = 0; k < values.size(); ++k) {
    std::vector<double> next = {values[k]};
    for (std::size_t j = 1; j <= std::min(row.size(), kMaxColumns); ++j) {
      const double ratio = distances[k] / (distances[k - j] - distances[k]);
      next.push_back(next[j - 1] + ratio * (next[j - 1] - row[j - 1]));
      const double error = std::abs(next[j] - next[j - 1]) + 2 * noise[k];
      if (error < best.error) best = {next[j], error};
    }
    row = std::move(next);
  }
  return best;
}

class Search {
 public:
  Search(const FormulaTree& tree, double begin, double end)
      : tree_(tree),
        begin_(begin),
        end_(end),
        enclosure_(tree),
        enclosure_at_end_(tree, {.numbers_are_rounded = true}),
        values_(tree.steps.size()) {
    for (std::size_t i = 0; i < tree.steps.size(); ++i) {
      const FormulaStep& step = tree.steps[i];
      values_[i] = step.number;
      if (step.of_time_alone && IsSwitch(step.operation)) switches_.push_back(static_cast<int>(i));
    }
    is_of_time_ = tree.steps.back().of_time_alone;
  }

  FormulaSwitching Run() {
    if (!switches_.empty() || is_of_time_) Bisect();
    if (result_.refusal.empty()) Conclude();
    return std::move(result_);
  }

 private:
  void Bisect() {
    std::vector<Range> stack = {{begin_, end_}};
    // 250 intervals lead to a pole at 0.
    const double least_work = 250 * static_cast<double>(enclosure_.computed().size());
    const double most_work = std::max(least_work, static_cast<double>(switches_.empty() ? kMaxWorkOfSmooth : kMaxWork));
    while (!stack.empty()) {
      const Range range = stack.back();
      work_ += static_cast<double>(enclosure_.computed().size());
      if (work_ > most_work) return GiveUp(range.lo);
      LookForStop();
      stack.pop_back();
      const double middle = range.lo + kCut * (range.hi - range.lo);
      const double least =
          std::max(4 * kUlp * std::max(std::abs(range.lo), std::abs(range.hi)), kAtom * (end_ - begin_));
      const bool is_atom = !(range.lo < middle && middle < range.hi) || range.hi - range.lo <= least;
      is_short_ = range.hi - range.lo <= kShort * (end_ - begin_);
      enclosure_.Evaluate(range.lo, middle, range.hi);
      if (!is_atom && MustBeCut()) {
        // If a floor jumps inside, another switch cannot be decided on either side while the jump belongs to it. So the
        // jump gets a short interval of its own.
        const double jump = SwitchInside(range), before = jump - 4 * least, after = jump + 4 * least;
        if (range.lo < before && before < jump && jump < after && after < range.hi) {
          stack.push_back({after, range.hi});
          stack.push_back({before, after});
          stack.push_back({range.lo, before});
        } else {
          stack.push_back({middle, range.hi});
          stack.push_back({range.lo, middle});
        }
        continue;
      }
      Settle(range, middle);
      if (!result_.refusal.empty()) return;
    }
  }

  bool IsMonotone(int i) const {
    const Enclosure& decider = enclosure_.decider(i);
    return decider.value.is_bounded() && (decider.slope.lo > 0 || decider.slope.hi < 0);
  }
  FormulaOperation OperationOf(int i) const { return tree_.steps[static_cast<std::size_t>(i)].operation; }
  bool IsDecided(int i) const { return FormulaEnclosure::IsDecided(OperationOf(i), enclosure_.decider(i).value); }
  bool IsHiddenByRounding(int i) const {
    const Interval point = enclosure_.decider_at_middle(i);
    if (FormulaEnclosure::IsDecided(OperationOf(i), point)) return false;
    return is_short_ || enclosure_.decider(i).value.width() <= kRoundingRatio * point.width();
  }

  // Whether shorter intervals may show more.
  bool MustBeCut() const {
    if (is_of_time_ && enclosure_.is_singular() && !enclosure_.is_singular_at_middle()) return true;
    return std::any_of(switches_.begin(), switches_.end(),
                       [&](int i) { return !IsDecided(i) && !IsMonotone(i) && !IsHiddenByRounding(i); });
  }

  // Where a switch with a monotone operand switches in `range`, the middle time of several; NaN if none does.
  double SwitchInside(Range range) {
    for (const int i : switches_) {
      if (IsDecided(i) || !IsMonotone(i)) continue;
      double level = 0;
      if (IsRounding(OperationOf(i))) {
        const double at_lo = Decider(i, range.lo), at_hi = Decider(i, range.hi);
        const double first = std::ceil(std::min(at_lo, at_hi)), last = std::floor(std::max(at_lo, at_hi));
        if (first > last) continue;
        level = first + std::floor((last - first) / 2);
      }
      work_ += static_cast<double>(enclosure_.computed().size());
      return Crossing(i, range, level, enclosure_.decider(i).slope.lo > 0);
    }
    return std::nan("");
  }

  // Notes what happens on an interval that is not cut.
  void Settle(Range range, double middle) {
    for (const int i : switches_) {
      if (IsDecided(i)) continue;
      if (IsMonotone(i)) {
        FindCrossings(i, range);
        if (!result_.refusal.empty()) return;
      } else {
        AddToCluster(i, range);
      }
    }
    if (is_of_time_ && enclosure_.is_singular()) LookAtSingularity(range, middle);
    if (crossings_.size() + clusters_.size() + result_.gaps.size() > kMaxSwitchingTimes) {
      Refuse(kMaxSwitchingTimes, range.hi);
    }
  }

  void AddToCluster(int i, Range range) {
    const auto [known, is_first] = last_cluster_.try_emplace(i, clusters_.size());
    if (!is_first && clusters_[known->second].range.hi >= range.lo) {
      clusters_[known->second].range.hi = range.hi;
      return;
    }
    known->second = clusters_.size();
    clusters_.push_back({i, range});
  }

  void Refuse(double count, double until) {
    char times[40];
    std::snprintf(times, sizeof times, count < 1e15 ? "%.0f" : "%g", count);
    result_.refusal = "switches more than " + std::string(times) + " times" +
                      (until < end_ ? " before t = " + FormatNumber(until) : std::string()) + "; at most " +
                      std::to_string(kMaxSwitchingTimes) + " switching times are allowed";
  }

  // The values of the steps of t alone.
  void Evaluate(double t) {
    for (std::size_t i = 0; i < tree_.steps.size(); ++i) {
      if (tree_.steps[i].operation == FormulaOperation::kTime) values_[i] = t;
    }
    for (const int index : enclosure_.computed()) {
      const FormulaStep& step = tree_.steps[static_cast<std::size_t>(index)];
      values_[static_cast<std::size_t>(index)] = ValueOf(step.operation, values_[static_cast<std::size_t>(step.a)],
                                                         step.b < 0 ? 0 : values_[static_cast<std::size_t>(step.b)]);
    }
  }
  double WholeValue(double t) {
    Evaluate(t);
    return values_.back();
  }
  double Decider(int i, double t) {
    Evaluate(t);
    const FormulaStep& step = tree_.steps[static_cast<std::size_t>(i)];
    const double a = values_[static_cast<std::size_t>(step.a)];
    return step.b < 0 ? a : a - values_[static_cast<std::size_t>(step.b)];
  }

  // The times in `range` where the monotone operand of switch `i` is zero, or a whole number.
  void FindCrossings(int i, Range range) {
    const bool increasing = enclosure_.decider(i).slope.lo > 0;
    // The operand is the same number for some time, and off by half of the step to the next one.
    const auto note = [&](double t) {
      const double at_switch = Decider(i, t);
      double same = std::nextafter(t, end_) - t;
      while (t + same < end_ && Decider(i, t + same) == at_switch) same *= 2;
      for (int k = 0; k < 5 && Decider(i, t + 7 * same / 8) != at_switch; ++k) same *= 7.0 / 8;
      uncertain_.push_back({t, same / 2});
      crossings_.push_back(t);
    };
    if (!IsRounding(OperationOf(i))) return note(Crossing(i, range, 0, increasing));
    const double at_lo = Decider(i, range.lo), at_hi = Decider(i, range.hi);
    const double first = std::ceil(std::min(at_lo, at_hi)), last = std::floor(std::max(at_lo, at_hi));
    const double count = last - first + 1;
    if (static_cast<double>(crossings_.size()) + count > kMaxSwitchingTimes) {
      return Refuse(static_cast<double>(crossings_.size()) + count - 1, range.hi);
    }
    for (double k = 0; k < count; ++k) {
      const double level = increasing ? first + k : last - k;
      note(Crossing(i, range, level, increasing));
      range.lo = crossings_.back();
    }
  }

  // Where the monotone operand of switch `i` passes `level`, to the last bit; an end of `range` where that is nearest.
  double Crossing(int i, Range range, double level, bool increasing) {
    const auto is_at_level = [&](double t) {
      enclosure_at_end_.EvaluateAt(t);
      return enclosure_at_end_.decider_at_middle(i).Contains(level);
    };
    // max(0, sin(t + pi)) switches at 0, but for rounding.
    if (range.lo == begin_ && is_at_level(begin_)) return begin_;
    if (range.hi == end_ && is_at_level(end_)) return end_;
    // Increases through zero.
    const auto passed = [&](double t) { return increasing ? Decider(i, t) - level : level - Decider(i, t); };
    const double least = range.lo, at_lo = passed(range.lo), at_hi = passed(range.hi);
    if (at_lo >= 0) return range.lo;
    if (!(at_hi >= 0)) return range.hi;
    const auto are_neighbors = [](double a, double b) { return std::nextafter(a, b) == b; };
    if (std::isfinite(at_lo) && std::isfinite(at_hi) && !are_neighbors(range.lo, range.hi)) {
      std::uintmax_t most = 200;
      std::tie(range.lo, range.hi) =
          boost::math::tools::toms748_solve(passed, range.lo, range.hi, at_lo, at_hi, are_neighbors, most);
    }
    // Where it is zero at several times in a row, the first of them.
    for (double ulps = 1; passed(range.lo) >= 0; ulps *= 2) {
      range.hi = range.lo;
      range.lo = std::max(least, range.lo - ulps * (range.hi - std::nextafter(range.hi, least)));
    }
    while (true) {
      const double middle = range.lo + (range.hi - range.lo) / 2;
      if (!(range.lo < middle && middle < range.hi)) return range.hi;
      (passed(middle) >= 0 ? range.hi : range.lo) = middle;
    }
  }

  // Interprets an interval on which the formula may not have finite values.
  void LookAtSingularity(Range range, double middle) {
    const double length = end_ - begin_;
    const double value = WholeValue(middle);
    const bool has_none = enclosure_.value_at_middle(static_cast<int>(tree_.steps.size()) - 1).is_empty();
    if (range.hi - range.lo > 1e-6 * length || (has_none && !std::isfinite(value))) {
      if (!std::isfinite(value)) RefuseFrom(range.lo, middle, value);
      return;  // an operation without finite value that the formula does not depend on
    }
    if (!result_.gaps.empty() && result_.gaps.back().to >= range.lo) {
      result_.gaps.back().to = range.hi;  // the same one
      return;
    }
    const Approach left = Approached(range, -1), right = Approached(range, 1);
    if (left.diverges || right.diverges) {
      result_.refusal =
          "has no finite value at t = " + NumberText(Shortest(range.lo, range.hi)) + ": it is unbounded there";
      return;
    }
    FormulaGap gap{range.lo, range.hi, left.limit.value_or(value), right.limit.value_or(value)};
    if (range.lo <= begin_) gap.left = gap.right;
    if (range.hi >= end_) gap.right = gap.left;
    if ((range.lo > begin_ && !left.limit) || (range.hi < end_ && !right.limit)) {
      result_.warnings.push_back("whether it has a limit at t = " + FormatNumber(Shortest(range.lo, range.hi)) +
                                 " could not be decided");
    }
    gap.jumps = std::abs(gap.left - gap.right) > 1e-6 * std::max(left.largest, right.largest);
    result_.gaps.push_back(gap);
    const bool is_inside = range.lo > begin_ && range.hi < end_;
    if (is_inside) crossings_.push_back(CenterOf(range));  // where its slope may jump, as that of sqrt(1 - cos(t)) does
  }

  // No finite value at `without`, nor on the way there from some time after `from`.
  void RefuseFrom(double from, double without, double value) {
    double first = without;
    if (std::isfinite(WholeValue(from))) {
      while (true) {
        const double middle = from + (first - from) / 2;
        if (!(from < middle && middle < first)) break;
        (std::isfinite(WholeValue(middle)) ? from : first) = middle;
      }
    } else {
      first = from;
    }
    value = WholeValue(first);
    result_.refusal = "has no finite value at t = " + NumberText(first) + " (" + NumberText(value) + ")" +
                      (first < without ? ", nor after it" : "");
  }

  struct Approach {
    bool diverges = false;
    std::optional<double> limit;
    double largest = 0;  // of the absolute values
  };

  // What the formula does on the way to `range` from the right (`direction` 1) or the left (-1): its enclosures at
  // distances that fall by 4, as long as they are of use.
  Approach Approached(Range range, int direction) {
    constexpr int kMaxSamples = 40;
    const double target = range.lo + (range.hi - range.lo) / 2;
    const double edge = direction > 0 ? end_ : begin_;
    const int root = static_cast<int>(tree_.steps.size()) - 1;
    std::vector<double> distances, values, noise;
    double distance = std::abs(edge - target), largest = 0;
    for (int k = 0; k < kMaxSamples && distance > 16 * (range.hi - range.lo); ++k, distance /= 4) {
      const double t = target + direction * distance;
      if (t < begin_ || t > end_) continue;
      enclosure_.EvaluateAt(t);
      work_ += static_cast<double>(enclosure_.computed().size());
      const Interval at = enclosure_.value_at_middle(root);
      if (!at.is_bounded()) {
        if (distances.size() > 8) break;
        distances.clear(), values.clear(), noise.clear();  // another singularity in between
        continue;
      }
      const double value = at.lo + at.width() / 2;
      largest = std::max(largest, std::abs(value));
      if (at.width() > largest / 8 && values.size() > 3) break;
      distances.push_back(std::abs(t - target));
      values.push_back(value);
      noise.push_back(at.width() / 2);
    }
    if (values.size() < 3) return {};
    Approach approach;
    approach.largest = largest;
    approach.diverges = Diverges(values, noise);
    if (approach.diverges) return approach;
    const Extrapolated limit = Extrapolate(distances, values, noise);
    const bool is_sharp = limit.error <= 1e-3 * std::max(largest, std::numeric_limits<double>::min());
    if (is_sharp && Approaches(limit.value, values, noise)) approach.limit = limit.value;
    return approach;
  }

  // Whether each of the last differences is at least as large as the one before it, away from zero. So it is for 1/d
  // and log(d) at distances d that fall by a factor.
  static bool Diverges(const std::vector<double>& values, const std::vector<double>& noise) {
    constexpr std::size_t kLooks = 6;
    const std::size_t size = values.size();
    if (size < kLooks + 2) return false;
    for (std::size_t k = size - kLooks; k < size; ++k) {
      const double difference = values[k] - values[k - 1], before = values[k - 1] - values[k - 2];
      if (std::abs(difference) < 0.95 * std::abs(before) || std::abs(difference) <= 4 * (noise[k] + noise[k - 1])) {
        return false;
      }
      if (difference * before <= 0 || std::abs(values[k]) <= std::abs(values[k - 1])) return false;
    }
    return true;
  }

  // Whether the last values come nearer to `limit` with every step, but for noise.
  static bool Approaches(double limit, const std::vector<double>& values, const std::vector<double>& noise) {
    const std::size_t looks = std::min<std::size_t>(6, values.size() - 1);
    double largest = std::abs(limit);
    for (const double value : values) largest = std::max(largest, std::abs(value));
    for (std::size_t k = values.size() - looks; k < values.size(); ++k) {
      const double slack = 4 * (noise[k] + noise[k - 1]) + 4 * kUlp * std::abs(limit);
      if (std::abs(values[k] - limit) > std::abs(values[k - 1] - limit) + slack) return false;
      if (k + 3 >= values.size() && std::abs(values[k] - limit) > 0.05 * largest) return false;
    }
    return true;
  }

  // The search took too long, so nothing is known from `t` on.
  void GiveUp(double t) {
    if (switches_.empty()) {
      result_.warnings.push_back("whether it has finite values everywhere after t = " + FormatNumber(t) +
                                 " could not be decided");
      return;
    }
    clusters_.push_back({switches_.front(), {t, end_}});
    gave_up_ = true;
  }

  void Conclude() {
    std::sort(crossings_.begin(), crossings_.end());
    std::vector<double> times = crossings_;
    std::vector<Range> wide;
    for (const auto& [i, range] : clusters_) {
      const bool may_jump = MayJump(OperationOf(i)) || (gave_up_ && range.hi == end_);
      // If values do not jump, the decisions of both sides are right up to rounding in the whole cluster.
      const bool is_narrow = !may_jump || (range.hi - range.lo <= kNarrow * (end_ - begin_) && !gave_up_);
      if (!may_jump && (range.lo <= begin_ || range.hi >= end_)) {
        narrow_.push_back(range);
      } else if (is_narrow) {
        times.push_back(CenterOf(range));
        // That around the jump of an operand is as wide as the search cuts it, and the jump is known better.
        const auto jump = std::lower_bound(crossings_.begin(), crossings_.end(), range.lo);
        const bool has_jump = jump != crossings_.end() && *jump <= range.hi;
        if (!has_jump) uncertain_.push_back({times.back(), (range.hi - range.lo) / 2});
        narrow_.push_back(range);
      } else {
        times.push_back(range.lo);
        times.push_back(range.hi);
        wide.push_back(range);
      }
      if (may_jump && range.hi - range.lo > kPointlike * (end_ - begin_)) {
        const std::string where =
            is_narrow ? "within " + FormatNumber((range.hi - range.lo) / 2) + " of t = " + FormatNumber(CenterOf(range))
                      : "between t = " + FormatNumber(range.lo) + " and " + FormatNumber(range.hi);
        result_.warnings.push_back("switching times " + where +
                                   " could not be distinguished; declare them as break points "
                                   "with pieces between them");
      }
    }
    std::sort(narrow_.begin(), narrow_.end(), [](const Range& a, const Range& b) { return a.hi < b.hi; });
    wide = Joined(std::move(wide));
    std::sort(times.begin(), times.end());
    std::vector<double> distinct;
    for (const double time : times) {
      const bool is_inside = time > begin_ && time > begin_ * (1 + kSameTime) && time < end_ * (1 - kSameTime);
      const bool is_new = distinct.empty() || time - distinct.back() > kSameTime * time;
      if (is_inside && is_new) distinct.push_back(time);
    }
    KeepSwitches(distinct, wide);
    std::sort(uncertain_.begin(), uncertain_.end());
    auto known = uncertain_.begin();
    for (const double time : result_.times) {
      double error = 0;
      while (known != uncertain_.end() && known->first < time) ++known;
      for (auto same = known; same != uncertain_.end() && same->first - time <= kSameTime * time; ++same) {
        error = std::max(error, same->second);
      }
      result_.time_errors.push_back(error);
    }
  }

  // The same times inside, as ranges that do not overlap, increasing.
  static std::vector<Range> Joined(std::vector<Range> ranges) {
    std::sort(ranges.begin(), ranges.end(), [](const Range& a, const Range& b) { return a.lo < b.lo; });
    std::vector<Range> joined;
    for (const Range& range : ranges) {
      if (joined.empty() || joined.back().hi <= range.lo) {
        joined.push_back(range);
      } else {
        joined.back().hi = std::max(joined.back().hi, range.hi);
      }
    }
    return joined;
  }

  // Keeps those of `times` at which the decision of a switch changes. `wide` ranges and gaps are increasing; of each
  // there may be as many as of times.
  void KeepSwitches(const std::vector<double>& times, const std::vector<Range>& wide) {
    const auto is_wide = [&](double t) {
      const auto behind =
          std::upper_bound(wide.begin(), wide.end(), t, [](double time, const Range& r) { return time < r.hi; });
      return behind != wide.end() && behind->lo < t;
    };
    const auto is_gap = [&](double t) {
      const auto behind = std::lower_bound(result_.gaps.begin(), result_.gaps.end(), t,
                                           [](const FormulaGap& gap, double time) { return gap.to < time; });
      return behind != result_.gaps.end() && behind->from <= t;
    };
    std::vector<double> before, after;
    double widest = 0;  // of the parts of the last interval
    for (std::size_t k = 0; k <= times.size(); ++k) {
      const double from = k == 0 ? begin_ : times[k - 1], to = k == times.size() ? end_ : times[k];
      double inside = from + kCut * (to - from);
      if (is_wide(inside)) {
        inside = std::nan("");
        after.clear();
      } else {
        inside = OffClusters(from, to);
        Evaluate(inside);
        after.clear();
        for (const int i : switches_) after.push_back(DecisionOf(tree_.steps[static_cast<std::size_t>(i)], values_));
      }
      const bool is_one = k > 0 && !after.empty() && after == before && !is_gap(times[k - 1]);
      if (k > 0 && !is_one) result_.times.push_back(times[k - 1]);
      if (!is_one) {
        result_.inside.push_back(inside);
        widest = to - from;
      } else if (to - from > widest) {
        // A part may be as short as rounding, where enclosures decide nothing.
        result_.inside.back() = inside;
        widest = to - from;
      }
      before = after;
    }
  }

  // A time between `from` and `to` that lies in no narrow cluster.
  double OffClusters(double from, double to) const {
    for (const double part : {kCut, WeylValue(2), WeylValue(3), WeylValue(4)}) {
      const double t = from + part * (to - from);
      const auto behind =
          std::lower_bound(narrow_.begin(), narrow_.end(), t, [](const Range& r, double time) { return r.hi < time; });
      if (behind == narrow_.end() || behind->lo > t) return t;
    }
    return from + kCut * (to - from);
  }

  const FormulaTree& tree_;
  const double begin_, end_;
  FormulaEnclosure enclosure_, enclosure_at_end_;
  std::vector<double> values_;
  std::vector<int> switches_;
  bool is_of_time_ = false;
  double work_ = 0;        // enclosures of single steps so far
  bool is_short_ = false;  // the interval that is looked at
  std::vector<double> crossings_;
  std::vector<std::pair<double, double>> uncertain_;  // times, and by how much they may be off
  std::vector<Cluster> clusters_;
  std::map<int, std::size_t> last_cluster_;  // of each switch
  std::vector<Range> narrow_;
  bool gave_up_ = false;
  FormulaSwitching result_;
};

}  // namespace

FormulaSwitching FindSwitchingTimes(const FormulaTree& tree, double begin, double end) {
  if (!(begin < end)) return {};
  const FormulaStep& value = tree.steps.back();
  if (value.operation == FormulaOperation::kNumber && !std::isfinite(value.number)) {
    return {.refusal = "has no finite value (" + NumberText(value.number) + ")"};
  }
  if (!tree.depends_on_t) return {};
  return Search(tree, begin, end).Run();
}

absl::StatusOr<std::shared_ptr<const AnalyzedFormula>> AnalyzeFormula(const std::string& text,
                                                                      const FormulaVariables& variables, double begin,
                                                                      double end) {
  constexpr Index kCacheBytes = 64'000'000;
  static SetupCache& cache = *new SetupCache(kCacheBytes);
  absl::Status status;
  const auto analyze = [&]() -> std::shared_ptr<const AnalyzedFormula> {
    absl::StatusOr<FormulaTree> tree = ReadFormula(text, variables);
    if (!tree.ok()) {
      status = tree.status();
      return nullptr;
    }
    auto made = std::make_shared<AnalyzedFormula>();
    made->tree = *std::move(tree);
    made->switching = FindSwitchingTimes(made->tree, begin, end);
    return made;
  };
  std::shared_ptr<const AnalyzedFormula> analyzed;
  if (text.find('t') != std::string::npos) {
    std::string names = "formula " + text;
    for (const auto& [name, value] : variables.parameters) names += "\n" + name;
    SetupKey key(names);
    key.Add(begin).Add(end).Add(variables.states).Add(variables.constraints);
    for (const auto& [name, value] : variables.parameters) key.Add(value);
    analyzed = cache.Get<AnalyzedFormula>(key, [&]() -> SetupCache::Made<AnalyzedFormula> {
      auto made = analyze();
      if (!made) return {};
      const double bytes = 24.0 * static_cast<double>(made->switching.times.size()) +
                           static_cast<double>(sizeof(FormulaStep) * made->tree.steps.size()) + 500;
      return {std::move(made), bytes};
    });
  } else {
    analyzed = analyze();  // a number: not worth keeping
  }
  if (!status.ok()) return status;
  return analyzed;
}

}  // namespace dlcs
