// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/mode_search.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "core/lcp/dense/history_solver.h"
#include "core/linalg/abs_times.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/decompositions.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// The longest step that is tried first, as a part of the scale, and what shorter and longer ones differ by.
// HostileAnswers of two_methods_two_solutions feels a quarter of it.
constexpr double kFirstPart = 1.0 / 1024;
constexpr int kRatio = 6;  // 2^6
// w_i above minus the rounding of so many operations on the numbers it is summed from counts as nonnegative.
constexpr Index kOperationsOfW = 16;
// Modes are kept until there are so many, and then all forgotten.
constexpr std::size_t kKeptModes = 256;

// (I - h A)⁻¹, corrected once. In balanced units its entries can be compared; in balanced order the matrix is block
// upper triangular, so that what a state does not depend on has exact zeros.
Matrix Resolvent(const BalancedMatrix& A, double h) {
  const Matrix identity = Matrix::Identity(A.matrix.rows(), A.matrix.cols());
  const Matrix matrix = identity - h * A.matrix;
  Matrix inverse = Eigen::PartialPivLU<Matrix>(matrix).inverse();
  inverse += inverse * (identity - matrix * inverse);
  return InGivenUnits(inverse, A);
}

}  // namespace

ModeSearch::ModeSearch(const Problem& problem, Selection selection, SourceSampler& sources)
    : problem_(problem),
      selection_(selection),
      sources_(sources),
      maker_(problem),
      abs_N_(problem.N.Dense().cwiseAbs()),
      balanced_(Balance(problem.A.Dense())),
      rate_(InfinityNorm(balanced_.matrix)),
      look_aheads_([this, selection](double h) {
        Matrix resolvent = Resolvent(balanced_, h);
        const Matrix of_y = problem_.N.Dense() * (resolvent * (h * problem_.B.Dense()));
        std::unique_ptr<LcpSolver> solver = MakeCoupledLcpSolver(problem_.M, of_y, selection);
        return std::make_unique<LookAhead>(
            LookAhead{std::move(resolvent), problem_.M.Dense() + of_y, std::move(solver)});
      }),
      basis_(problem.num_constraints(), 0),
      y_(problem.num_constraints()),
      f_(problem.num_states()),
      g_(problem.num_constraints()) {
  if (selection != Selection::kHistory) return;
  history_ = basis_;
  for (Index i = 0; problem.y0 && i < problem.num_constraints(); ++i) history_[i] = (*problem.y0)[i] > 0;
}

// A power of two, so that there are few.
double ModeSearch::StepOf(double t, double scale, double longest, int attempt) const {
  constexpr int kShorter = 3, kOfFastest = 6;  // attempts before these numbers
  double h = scale;
  if (!history_.empty() && attempt < kShorter) {
    // It must not pass over a hysteresis: the solution beyond would last too. So short ones come first.
    h = std::ldexp(std::min(scale, longest), -kRatio * (kShorter - 1 - attempt));
  } else if (attempt < kShorter) {
    h = std::ldexp(scale, -kRatio * attempt);
  } else if (attempt < kOfFastest) {
    const double shorter = std::ldexp(scale, -kRatio * kShorter);
    h = std::ldexp(rate_ > 0 ? std::min(shorter, 16 / rate_) : shorter, -kRatio * (attempt - kShorter));
  } else {
    h = std::ldexp(scale, kRatio * (attempt - kOfFastest + 1));
  }
  // A step below that would hardly be one: t + h is rounded. The averages of the sources look 6.3 h ahead, which is not
  // to pass the next break point.
  h = std::min(std::max(kFirstPart * h, RoundingOf(64) * std::abs(t)), longest / 8);
  return std::ldexp(1.0, std::ilogb(h));
}

ModeSearch::Proposal ModeSearch::Find(double t, const Eigen::Ref<const Vector>& x, const Vector& x_noise,
                                      const DataSizes& sizes, double scale, double longest, int attempt) {
  Proposal proposal;
  if (attempt == 0) {
    constexpr int kOfStep = 24;  // a power of two: what no shorter h shows of a pair is rounding
    const double h = std::max(std::ldexp(scale, -kOfStep), RoundingOf(64) * std::abs(t));
    proposal.mode = WithoutLcp(std::ldexp(1.0, std::ilogb(std::min(h, longest / 8))), t, x, x_noise, sizes);
    return proposal;
  }
  const double h = StepOf(t, scale, longest, attempt - 1);
  LcpSolver& solver = *LookAheadAt(h, t, x, x_noise).solver;
  bool is_found = false;
  if (!guess_.empty()) {
    basis_ = guess_;
    is_found = solver.Solve(q_, tolerance_, basis_, y_) == LcpStatus::kSolved && basis_ == guess_;
  }
  if (!history_.empty() && !is_found) basis_ = history_;
  proposal.verdict = is_found ? LcpStatus::kSolved : successors_.Solve(solver, q_, tolerance_, basis_, y_);
  ++lcps_;
  if (proposal.verdict != LcpStatus::kSolved) return proposal;
  proposal.kept_selection = solver.KeptSelection();
  if (q_begin_.size() > 0) CorrectAtBegin(basis_);
  proposal.mode = ModeOf(IndicesOf(basis_), sizes);
  return proposal;
}

ModeSearch::Proposal ModeSearch::FindBehind(double t, const Eigen::Ref<const Vector>& x, const Vector& x_noise,
                                            const DataSizes& sizes, double scale, double longest) {
  constexpr int kShortest = 48, kLeast = 10, kGrowth = 4;  // powers of two: the first parts of a step; what h grow by
  constexpr int kAgree = 3;
  const auto power_of_two = [](double h) { return std::ldexp(1.0, std::ilogb(h)); };
  const double last = power_of_two(longest / 8);
  double h = power_of_two(std::max(std::ldexp(scale, -kShortest), RoundingOf(64) * std::abs(t)));
  Proposal proposal;
  Basis found;
  int agreeing = 0;
  while (true) {
    h = std::min(h, last);
    LookAhead& look = LookAheadAt(h, t, x, x_noise);
    Basis basis = basis_;
    const LcpStatus verdict = look.solver->Solve(q_, tolerance_, basis, y_);
    ++lcps_;
    if (verdict == LcpStatus::kSolved) {
      agreeing = basis == found ? agreeing + 1 : 1;
      found = basis;
      proposal.verdict = verdict;
      proposal.kept_selection = look.solver->KeptSelection();
      if (IsSeen(look.matrix, basis) || (agreeing >= kAgree && h >= std::ldexp(scale, -kLeast))) break;
    } else {
      agreeing = 0;
    }
    if (h >= last) break;
    h = std::ldexp(h, kGrowth);
  }
  if (found.empty()) return proposal;
  basis_ = found;
  proposal.mode = ModeOf(IndicesOf(basis_), sizes);
  return proposal;
}

// Sets q and its rounding.
ModeSearch::LookAhead& ModeSearch::LookAheadAt(double h, double t, const Eigen::Ref<const Vector>& x,
                                               const Vector& x_noise) {
  LookAhead& look = look_aheads_.At(h);
  AverageSources(t, h);
  const Vector start = x + h * f_, sizes_of_start = x.cwiseAbs() + h * f_.cwiseAbs();
  q_ = problem_.N * Vector(look.resolvent * start) + g_;
  tolerance_ = RoundingOf(kOperationsOfW) * (abs_N_ * AbsTimes(look.resolvent, sizes_of_start) + g_.cwiseAbs()) +
               abs_N_ * AbsTimes(look.resolvent, kOfNoise * x_noise);
  return look;
}

// The mode in which the guard that fell has changed sides, or, where none fell, that which followed the last one
// before: if its pivot is positive, beyond a fold another solution would follow, and its pairs are nonnegative at this
// h.
const Mode* ModeSearch::WithoutLcp(double h, double t, const Eigen::Ref<const Vector>& x, const Vector& x_noise,
                                   const DataSizes& sizes) {
  if (!history_.empty()) return nullptr;
  const bool has_fallen = !flipped_.empty();
  const Basis* const known = has_fallen ? &flipped_ : successors_.After(basis_);
  if (!known) return nullptr;
  const Basis guess = *known, &before = has_fallen ? ended_ : basis_;
  LookAhead& look = LookAheadAt(h, t, x, x_noise);
  if (SignOfDeterminant(look.matrix, guess) * SignOfDeterminant(look.matrix, before) <= 0) return nullptr;
  if (!look.solver->SolvesIn(guess, q_, tolerance_, y_)) return nullptr;
  if (has_fallen && !IsSeen(look.matrix, guess)) return nullptr;
  const Mode* const mode = ModeOf(IndicesOf(guess), sizes);
  if (mode) basis_ = guess;
  return mode;
}

// Whether all pairs of the solution are larger than their rounding: w_i, or what y_i is in some w_j.
bool ModeSearch::IsSeen(const Matrix& matrix, const Basis& basis) const {
  const Vector w = q_ + matrix * y_;
  for (Index i = 0; i < w.size(); ++i) {
    const bool is_seen = basis[static_cast<std::size_t>(i)]
                             ? ((matrix.col(i) * y_[i]).array().abs() > tolerance_.array()).any()
                             : w[i] > tolerance_[i];
    if (!is_seen) return false;
  }
  return true;
}

// f and g averaged over about h behind t, s ∫ e^{-s τ} f(t + τ) dτ with s = 1/h, by the formula of Gauss and Laguerre
// with three points: exact for polynomials of degree five.
void ModeSearch::AverageSources(double t, double h) {
  // Table: Abramowitz and Stegun, 25.45, n = 3.
  constexpr double kPoints[] = {0.41577455678347908, 2.2942803602790417, 6.2899450829374792};
  constexpr double kWeights[] = {0.71109300992917302, 0.27851773356924085, 0.010389256501586136};
  f_.setZero();
  g_.setZero();
  Vector f(f_.size()), g(g_.size());
  for (std::size_t k = 0; k < std::size(kPoints); ++k) {
    sources_.F(t + kPoints[k] * h, Side::kLeft, f);
    sources_.G(t + kPoints[k] * h, Side::kLeft, g);
    f_ += kWeights[k] * f;
    g_ += kWeights[k] * g;
  }
}

void ModeSearch::BeginAt(const Vector& x0, const Vector& g) {
  if (selection_ != Selection::kAny) return;
  q_begin_ = problem_.N * x0 + g;
  q_begin_noise_ = RoundingOf(kOperationsOfW) * (abs_N_ * x0.cwiseAbs() + g.cwiseAbs());
}

// y_i of the active pairs and w_i of the others at the begin, and what rounding makes of them. Absent where M_SS is
// singular.
std::optional<ModeSearch::Pairs> ModeSearch::PairsAtBegin(const Basis& basis) const {
  const Matrix& M = problem_.M.Dense();
  const std::vector<Index> active = IndicesOf(basis);
  Vector y = Vector::Zero(q_begin_.size()), y_noise = y;
  if (!active.empty()) {
    const Matrix M_SS = M(active, active);
    const Eigen::PartialPivLU<Matrix> factors(M_SS);
    if (!(factors.rcond() > kSingularY)) return std::nullopt;
    const Matrix inverse = factors.inverse();
    const Vector of_y = -inverse * q_begin_(active);
    const Vector terms = q_begin_noise_(active) + RoundingOf(kOperationsOfW) * (M_SS.cwiseAbs() * of_y.cwiseAbs());
    y(active) = of_y;
    y_noise(active) = inverse.cwiseAbs() * terms;
  }
  Pairs pairs{q_begin_ + M * y, q_begin_noise_ + M.cwiseAbs() * (y_noise + RoundingOf(kOperationsOfW) * y.cwiseAbs())};
  for (const Index i : active) {
    pairs.values[i] = y[i];
    pairs.noise[i] = y_noise[i];
  }
  return pairs;
}

// Puts another basis in the place of one that the begin is no solution of, if there is one where no pair vanishes.
void ModeSearch::CorrectAtBegin(Basis& basis) {
  const std::optional<Pairs> proposed = PairsAtBegin(basis);
  if (!proposed || !(proposed->values.array() < -proposed->noise.array()).any()) return;
  Basis other(basis.size(), 0);
  Vector y(q_begin_.size());
  ++lcps_;
  const LcpStatus verdict = MakeLcpSolver(problem_.M, selection_)->Solve(q_begin_, q_begin_noise_, other, y);
  if (verdict != LcpStatus::kSolved) return;
  const std::optional<Pairs> pairs = PairsAtBegin(other);
  if (!pairs || !(pairs->values.array() > pairs->noise.array()).all()) return;
  basis = other;
  q_begin_.resize(0);
}

void ModeSearch::GuessAfter(const Mode& mode, Index guard) {
  std::fill(basis_.begin(), basis_.end(), 0);
  for (const Index i : mode.active) basis_[i] = 1;
  ended_ = basis_;
  basis_[guard] ^= 1;
  flipped_ = basis_;
  if (history_.empty()) return;
  // At a fold the set with this guard is that between the folds, and a solution too.
  const Matrix& M = problem_.M.Dense();
  guess_.clear();
  if (SignOfDeterminant(M, basis_) * SignOfDeterminant(M, history_) >= 0) guess_ = basis_;
}

void ModeSearch::ForgetGuess() {
  if (history_.empty()) flipped_.clear();
}

const Mode* ModeSearch::Flipped(const DataSizes& sizes) {
  if (flipped_.empty() || flips_ == 2 * problem_.num_constraints()) return nullptr;
  ++flips_;
  const Mode* mode = ModeOf(IndicesOf(std::exchange(flipped_, {})), sizes);
  return mode && (mode->num_algebraic > 0 || !history_.empty()) ? mode : nullptr;
}

void ModeSearch::Lasted(const Mode& mode) {
  q_begin_.resize(0);
  flips_ = 0;
  if (history_.empty()) return;
  guess_.clear();
  std::fill(history_.begin(), history_.end(), 0);
  for (const Index i : mode.active) history_[i] = 1;
}

const Mode* ModeSearch::ModeOf(const std::vector<Index>& active, const DataSizes& sizes) {
  if (const auto found = modes_.find(active); found != modes_.end()) return found->second.mode.get();
  if (modes_.size() == kKeptModes) modes_.clear();
  ++modes_made_;
  KeptMode& kept = modes_[active];
  kept.mode = maker_.Make(active, sizes);
  return kept.mode.get();
}

std::shared_ptr<const ModeStepper> ModeSearch::StepperOf(const Mode& mode, double length) {
  constexpr std::size_t kMost = 8;
  auto& steppers = modes_.at(mode.active).steppers;
  const auto known = std::find_if(steppers.begin(), steppers.end(),
                                  [length](const auto& stepper) { return stepper->length() == length; });
  if (known == steppers.end()) {
    if (steppers.size() == kMost) steppers.erase(steppers.begin());
    steppers.push_back(std::make_shared<ModeStepper>(mode, length));
  } else {
    (*known)->KeepResponses();
    std::rotate(known, known + 1, steppers.end());
  }
  return steppers.back();
}

}  // namespace dlcs
