// SPDX-License-Identifier: Apache-2.0
#include "core/problem/formula.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/problem/formula_enclosure.h"

namespace dlcs {

absl::StatusOr<Formula> Formula::Parse(const std::string& text, const FormulaVariables& variables) {
  absl::StatusOr<FormulaTree> tree = ReadFormula(text, variables);
  if (!tree.ok()) return tree.status();
  auto analyzed = std::make_shared<AnalyzedFormula>();
  analyzed->tree = *std::move(tree);
  return Formula(std::move(analyzed), {});
}

Formula::Formula(std::shared_ptr<const AnalyzedFormula> analyzed, const TimeAxis& axis)
    : analyzed_(std::move(analyzed)), values_(analyzed_->tree.steps.size()) {
  const std::vector<FormulaStep>& steps = analyzed_->tree.steps;
  states_.resize(states().size());
  constraints_.resize(constraints().size());
  const auto place = [](const std::vector<Index>& indices, Index i) {
    return std::find(indices.begin(), indices.end(), i) - indices.begin();
  };
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const int index = static_cast<int>(i);
    switch (steps[i].operation) {
      case FormulaOperation::kNumber:
        values_[i] = steps[i].number;
        break;
      case FormulaOperation::kTime:
        time_ = index;
        break;
      case FormulaOperation::kState:
        states_[static_cast<std::size_t>(place(states(), steps[i].index))] = index;
        break;
      case FormulaOperation::kConstraint:
        constraints_[static_cast<std::size_t>(place(constraints(), steps[i].index))] = index;
        break;
      default:
        computed_.push_back(index);
    }
  }
  for (const double time : analyzed_->switching.times) switching_times_.push_back(axis.Nearest(time));
  has_intervals_ = !analyzed_->switching.inside.empty() &&
                   std::any_of(steps.begin(), steps.end(),
                               [](const auto& step) { return step.of_time_alone && IsSwitch(step.operation); });
  varying_ = computed_;
}

Formula::Formula(Formula&&) noexcept = default;
Formula& Formula::operator=(Formula&&) noexcept = default;
Formula::~Formula() = default;

bool Formula::IsSteady(double begin, double end) {
  if (!DependsOnTime()) return true;
  if (!has_intervals_ || !analyzed_->switching.gaps.empty()) return false;
  EnterIntervalOf(begin, Side::kRight);
  const bool in_one = interval_ == switching_times_.size() || end <= switching_times_[interval_];
  return in_one && is_decided_ && varying_.empty();
}

FormulaEnclosure& Formula::Enclosed() {
  if (!enclosure_)
    enclosure_ = std::make_unique<FormulaEnclosure>(analyzed_->tree, FormulaEnclosure::Assumptions{.has_value = true});
  return *enclosure_;
}

double Formula::RoundingAt(double t) {
  if (computed_.empty()) return 0;
  const auto rounding_at = [&](double time) {
    Enclosed().EvaluateAt(time);
    return Enclosed().value_at_middle(static_cast<int>(analyzed_->tree.steps.size()) - 1).width() / 2;
  };
  if (has_intervals_) EnterIntervalOf(t, Side::kRight);
  if (!is_decided_) return rounding_at(t);
  // A jump that rounding hides at `t` is no rounding of the value. Farthest from the ends of the interval is none.
  if (!varying_.empty()) {
    const double rounding = rounding_at(t);
    const auto may_jump_here = [&](int step) {
      const FormulaOperation operation = analyzed_->tree.steps[static_cast<std::size_t>(step)].operation;
      return MayJump(operation) && !FormulaEnclosure::IsDecided(operation, Enclosed().decider_at_middle(step));
    };
    const std::vector<int>& computed = Enclosed().computed();
    return std::none_of(computed.begin(), computed.end(), may_jump_here)
               ? rounding
               : rounding_at(analyzed_->switching.inside[interval_]);
  }
  if (steady_rounding_ < 0) steady_rounding_ = rounding_at(analyzed_->switching.inside[interval_]);
  return steady_rounding_;
}

Formula::Slope Formula::SlopeAt(double t, Side side) {
  if (!DependsOnTime()) return {0, 0};
  if (computed_.empty()) return {1, 0};
  if (has_intervals_) {
    EnterIntervalOf(t, side);
    if (is_decided_ && varying_.empty()) return {0, 0};
  }
  Enclosed().Evaluate(t, t, t);
  const Interval slope = Enclosed().slope(static_cast<int>(analyzed_->tree.steps.size()) - 1);
  if (!slope.is_bounded()) return {0, std::numeric_limits<double>::infinity()};
  return {slope.lo + slope.width() / 2, slope.width() / 2};
}

double Formula::Evaluate(double t, Side side) {
  return computed_.empty() && time_ < 0 ? values_.back() : EvaluateAt(t, side);
}

double Formula::Evaluate(double t, const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y, Side side) {
  for (std::size_t k = 0; k < states_.size(); ++k) {
    values_[static_cast<std::size_t>(states_[k])] = x[analyzed_->tree.states[k]];
  }
  for (std::size_t k = 0; k < constraints_.size(); ++k) {
    values_[static_cast<std::size_t>(constraints_[k])] = y[analyzed_->tree.constraints[k]];
  }
  return EvaluateAt(t, side);
}

double Formula::EvaluateAt(double t, Side side) {
  const auto& [tree, switching] = *analyzed_;
  if (has_intervals_) {
    EnterIntervalOf(t, side);
    if (!is_decided_ && std::binary_search(switching_times_.begin(), switching_times_.end(), t)) {
      t = std::nextafter(t, side == Side::kRight ? HUGE_VAL : -HUGE_VAL);
    }
  }
  for (const FormulaGap& gap : switching.gaps) {
    if (gap.jumps && gap.from <= t && t <= gap.to) return side == Side::kLeft ? gap.left : gap.right;
  }
  if (time_ >= 0) values_[static_cast<std::size_t>(time_)] = t;
  for (const int index : varying_) {
    const auto i = static_cast<std::size_t>(index);
    const FormulaStep& step = tree.steps[i];
    const double a = values_[static_cast<std::size_t>(step.a)];
    const double b = step.b < 0 ? 0 : values_[static_cast<std::size_t>(step.b)];
    values_[i] = ValueOf(step.operation, a, b);
  }
  const double value = values_.back();
  if (std::isfinite(value) || switching.gaps.empty()) return value;
  for (const FormulaGap& gap : switching.gaps) {
    if (gap.from <= t && t <= gap.to) return side == Side::kLeft ? gap.left : gap.right;
  }
  return value;
}

void Formula::EnterIntervalOf(double t, Side side) {
  const std::vector<double>& times = switching_times_;
  const auto is_behind = [&](double time) { return side == Side::kRight ? time > t : time >= t; };
  const bool stays = has_entered_ && (interval_ == 0 || !is_behind(times[interval_ - 1])) &&
                     (interval_ == times.size() || is_behind(times[interval_]));
  if (stays) return;
  const auto next = std::partition_point(times.begin(), times.end(), [&](double time) { return !is_behind(time); });
  EnterInterval(static_cast<std::size_t>(next - times.begin()));
}

// Takes the decisions of the switches in `interval`, and computes what they leave constant there.
void Formula::EnterInterval(std::size_t interval) {
  const auto& [tree, switching] = *analyzed_;
  interval_ = interval;
  has_entered_ = true;
  steady_rounding_ = -1;
  const double inside = switching.inside[interval];
  is_decided_ = !std::isnan(inside);
  if (!is_decided_) {
    varying_ = computed_;
    return;
  }
  varying_.clear();
  varies_.assign(tree.steps.size(), false);
  values_[static_cast<std::size_t>(time_)] = inside;
  varies_[static_cast<std::size_t>(time_)] = true;
  for (const int index : computed_) {
    const auto i = static_cast<std::size_t>(index);
    const FormulaStep& step = tree.steps[i];
    const auto a = static_cast<std::size_t>(step.a), b = step.b < 0 ? a : static_cast<std::size_t>(step.b);
    if (step.of_time_alone) values_[i] = ValueOf(step.operation, values_[a], step.b < 0 ? 0 : values_[b]);
    if (!step.of_time_alone) {
      varies_[i] = true;
    } else if (IsExtremum(step.operation)) {
      varies_[i] = varies_[values_[i] == values_[a] ? a : b];
    } else {
      varies_[i] = !MayJump(step.operation) && (varies_[a] || varies_[b]);
    }
  }
  // Of what varies, only what the value needs: a decided switch does not need what it compares.
  needed_.assign(tree.steps.size(), false);
  needed_.back() = true;
  for (auto index = computed_.rbegin(); index != computed_.rend(); ++index) {
    const auto i = static_cast<std::size_t>(*index);
    if (!needed_[i] || !varies_[i]) continue;
    const FormulaStep& step = tree.steps[i];
    needed_[static_cast<std::size_t>(step.a)] = true;
    if (step.b >= 0) needed_[static_cast<std::size_t>(step.b)] = true;
    varying_.push_back(*index);
  }
  std::reverse(varying_.begin(), varying_.end());
}

}  // namespace dlcs
