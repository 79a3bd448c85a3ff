// SPDX-License-Identifier: Apache-2.0
#include "tests/hostile/reference.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "tests/hostile/exact_mode.h"

namespace dlcs::hostile {

namespace {

constexpr int kDegree = 16;              // of the polynomials of a step: 17 values, and 16 between them to check
constexpr int kSamplesLog2 = 5;          // 2^5 intervals of values
constexpr double kUnresolved = 1e-18;    // of the numbers summed: a longer step is cut
constexpr double kWellResolved = 1e-23;  // and a longer one is tried
constexpr double kCrossed = 1e-17;       // below zero by this much of the numbers summed: crossed
constexpr double kZero = 1e-23;          // in the lexicographic test
constexpr double kZeroAtStart = 1e-13;   // and where a state may be inconsistent by rounding
// A w_i that was held at zero by a y_i of large terms has drifted by their rounding.
constexpr double kZeroOfHeld = 1e-15;
constexpr double kZeroOfLargest = 1e-29;
constexpr double kRefined = 1e-27;
constexpr int kDerivatives = 8;
constexpr double kReportedZero = 1e-3;  // of a mode that is reported from a time that is not exact
constexpr double kReportedZeroOfLargest = 1e-6;
constexpr double kReportedTime = 1e-3;    // that a mode may end before, of its length, ...
constexpr double kReportedMoment = 1e-9;  // ... and of T
constexpr double kPassedOver = 1e-14;     // of T, modes that are reported for no longer
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kOutgrown = 1e40;

// From values at 0, 1/16, ..., 1 to Bernstein coefficients.
const DenseMatrix& BernsteinFromValues() {
  static const DenseMatrix result = [] {
    const int k = kDegree + 1;
    DenseMatrix a(k, k), inverse = Identity(k);
    for (int i = 0; i < k; ++i) {
      const Real u = Real(i) / Real(kDegree);
      Real binomial = 1;
      for (int j = 0; j < k; ++j) {
        Real value = binomial;
        for (int p = 0; p < j; ++p) value *= u;
        for (int p = j; p < kDegree; ++p) value *= Real(1) - u;
        a(i, j) = value;
        binomial = binomial * Real(kDegree - j) / Real(j + 1);
      }
    }
    for (int p = 0; p < k; ++p) {  // Gauss-Jordan with row exchanges
      int best = p;
      for (int i = p; i < k; ++i) {
        if (Abs(a(i, p)) > Abs(a(best, p))) best = i;
      }
      for (int j = 0; j < k; ++j) {
        std::swap(a(p, j), a(best, j));
        std::swap(inverse(p, j), inverse(best, j));
      }
      const Real pivot = a(p, p);
      for (int j = 0; j < k; ++j) {
        a(p, j) = a(p, j) / pivot;
        inverse(p, j) = inverse(p, j) / pivot;
      }
      for (int i = 0; i < k; ++i) {
        if (i == p) continue;
        const Real factor = a(i, p);
        for (int j = 0; j < k; ++j) {
          a(i, j) -= factor * a(p, j);
          inverse(i, j) -= factor * inverse(p, j);
        }
      }
    }
    return inverse;
  }();
  return result;
}

// The matrix that takes the values at the even samples to what their polynomial is at the odd ones.
const DenseMatrix& OddFromEven() {
  static const DenseMatrix result = [] {
    DenseMatrix lagrange(kDegree, kDegree + 1);
    for (int i = 0; i < kDegree; ++i) {
      for (int j = 0; j <= kDegree; ++j) {
        Real value = 1;
        for (int p = 0; p <= kDegree; ++p) {
          if (p != j) value = value * (Real(2 * i + 1) - Real(2 * p)) / (Real(2 * j) - Real(2 * p));
        }
        lagrange(i, j) = value;
      }
    }
    return lagrange;
  }();
  return result;
}

// The first u in [begin, begin + width] where the polynomial is below -`allowed`; nothing if it never is.
std::optional<double> FirstBelow(const Column& bernstein, double allowed, double begin, double width, int depth) {
  if (ToDouble(bernstein.front()) < -allowed) return begin;
  double least = std::numeric_limits<double>::infinity();
  for (const Real& coefficient : bernstein) least = std::min(least, ToDouble(coefficient));
  if (least >= -allowed) return std::nullopt;
  if (depth == 0) return begin;
  Column left = bernstein, right = bernstein;  // de Casteljau
  const size_t k = bernstein.size();
  for (size_t level = 1; level < k; ++level) {
    for (size_t j = k - 1; j >= level; --j) left[j] = (left[j] + left[j - 1]) * Real(0.5);
  }
  for (size_t level = 1; level < k; ++level) {
    for (size_t j = 0; j + level < k; ++j) right[j] = (right[j] + right[j + 1]) * Real(0.5);
  }
  if (const auto found = FirstBelow(left, allowed, begin, width / 2, depth - 1)) return found;
  return FirstBelow(right, allowed, begin + width / 2, width / 2, depth - 1);
}

class Walk {
 public:
  Walk(const System& system, const std::vector<double>& times, const ReferenceLimits& limits, const Replay* replay)
      : system_(system), times_(times), limits_(limits), replay_(replay) {}

  Reference Run() {
    started_ = std::chrono::steady_clock::now();
    const int m = system_.num_states();
    const auto unknown = [this](int rows) {
      return Eigen::MatrixXd::Constant(rows, static_cast<Index>(times_.size()),
                                       std::numeric_limits<double>::quiet_NaN());
    };
    result_.times = times_;
    result_.x = unknown(m);
    result_.y = result_.w = unknown(system_.num_pairs());
    result_.outputs = unknown(system_.num_outputs());
    result_.size = system_.x0.cwiseAbs();
    result_.size_outputs = Eigen::VectorXd::Zero(system_.num_outputs());
    result_.size_y = result_.size_w = Eigen::VectorXd::Zero(system_.num_pairs());
    z_.assign(m + system_.functions.size(), 0);
    for (int i = 0; i < m; ++i) z_[i] = system_.x0(i);
    for (const SmoothInterval& interval : SmoothIntervals(system_)) {
      if (!Cross(interval)) return result_;
    }
    result_.status = Reference::Status::kReached;
    result_.end = system_.horizon;
    return result_;
  }

 private:
  struct Regime {
    RegimeSystem system;
    std::map<unsigned, std::shared_ptr<Mode>> modes;
  };

  bool Stop(Reference::Status status, const std::string& reason) {
    result_.status = status;
    result_.reason = reason;
    result_.end = ToDouble(time_);
    return false;
  }

  bool IsOutOfTime() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count() > limits_.seconds;
  }

  std::shared_ptr<Mode> ModeOf(unsigned active) {
    auto found = regime_->modes.find(active);
    if (found == regime_->modes.end()) {
      found = regime_->modes.emplace(active, Mode::Create(regime_->system, active, system_.horizon)).first;
    }
    return found->second;
  }

  // Of z_, waves with their size over the solve: what rounding is measured against.
  Column Sizes() const {
    Column sizes = z_;
    for (size_t k = 0; k < system_.functions.size(); ++k) {
      if (system_.functions[k].kind == SourceFunction::Kind::kSine) sizes[system_.num_states() + k] = 1;
    }
    return sizes;
  }

  // The largest so far of each part of z.
  Column LargestSizes() const {
    Column sizes = Sizes();
    for (int i = 0; i < system_.num_states(); ++i) sizes[i] = std::max(std::abs(ToDouble(sizes[i])), result_.size(i));
    return sizes;
  }

  // Whether y and w of `mode` are lexicographically nonnegative from z on. A row that is one state alone is zero where
  // that is, whatever its sign.
  bool CanFollow(const Mode& mode, double zero) const {
    if (system_.least_element && !mode.has_least_element()) return false;
    for (const Column& invariant : mode.invariants()) {
      if (std::abs(ToDouble(Dot(invariant.data(), z_))) >
          std::max(zero, 1e-18) * ToDouble(AbsoluteDot(invariant.data(), z_)))
        return false;
    }
    std::vector<Column> derivatives = {z_}, sizes = {z_};
    if (zero == kZeroAtStart) sizes[0] = Sizes();
    const Column largest = LargestSizes();
    for (int i = 0; i < mode.signs().rows(); ++i) {
      const bool was_held = (held_ & ~mode.active()) >> i & 1u;
      const double zero_of_value = was_held ? std::max(zero, kZeroOfHeld) : zero;
      for (int k = 0; k < kDerivatives; ++k) {
        if (static_cast<int>(derivatives.size()) <= k) {
          derivatives.push_back(mode.derivative() * derivatives.back());
          sizes.push_back(AbsoluteProduct(mode.derivative(), sizes.back()));
        }
        const double value = ToDouble(Dot(mode.signs().row(i), derivatives[k]));
        const double size = ToDouble(AbsoluteDot(mode.signs().row(i), sizes[k]));
        if (std::abs(value) <= (k == 0 ? zero_of_value : kZero) * size) continue;
        if (k == 0 && std::abs(value) <= kZeroOfLargest * ToDouble(AbsoluteDot(mode.signs().row(i), largest))) continue;
        if (value < 0) return false;
        break;
      }
    }
    return true;
  }

  // A basis whose y or w is negative at once, found without making its mode. Only where M_SS is nonsingular.
  bool IsRuledOut(unsigned active, const Column& q) const {
    const RegimeSystem& s = regime_->system;
    std::vector<int> pairs;
    for (int i = 0; i < s.num_pairs; ++i) {
      if (active >> i & 1u) pairs.push_back(i);
    }
    const int k = static_cast<int>(pairs.size());
    DenseMatrix a(k, k + 1);
    for (int i = 0; i < k; ++i) {
      for (int j = 0; j < k; ++j) a(i, j) = s.M(pairs[i], pairs[j]);
      a(i, k) = -q[pairs[i]];
    }
    for (int p = 0; p < k; ++p) {
      int best = p;
      for (int i = p; i < k; ++i) {
        if (Abs(a(i, p)) > Abs(a(best, p))) best = i;
      }
      if (std::abs(ToDouble(a(best, p))) < 1e-10) return false;  // left to the mode
      for (int j = 0; j <= k; ++j) std::swap(a(p, j), a(best, j));
      for (int i = 0; i < k; ++i) {
        if (i == p) continue;
        const Real factor = a(i, p) / a(p, p);
        for (int j = p; j <= k; ++j) a(i, j) -= factor * a(p, j);
      }
    }
    double largest = *std::max_element(size_of_q_.begin(), size_of_q_.end());
    Column y(s.num_pairs);
    for (int i = 0; i < k; ++i) {
      y[pairs[i]] = a(i, k) / a(i, i);
      largest = std::max(largest, std::abs(ToDouble(y[pairs[i]])));
    }
    for (int i = 0; i < k; ++i) {
      if (ToDouble(y[pairs[i]]) < -1e-6 * largest) return true;
    }
    for (int i = 0; i < s.num_pairs; ++i) {
      if (active >> i & 1u) continue;
      const double w = ToDouble(q[i] + Dot(s.M.row(i), y));
      if (w < -1e-6 * (largest + ToDouble(AbsoluteDot(s.M.row(i), y)))) return true;
    }
    return false;
  }

  // The modes that can follow, the nearest to `before` first; only the first one unless `all`.
  std::vector<std::shared_ptr<Mode>> Followers(unsigned before, bool all) {
    const RegimeSystem& s = regime_->system;
    Column q = s.N * z_;
    size_of_q_.clear();
    for (const Real& size : AbsoluteProduct(s.N, Sizes())) size_of_q_.push_back(ToDouble(size));
    const unsigned count = 1u << s.num_pairs;
    std::vector<unsigned> order(count);
    for (unsigned k = 0; k < count; ++k) order[k] = k ^ before;
    std::stable_sort(order.begin(), order.end(), [before](unsigned a, unsigned b) {
      return std::popcount(a ^ before) < std::popcount(b ^ before);
    });
    std::vector<std::shared_ptr<Mode>> result;
    for (const double zero : {kZero, kZeroAtStart}) {
      for (const unsigned active : order) {
        const bool is_kept = regime_->modes.count(active) > 0;
        if (!is_kept && IsRuledOut(active, q)) continue;
        const std::shared_ptr<Mode> mode = ModeOf(active);
        if (!mode || !CanFollow(*mode, zero)) {
          if (!is_kept) regime_->modes.erase(active);
          continue;
        }
        result.push_back(mode);
        if (!all) return result;
        if (IsOutOfTime()) return result;
      }
      if (!result.empty()) return result;
    }
    return result;
  }

  // Whether y and w of a reported mode are nonnegative, but for what an error of the time it begins at makes of them.
  bool IsNonnegative(const Mode& mode) const {
    const Column sizes = Sizes(), largest = LargestSizes();
    for (int i = 0; i < mode.signs().rows(); ++i) {
      const double value = ToDouble(Dot(mode.signs().row(i), z_));
      const double allowed = kReportedZero * ToDouble(AbsoluteDot(mode.signs().row(i), sizes)) +
                             kReportedZeroOfLargest * ToDouble(AbsoluteDot(mode.signs().row(i), largest));
      if (value < -allowed) return false;
    }
    return true;
  }

  // Steps to the decision that a zero stands for; false if the mode was reported to last.
  bool ReachDecision(Mode& mode, Real begin) {
    const auto next = std::lower_bound(replay_->decisions.begin(), replay_->decisions.end(), ToDouble(time_));
    const double lasted = ToDouble(time_ - begin);
    if (next != replay_->decisions.begin()) {  // the decision may be reported a little too early
      const double early = ToDouble(time_ - Real(*std::prev(next)));
      if (early < lasted && early <= kReportedTime * lasted) return true;
    }
    if (next == replay_->decisions.end()) return false;
    const double left = ToDouble(Real(*next) - time_);
    if (left <= 0) return true;
    if (left > std::max(kReportedTime * (lasted + left), kReportedMoment * system_.horizon)) return false;
    Output(mode, z_, time_, Real(*next), false);
    Follow(mode, Real(*next) - time_, {});
    return true;
  }

  std::optional<unsigned> Reported(Real time) const {
    return replay_->reported(ToDouble(time) + kPassedOver * system_.horizon);
  }

  // The mode to follow from z_ at time_ on.
  std::shared_ptr<Mode> Next(unsigned before) {
    if (!replay_) {
      const auto followers = Followers(before, false);
      return followers.empty() ? nullptr : followers.front();
    }
    if (const std::optional<unsigned> lasting = Reported(time_)) {
      // Where that one does not hold yet, the one that would be passed over.
      for (const std::optional<unsigned>& reported : {lasting, replay_->reported(ToDouble(time_))}) {
        const std::shared_ptr<Mode> mode = reported ? ModeOf(*reported) : nullptr;
        if (mode && IsNonnegative(*mode)) return mode;
      }
      return nullptr;
    }
    const auto followers = Followers(before, true);
    if (followers.empty()) return nullptr;
    if (followers.size() == 1) return followers.front();
    const double now = ToDouble(time_), probe = replay_->probe_time(now);
    std::vector<Eigen::VectorXd> states;
    for (const auto& mode : followers) {
      const Column after = mode->After(z_, Max(0, Real(probe) - time_));
      Eigen::VectorXd x(system_.num_states());
      for (Index i = 0; i < x.size(); ++i) x(i) = ToDouble(after[i]);
      states.push_back(x);
    }
    const int choice = replay_->choose(now, probe, states);
    return choice < 0 ? nullptr : followers[choice];
  }

  void Output(Mode& mode, const Column& z_before, Real begin, Real end, bool last) {
    while (next_output_ < times_.size() && (Real(times_[next_output_]) < end || last)) {
      if (Real(times_[next_output_]) > end) return;
      const Real offset = Max(0, Real(times_[next_output_]) - begin);
      const Column z = mode.After(z_before, offset);
      for (int i = 0; i < system_.num_states(); ++i) result_.x(i, static_cast<Index>(next_output_)) = ToDouble(z[i]);
      const RegimeSystem& s = regime_->system;
      const Column y = mode.y() * z, Nz = s.N * z, My = s.M * y;
      for (int i = 0; i < system_.num_pairs(); ++i) {
        result_.y(i, static_cast<Index>(next_output_)) = s.unit_of_y[i] * ToDouble(y[i]);
        result_.w(i, static_cast<Index>(next_output_)) =
            mode.IsActive(i) ? 0 : s.unit_of_w[i] * ToDouble(Nz[i] + My[i]);
      }
      for (int i = 0; i < system_.num_outputs(); ++i) {
        result_.outputs(i, static_cast<Index>(next_output_)) = ToDouble(OutputOf(i, z, y));
      }
      ++next_output_;
    }
  }

  // Output `i` of the system for the y of the scaled one.
  Real OutputOf(int i, const Column& z, const Column& y) const {
    Real sum = 0;
    for (int j = 0; j < system_.num_states(); ++j) sum += Real(system_.C(i, j)) * z[j];
    for (int j = 0; j < system_.num_pairs(); ++j)
      sum += Real(system_.D(i, j)) * (Real(regime_->system.unit_of_y[j]) * y[j]);
    return sum;
  }

  // Beyond any use, and on the way to the end of the range of numbers.
  bool IsOutgrown() const {
    return !(result_.size.maxCoeff() < kOutgrown * std::max(1.0, system_.x0.lpNorm<Eigen::Infinity>()));
  }

  void Measure(const Mode& mode, const Column& z) {
    const auto raise = [](double& size, Real value) { size = std::max(size, std::abs(ToDouble(value))); };
    for (Index i = 0; i < result_.size.size(); ++i) raise(result_.size(i), z[i]);
    const RegimeSystem& s = regime_->system;
    const Column y = mode.y() * z, Nz = s.N * z, My = s.M * y;
    for (Index i = 0; i < result_.size_y.size(); ++i) {
      raise(result_.size_y(i), Real(s.unit_of_y[i]) * y[i]);
      if (!mode.IsActive(static_cast<int>(i))) raise(result_.size_w(i), Real(s.unit_of_w[i]) * (Nz[i] + My[i]));
    }
    for (int i = 0; i < system_.num_outputs(); ++i) raise(result_.size_outputs(i), OutputOf(i, z, y));
  }

  // The whole of `interval`, from its begin; false if the walk ends.
  bool Cross(const SmoothInterval& interval) {
    auto found = regimes_.find(interval.regime);
    if (found == regimes_.end())
      found = regimes_.emplace(interval.regime, Regime{RegimeSystem(system_, interval), {}}).first;
    regime_ = &found->second;
    time_ = interval.begin;
    const Column sources = SourceValues(system_, time_);
    std::copy(sources.begin(), sources.end(), z_.begin() + system_.num_states());
    held_ = 0;
    std::shared_ptr<Mode> mode = Next(active_);
    if (!mode) return Stop(Reference::Status::kNoMode, "no mode at the start of a interval");
    active_ = mode->active();
    while (true) {
      const Real begin = time_;
      Real end = interval.end;
      bool decides = false;
      if (replay_) {
        for (const double decision : replay_->decisions) {
          if (Real(decision) > time_ + Real(kPassedOver * system_.horizon) && Real(decision) < end) {
            end = decision;
            decides = true;
            break;
          }
        }
      }
      const std::optional<unsigned> crossed = Advance(*mode, end);
      if (!result_.reason.empty()) return false;
      if (!crossed && !decides) return true;
      const unsigned before = crossed ? active_ ^ *crossed : active_;
      if (crossed && replay_ && Reported(begin) && !ReachDecision(*mode, begin))
        return Stop(Reference::Status::kNoMode, "the reported mode ends before the one behind it begins");
      held_ = active_;
      mode = Next(before);
      if (!mode) return Stop(Reference::Status::kNoMode, "no mode behind an event");
      if (crossed || mode->active() != active_) {
        result_.event_times.push_back(ToDouble(time_));
        if (++result_.events > limits_.events) return Stop(Reference::Status::kGivenUp, "too many events");
      }
      active_ = mode->active();
    }
  }

  // Continues in `mode` to its end or to `end`. Returns the bits of the pairs that end it; absent at `end`.
  std::optional<unsigned> Advance(Mode& mode, Real end) {
    const int n = system_.num_pairs();
    std::vector<Real> floor(n);  // where a row starts below zero by rounding it is judged from there
    for (int i = 0; i < n; ++i) {
      const Real value = Dot(mode.signs().row(i), z_);
      floor[i] = value < Real(0) ? value * Real(1 + 1e-12) : Real(0);
    }
    int level = std::max(0, std::min(mode.series_level(), level_));
    while (time_ < end) {
      if (++result_.steps > limits_.steps || IsOutOfTime()) {
        Stop(Reference::Status::kGivenUp, "too many steps");
        return std::nullopt;
      }
      if (level > 200) {
        Stop(Reference::Status::kGivenUp, "steps too short");
        return std::nullopt;
      }
      const Real length = std::ldexp(system_.horizon, -level);
      // Values at 32 parts of the step.
      std::vector<Column> states = {z_};
      for (int k = 0; k < 1 << kSamplesLog2; ++k) states.push_back(mode.After(states.back(), level + kSamplesLog2));
      double worst = 0;
      std::optional<double> first;
      int first_row = -1;
      for (int i = 0; i < n && worst <= kUnresolved; ++i) {
        Column even, odd;
        double size = 0;
        for (size_t k = 0; k < states.size(); ++k) {
          (k % 2 == 0 ? even : odd).push_back(Dot(mode.signs().row(i), states[k]) - floor[i]);
          size = std::max(size, ToDouble(AbsoluteDot(mode.signs().row(i), states[k])));
        }
        if (size == 0) continue;
        const Column predicted = OddFromEven() * even;
        for (int k = 0; k < kDegree; ++k) {
          const double miss = std::abs(ToDouble(predicted[k] - odd[k])) / size;
          worst = miss >= 0 ? std::max(worst, miss) : kInfinity;  // beyond the range of numbers on a long step
        }
        if (worst > kUnresolved) break;
        const auto below = FirstBelow(BernsteinFromValues() * even, kCrossed * size, 0, 1, 60);
        if (below && (!first || *below < *first)) {
          first = below;
          first_row = i;
        }
      }
      if (worst > kUnresolved) {
        ++level;
        continue;
      }
      level_ = level;
      if (first) {
        const std::optional<Real> zero = Refine(mode, first_row, floor[first_row], Real(*first) * length, length);
        if (!zero) {
          Stop(Reference::Status::kGivenUp, "a zero that could not be refined");
          return std::nullopt;
        }
        if (time_ + *zero < end) {
          Output(mode, z_, time_, time_ + *zero, false);
          Follow(mode, *zero, states);
          return 1u << first_row;
        }
      }
      if (time_ + length >= end) {
        Output(mode, z_, time_, end, end >= Real(system_.horizon));
        Follow(mode, end - time_, states);
        time_ = end;
        return std::nullopt;
      }
      if (IsOutgrown()) {
        Stop(Reference::Status::kGivenUp, "the solution outgrows the data");
        return std::nullopt;
      }
      Output(mode, z_, time_, time_ + length, false);
      for (const Column& state : states) Measure(mode, state);
      z_ = states.back();
      time_ += length;
      if (worst <= kWellResolved && level > 0) --level;
    }
    return std::nullopt;
  }

  void Follow(Mode& mode, Real offset, const std::vector<Column>& states) {
    const double parts = ToDouble(offset) / std::ldexp(system_.horizon, -level_) * (1 << kSamplesLog2);
    for (size_t k = 0; k < states.size() && static_cast<double>(k) <= parts; ++k) Measure(mode, states[k]);
    // Of a mode that is short beside the step, no state may lie inside.
    for (const double part : {0.125, 0.375, 0.625, 0.875}) Measure(mode, mode.After(z_, offset * Real(part)));
    z_ = mode.After(z_, offset);
    time_ += offset;
    Measure(mode, z_);
    // The sources anew, which keeps them exact.
    const Column sources = SourceValues(system_, time_);
    std::copy(sources.begin(), sources.end(), z_.begin() + system_.num_states());
  }

  // The zero of row `i` above `floor` at about `guess` behind time_.
  std::optional<Real> Refine(Mode& mode, int i, Real floor, Real guess, Real length) {
    const Real* row = mode.signs().row(i);
    Real offset = guess;
    const auto value_at = [&](Real at, double& size) {
      const Column z = mode.After(z_, at);
      size = ToDouble(AbsoluteDot(row, z));
      return Dot(row, z) - floor;
    };
    for (int k = 0; k < 12; ++k) {
      const Column z = mode.After(z_, offset);
      const Real value = Dot(row, z) - floor;
      if (std::abs(ToDouble(value)) <= kRefined * ToDouble(AbsoluteDot(row, z))) return offset;
      const Real slope = Dot(row, mode.derivative() * z);
      if (!(ToDouble(slope) < 0)) break;
      const Real next = offset - value / slope;
      if (next < Real(0) || next > guess + length * Real(0.125) || next < guess - length * Real(0.125)) break;
      offset = next;
    }
    // Bisection between the last value above zero and the guess.
    Real low = 0, high = guess;
    double size = 0;
    for (double back = 1e-12; back < 1; back *= 4) {
      const Real at = guess - length * Real(back);
      if (at < Real(0)) break;
      if (value_at(at, size) > Real(0)) {
        low = at;
        break;
      }
      high = at;
    }
    while (!(value_at(high, size) < Real(0))) {
      high += length * Real(1e-9);
      if (high > guess + length * Real(1e-7)) return std::nullopt;
    }
    for (int k = 0; k < 110; ++k) {
      const Real middle = (low + high) * Real(0.5);
      const Real value = value_at(middle, size);
      if (std::abs(ToDouble(value)) <= kRefined * size) return middle;
      (value < Real(0) ? high : low) = middle;
    }
    return low;
  }

  const System& system_;
  const std::vector<double>& times_;
  const ReferenceLimits limits_;
  const Replay* replay_;
  std::chrono::steady_clock::time_point started_;
  Reference result_;
  std::map<int, Regime> regimes_;
  Regime* regime_ = nullptr;
  std::vector<double> size_of_q_;
  Column z_;
  Real time_ = 0;
  unsigned active_ = 0;
  unsigned held_ = 0;  // the pairs with w = 0 in the mode that ends at time_, bits
  int level_ = 1000;   // of the last step
  size_t next_output_ = 0;
};

}  // namespace

Reference Refer(const System& system, const std::vector<double>& times, const ReferenceLimits& limits,
                const Replay* replay) {
  return Walk(system, times, limits, replay).Run();
}

double Condition(const System& system, const std::vector<double>& times, const Reference& reference, double enough,
                 const ReferenceLimits& limits) {
  constexpr int kRandomTrials = 3;
  constexpr size_t kMostSingle = 200;
  constexpr std::chrono::seconds kLongest(10);
  using Changes = Eigen::ArrayXXd;
  Random random(system.seed ^ 0xc0ffee);
  const auto any_sign = [&random] { return random.Chance(0.5) ? 1.0 : -1.0; };
  if (reference.x.size() == 0) return 0;
  bool ends_otherwise = false;
  // Zero where the limits end the reference.
  const auto changes_by = [&](const std::function<double()>& ulps) {
    Changes changes = Changes::Zero(reference.x.rows(), reference.x.cols());
    const Reference changed = Refer(Perturbed(system, ulps), times, limits);
    if (changed.status == reference.status) {
      changes = changed.x - reference.x;
      for (Index i = 0; i < changes.rows(); ++i) changes.row(i) /= reference.size(i);
      changes = changes.isFinite().select(changes, 0);
    }
    ends_otherwise |= changed.status != reference.status && changed.status != Reference::Status::kGivenUp;
    return changes;
  };
  double worst = 0;
  for (int k = 0; k < kRandomTrials && !(worst > enough); ++k) {
    worst = std::max(worst, changes_by(any_sign).abs().maxCoeff());
    if (ends_otherwise) return std::numeric_limits<double>::infinity();
  }
  size_t numbers = 0;
  Perturbed(system, [&numbers] { return static_cast<double>(++numbers); });
  // Random signs do √numbers times less than the worst at most, but for luck.
  constexpr double kLuck = 4;
  if (worst > enough || kLuck * std::sqrt(static_cast<double>(numbers)) * worst < enough) return worst;
  std::vector<Changes> of_single;
  Changes sum = Changes::Zero(reference.x.rows(), reference.x.cols());
  const auto begin = std::chrono::steady_clock::now();
  for (size_t single = 0; single < std::min(numbers, kMostSingle); ++single) {
    if (std::chrono::steady_clock::now() - begin > kLongest) break;
    of_single.push_back(changes_by([at = size_t{0}, single]() mutable { return at++ == single ? 1.0 : 0.0; }));
    sum += of_single.back().abs();
  }
  Index component = 0, time = 0;
  sum.maxCoeff(&component, &time);
  const Changes together = changes_by([&, at = size_t{0}]() mutable {
    if (at >= of_single.size()) return any_sign();
    return of_single[at++](component, time) < 0 ? -1.0 : 1.0;
  });
  return std::max(worst, together.abs().maxCoeff());
}

}  // namespace dlcs::hostile
