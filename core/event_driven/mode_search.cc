// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/mode_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/lcp/dense/history_solver.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/decompositions.h"

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

// One where the four lowest derivatives of state i may depend on state j, else zero. What is farther away is smaller
// than rounding, and of wrong signs where a step is a Padé approximation.
Matrix NearStates(const Matrix& A) {
  const auto pattern = [](const Matrix& matrix) { return Matrix((matrix.array() != 0).cast<double>()); };
  const Matrix once = pattern(A) + Matrix::Identity(A.rows(), A.cols());
  const Matrix twice = pattern(once * once);
  return pattern(twice * twice);
}

}  // namespace

ModeSearch::ModeSearch(const Problem& problem, Selection selection, SourceSampler& sources)
    : problem_(problem),
      selection_(selection),
      sources_(sources),
      maker_(problem),
      abs_N_(problem.N.Dense().cwiseAbs()),
      near_(NearStates(problem.A.Dense())),
      free_(maker_.Make({}, {})),
      look_aheads_([this, selection](double h) {
        ModeStepper stepper(*free_, h);
        // By refined steps: where a far state hardly moves, the sign of that decides.
        const Vector zero = Vector::Zero(problem_.num_states());
        LegendreSeries source = LegendreSeries::Zero(problem_.num_states(), kLegendreSize);
        Matrix moved(problem_.num_states(), problem_.num_constraints());
        for (Index j = 0; j < moved.cols(); ++j) {
          source.col(0) = problem_.B.Dense().col(j);
          moved.col(j) = stepper.Solve(zero, source, zero).x.rowwise().sum();
          KeepNear(source.col(0), moved.col(j));
        }
        std::unique_ptr<LcpSolver> solver = MakeCoupledLcpSolver(problem_.M, problem_.N.Dense() * moved, selection);
        return std::make_unique<LookAhead>(LookAhead{std::move(stepper), std::move(solver)});
      }),
      basis_(problem.num_constraints(), 0),
      y_(problem.num_constraints()),
      f_begin_(problem.num_states()),
      f_end_(problem.num_states()),
      g_(problem.num_constraints()),
      f_(LegendreSeries::Zero(problem.num_states(), kLegendreSize)) {
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
    h = std::ldexp(free_->rate > 0 ? std::min(shorter, 16 / free_->rate) : shorter, -kRatio * (attempt - kShorter));
  } else {
    h = std::ldexp(scale, kRatio * (attempt - kOfFastest + 1));
  }
  // A step below that would hardly be one: t + h is rounded.
  h = std::min(std::max(kFirstPart * h, RoundingOf(64) * std::abs(t)), longest / 2);
  return std::ldexp(1.0, std::ilogb(h));
}

ModeSearch::Proposal ModeSearch::Find(double t, const Eigen::Ref<const Vector>& x, const Vector& x_noise,
                                      const DataSizes& sizes, double scale, double longest, int attempt,
                                      bool trusts_guess) {
  Proposal proposal;
  if (!free_) return proposal;
  if (trusts_guess && !guess_.empty()) {
    proposal.verdict = LcpStatus::kSolved;
    proposal.mode = ModeOf(IndicesOf(guess_), sizes);
    if (proposal.mode) return proposal;
  }
  const double h = StepOf(t, scale, longest, attempt);
  const LookAhead& look = look_aheads_.At(h);
  sources_.F(t, Side::kRight, f_begin_);
  sources_.F(t + h, Side::kLeft, f_end_);
  sources_.G(t + h, Side::kLeft, g_);
  f_.col(0) = (f_begin_ + f_end_) / 2;
  f_.col(1) = (f_end_ - f_begin_) / 2;
  const ModeStepper::Solution ahead = look.stepper.Solve(x, f_, Vector::Zero(x.size()));
  predicted_ = ahead.x.rowwise().sum();
  KeepNear(x.cwiseAbs() + f_begin_.cwiseAbs() + f_end_.cwiseAbs(), predicted_);
  q_ = problem_.N * predicted_ + g_;
  tolerance_ = RoundingOf(kOperationsOfW) * (abs_N_ * predicted_.cwiseAbs() + g_.cwiseAbs()) +
               abs_N_ * (ahead.uncertainty + kOfNoise * x_noise);
  LcpSolver& solver = *look.solver;
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

// Zeroes states far from those where `from` is not zero.
void ModeSearch::KeepNear(const Vector& from, Eigen::Ref<Vector> x) const {
  const Vector paths = near_ * (from.array() != 0).cast<double>().matrix();
  x = (paths.array() > 0).select(x, 0);
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
  basis_[guard] ^= 1;
  after_event_ = basis_;
  if (history_.empty()) return;
  // At a fold the set with this guard is that between the folds, and a solution too.
  const Matrix& M = problem_.M.Dense();
  guess_.clear();
  if (SignOfDeterminant(M, basis_) * SignOfDeterminant(M, history_) >= 0) guess_ = basis_;
}

const Mode* ModeSearch::ModeAfterEvent(const DataSizes& sizes) {
  if (after_event_.empty() || !history_.empty()) return nullptr;
  const Mode* mode = ModeOf(IndicesOf(std::exchange(after_event_, {})), sizes);
  return mode && mode->num_algebraic > 0 ? mode : nullptr;
}

void ModeSearch::Lasted(const Mode& mode) {
  q_begin_.resize(0);
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
