// SPDX-License-Identifier: Apache-2.0
#include "core/context/sizes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/linalg/norms.h"
#include "core/linalg/strong_components.h"
#include "core/problem/verdict.h"

namespace dlcs {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The logarithms of d for one block, in the order of `block`, by Osborne's iteration: each unknown in turn is scaled
// until its row and column sums agree. `place` is the position of a state in the block, or -1. Not by powers of two,
// since other units of the states must give the same sizes.
Vector BalanceBlock(const RowMajorMatrix& gains, const RowMajorMatrix& transposed, const std::vector<Index>& block,
                    const std::vector<Index>& place) {
  // Of the sums: sizes are orders of magnitude, which the percent or so that a factor of 4 here makes does not change.
  constexpr double kBalanced = 1e-3;
  constexpr int kMaxSweeps = 100;     // balancing that is 1e5 off changes few verdicts
  const auto size = static_cast<Index>(block.size());
  Vector d = Vector::Zero(size);
  // The logarithm of Σ_j entry_j e^(sign · d_j) over the other states of the block.
  const auto log_sum = [&](const RowMajorMatrix& matrix, Index state, double sign) {
    double largest = -kInfinity, sum = 0;
    for (int pass = 0; pass < 2; ++pass) {
      for (RowMajorMatrix::InnerIterator entry(matrix, state); entry; ++entry) {
        const Index at = place[static_cast<std::size_t>(entry.col())];
        if (at < 0 || entry.col() == state || entry.value() == 0) continue;
        const double term = std::log(entry.value()) + sign * d[at];
        pass == 0 ? largest = std::max(largest, term) : sum += std::exp(term - largest);
      }
    }
    return largest + std::log(sum);
  };
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    double change = 0;
    for (Index k = 0; k < size; ++k) {
      const Index state = block[static_cast<std::size_t>(k)];
      const double row = log_sum(gains, state, 1) - d[k], column = log_sum(transposed, state, -1) + d[k];
      if (!std::isfinite(row - column)) continue;
      d[k] += (row - column) / 2;
      change = std::max(change, std::abs(row - column));
    }
    if (change <= kBalanced) break;
  }
  return d;
}

void Raise(double size, const std::optional<Component>& beside, Index at, SizesBeside& sizes) {
  if (!(size > sizes.size[at])) return;
  sizes.size[at] = size;
  sizes.beside[static_cast<std::size_t>(at)] = beside;
}

// The terms of a sum by their sizes, and what is behind the largest of them; sources are behind it at first.
struct SumOfSizes {
  double sum, most;
  std::optional<Component> beside = {};

  explicit SumOfSizes(double sources) : sum(sources), most(sources) {}
  void Add(double size, const std::optional<Component>& of) {
    sum += size;
    if (size > most) beside = of;
    most = std::max(most, size);
  }
};

// Rounding is estimated by samples of its signs, which may be small by chance: in 3 of 4,030 plain systems a small
// component was off by 2.3 to 3.6 times its largest sample. Where steps are others, so are the samples.
constexpr double kOfSamples = 2;

// The rounding of a component that is not known by its own size.
double RoundingBySamples(const ErrorsByCause& errors, Index i) { return kOfSamples * errors.rounding[i]; }

}  // namespace

bool IsRounding(const ErrorsByCause& errors, Index i) { return errors.own[i] <= RoundingBySamples(errors, i); }

SizesBeside OwnSizes(const ErrorsByCause& errors, ComponentKind kind) {
  SizesBeside sizes{errors.own, {}};
  for (Index i = 0; i < errors.size(); ++i) sizes.beside.push_back(Component{kind, i});
  return sizes;
}

void SizesBeside::RaiseTo(const SizesBeside& other) {
  if (size.size() == 0) *this = other;
  for (Index i = 0; i < other.size.size(); ++i)
    Raise(other.size[i], other.beside[static_cast<std::size_t>(i)], i, *this);
}

void AllSizesBeside::RaiseTo(const AllSizesBeside& other) {
  for (std::size_t kind = 0; kind < kinds.size(); ++kind) kinds[kind].RaiseTo(other.kinds[kind]);
}

SizesBeside StatesBeside(const RowMajorMatrix& dynamics, const Vector& sources, double horizon,
                         const ErrorsByCause& states) {
  const Index m = states.size();
  const RowMajorMatrix rates = dynamics.cwiseAbs();
  const Vector memory = (Vector(dynamics.diagonal()).cwiseAbs().array() + 1 / horizon).inverse();
  const RowMajorMatrix gains = memory.asDiagonal() * rates;
  const RowMajorMatrix transposed = gains.transpose();
  SizesBeside sizes = OwnSizes(states, ComponentKind::kState);
  std::vector<Index> place(static_cast<std::size_t>(m), -1);
  const std::vector<std::vector<Index>> blocks = StronglyConnected(rates);
  for (auto next = blocks.rbegin(); next != blocks.rend(); ++next) {  // what a block depends on comes before it
    const std::vector<Index>& block = *next;
    for (std::size_t k = 0; k < block.size(); ++k) place[static_cast<std::size_t>(block[k])] = static_cast<Index>(k);
    const Vector log_d = block.size() > 1 ? BalanceBlock(gains, transposed, block, place) : Vector::Zero(1);
    const bool is_rounding =
        std::all_of(block.begin(), block.end(), [&](Index state) { return IsRounding(states, state); });
    // The largest own_k / d_k, as a logarithm, and what decides it.
    double largest = -kInfinity;
    std::optional<Component> beside;
    for (std::size_t k = 0; k < block.size(); ++k) {
      const Index state = block[k];
      double size = states.own[state];
      std::optional<Component> decides = Component{ComponentKind::kState, state};
      if (is_rounding) {
        SumOfSizes enters(sources[state]);
        double leaves = 1 / horizon;
        for (RowMajorMatrix::InnerIterator entry(rates, state); entry; ++entry) {
          const Index at = place[static_cast<std::size_t>(entry.col())];
          if (at >= 0) {
            leaves += entry.value() * std::exp(log_d[at] - log_d[static_cast<Index>(k)]);
          } else {
            enters.Add(entry.value() * sizes.size[entry.col()], sizes.beside[static_cast<std::size_t>(entry.col())]);
          }
        }
        if (enters.sum / leaves > size) {
          size = enters.sum / leaves;
          decides = enters.beside;
        }
      }
      const double part = std::log(size) - log_d[static_cast<Index>(k)];
      if (!(part > largest)) continue;
      largest = part;
      beside = decides;
    }
    for (std::size_t k = 0; k < block.size(); ++k) {
      const double size = std::exp(largest + log_d[static_cast<Index>(k)]);
      Raise(size, beside, block[k], sizes);
      place[static_cast<std::size_t>(block[k])] = -1;
    }
  }
  return sizes;
}

SizesBeside RowsBeside(const RowMajorMatrix& rows, const SizesBeside& states, ComponentKind kind,
                       const ErrorsByCause& errors, const Vector& of_sources) {
  const RowMajorMatrix terms = rows.cwiseAbs();
  SizesBeside sizes = OwnSizes(errors, kind);
  for (Index i = 0; i < errors.size(); ++i) {
    SumOfSizes sum(IsRounding(errors, i) ? of_sources[i] : 0);
    for (RowMajorMatrix::InnerIterator entry(terms, i); entry; ++entry) {
      sum.Add(entry.value() * states.size[entry.col()], states.beside[static_cast<std::size_t>(entry.col())]);
    }
    Raise(sum.sum, sum.beside, i, sizes);
  }
  return sizes;
}

std::optional<double> AbsoluteToleranceOf(const Options& options, const Component& component) {
  const auto& of_components = options.absolute_tolerances;
  const auto found = std::find_if(of_components.begin(), of_components.end(),
                                  [&](const auto& given) { return given.component == component; });
  return found != of_components.end() ? found->tolerance : options.absolute_tolerance;
}

Vector AbsoluteTolerances(const Options& options, ComponentKind kind, Index n) {
  Vector given = Vector::Constant(n, options.absolute_tolerance.value_or(0));
  for (const ComponentTolerance& of_component : options.absolute_tolerances) {
    const Component& component = of_component.component;
    if (component.kind == kind && component.index < n) given[component.index] = of_component.tolerance;
  }
  return given;
}

namespace {

// The components of one kind.
class Judge {
 public:
  Judge(const Options& options, double tolerance, Accuracy& accuracy)
      : options_(options), tolerance_(tolerance), accuracy_(accuracy) {}

  bool AreAllSmall(ComponentKind kind) const;
  // Adds what is named to the accuracy, and raises its error.
  void Add(ComponentKind kind, const SizesBeside& sizes);

 private:
  // Known or given; decides without R.
  bool IsSmall(const ErrorsByCause& errors, Index i, std::optional<double> given) const {
    const double error = errors.truncation[i] + errors.rounding[i];
    return error <= tolerance_ * errors.own[i] || error <= given.value_or(-1);
  }

  const Options& options_;
  double tolerance_;
  Accuracy& accuracy_;
};

bool Judge::AreAllSmall(ComponentKind kind) const {
  const ErrorsByCause& errors = accuracy_.errors.of(kind);
  for (Index i = 0; i < errors.size(); ++i) {
    if (!IsSmall(errors, i, AbsoluteToleranceOf(options_, {kind, i}))) return false;
  }
  return true;
}

void Judge::Add(ComponentKind kind, const SizesBeside& sizes) {
  const ErrorsByCause& errors = accuracy_.errors.of(kind);
  for (Index i = 0; i < errors.size(); ++i) {
    const Component component{kind, i};
    const std::optional<double> given = AbsoluteToleranceOf(options_, component);
    const double own = errors.own[i], truncation = errors.truncation[i], rounding = RoundingBySamples(errors, i);
    const double beside = sizes.size.size() > 0 ? sizes.size[i] : own;
    const bool is_small = IsSmall(errors, i, given);
    const bool is_rounding = !is_small && truncation <= rounding && rounding <= tolerance_ * beside;
    NamedComponent named{.component = component, .own = own, .truncation = truncation, .rounding = rounding};
    if (is_rounding && IsRounding(errors, i)) {
      named.knowledge = Knowledge::kZero;
    } else if (is_rounding && !given && own <= tolerance_ * beside) {
      named.knowledge = Knowledge::kNegligible;
      named.digits = static_cast<int>(std::floor(std::log10(own / rounding)));
    } else {
      const double size = std::max(own, given.value_or(0) / tolerance_);
      named.rounding = errors.rounding[i];
      const double error = truncation + named.rounding;
      accuracy_.error = NanMax(accuracy_.error, error == 0 ? 0 : error / size);
      named.allowed = tolerance_ * size;
    }
    if (is_small) continue;
    if (named.knowledge == Knowledge::kMissed && accuracy_.tolerance == 0) {
      if (kind == ComponentKind::kPair || kind == ComponentKind::kSlack) continue;
      named.allowed = kFirstDigit * own;
      if (truncation + named.rounding <= named.allowed) continue;
    }
    if (sizes.size.size() > 0 && sizes.beside[static_cast<std::size_t>(i)] != component) {
      named.beside = sizes.beside[static_cast<std::size_t>(i)];
    }
    accuracy_.named.push_back(named);
  }
}

// The error that must be allowed so that a component is accepted by other steps too.
double SufficientError(double truncation, double rounding) {
  return kOfSamples * rounding + std::max(truncation, kOfSamples * rounding);
}

// Where a component missed. Those that were accepted by less than is certain may miss with other steps, and are part of
// it.
class Advisor {
 public:
  Advisor(const Options& options, double tolerance, AllSizesBeside beside, const Accuracy& accuracy)
      : options_(options), tolerance_(tolerance), beside_(std::move(beside)), accuracy_(accuracy) {}

  Advice ForTolerances();
  // Steps that were given are the same again, unless there is a tolerance: then they are shortened as far as it takes.
  Advice ForGivenSteps();

 private:
  // The least tolerance by which a component is accepted for certain.
  double SufficientTolerance(const Component& component, double truncation);
  // Infinite where steps are so long that they leave nothing of the component: an absolute tolerance hides that.
  static Advice::OfComponent Absolute(const Component& component, double own, double truncation, double rounding);

  const Options& options_;
  double tolerance_;
  AllSizesBeside beside_;
  const Accuracy& accuracy_;
};

double Advisor::SufficientTolerance(const Component& component, double truncation) {
  const ErrorsByCause& errors = accuracy_.errors.of(component.kind);
  const double own = errors.own[component.index], rounding = RoundingBySamples(errors, component.index);
  const double error = SufficientError(truncation, errors.rounding[component.index]);
  const std::optional<double> given = AbsoluteToleranceOf(options_, component);
  if (error <= given.value_or(0)) return 0;
  const double known = error / own;
  if (given || !(truncation <= rounding)) return known;
  const Vector& sizes = beside_.of(component.kind).size;
  const double beside = sizes.size() > 0 ? sizes[component.index] : own;
  return std::min(known, std::max(own, kOfSamples * rounding) / beside);
}

Advice::OfComponent Advisor::Absolute(const Component& component, double own, double truncation, double rounding) {
  const bool hides = truncation > rounding && truncation >= own;
  return {component, hides ? kInfinity : SufficientError(truncation, rounding), NumberedName(component)};
}

Advice Advisor::ForTolerances() {
  Advice advice;
  advice.tolerance = 0;
  for (const ComponentKind kind : kComponentKinds) {
    const ErrorsByCause& errors = accuracy_.errors.of(kind);
    for (Index i = 0; i < errors.size(); ++i) {
      const Component component{kind, i};
      const double of_one = SufficientTolerance(component, errors.truncation[i]);
      if (of_one <= tolerance_) continue;
      advice.tolerance = NanMax(advice.tolerance, of_one);
      advice.absolute.push_back(Absolute(component, errors.own[i], errors.truncation[i], errors.rounding[i]));
    }
  }
  return advice;
}

Advice Advisor::ForGivenSteps() {
  Advice advice;
  advice.tolerance = kFirstDigit;
  for (const ComponentKind kind : kComponentKinds) {
    for (Index i = 0; i < accuracy_.errors.of(kind).size(); ++i) {
      advice.tolerance = NanMax(advice.tolerance, SufficientTolerance({kind, i}, /*truncation=*/0));
    }
  }
  for (const NamedComponent& named : accuracy_.named) {
    if (named.knowledge != Knowledge::kMissed) continue;
    advice.absolute.push_back(Absolute(named.component, named.own, named.truncation, named.rounding));
  }
  return advice;
}

// Missed components by how far they miss what is allowed.
double Excess(const NamedComponent& named) { return (named.truncation + named.rounding) / named.allowed; }

}  // namespace

double ExcessOfTruncation(const TrajectoryErrors& errors, const Options& options, double tolerance) {
  double excess = 0;
  for (const ComponentKind kind : kComponentKinds) {
    const ErrorsByCause& of_kind = errors.of(kind);
    const Vector given = AbsoluteTolerances(options, kind, of_kind.size());
    const Vector allowed = (tolerance * of_kind.own).cwiseMax(given) - of_kind.rounding;
    const Vector seen_to = allowed.cwiseMax(of_kind.rounding);
    for (Index i = 0; i < of_kind.size(); ++i) {
      if (of_kind.truncation[i] != 0) excess = NanMax(excess, of_kind.truncation[i] / seen_to[i]);
    }
  }
  return excess;
}

void JudgeComponents(const Options& options, const std::function<AllSizesBeside()>& sizes, Accuracy& accuracy) {
  const double tolerance = accuracy.tolerance > 0 ? accuracy.tolerance : Options::kDefaultErrorTolerance;
  accuracy.error = 0;
  accuracy.has_absolute_tolerances = options.absolute_tolerance.has_value() || !options.absolute_tolerances.empty();
  accuracy.named.clear();
  Judge judge(options, tolerance, accuracy);
  const bool all_accepted = std::all_of(std::begin(kComponentKinds), std::end(kComponentKinds),
                                        [&](ComponentKind kind) { return judge.AreAllSmall(kind); });
  AllSizesBeside beside = all_accepted ? AllSizesBeside{} : sizes();
  for (const ComponentKind kind : kComponentKinds) judge.Add(kind, beside.of(kind));
  for (NamedComponent& named : accuracy.named) {
    named.name = NumberedName(named.component);
    if (!named.beside) continue;
    named.beside_own = accuracy.errors.of(named.beside->kind).own[named.beside->index];
    named.beside_name = NumberedName(*named.beside);
  }
  std::stable_sort(accuracy.named.begin(), accuracy.named.end(), [](const NamedComponent& a, const NamedComponent& b) {
    const bool a_missed = a.knowledge == Knowledge::kMissed, b_missed = b.knowledge == Knowledge::kMissed;
    if (a_missed != b_missed) return b_missed;
    return a_missed && !(Excess(a) <= Excess(b));
  });
  accuracy.advice = {};
  if (accuracy.named.empty() || accuracy.named.back().knowledge != Knowledge::kMissed) return;
  Advisor advisor(options, tolerance, std::move(beside), accuracy);
  accuracy.advice = accuracy.tolerance > 0 ? advisor.ForTolerances() : advisor.ForGivenSteps();
}

}  // namespace dlcs
