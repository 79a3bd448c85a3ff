// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/mode_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/linalg/balance.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// The steps of the search, as powers of 64 times this part of the scale.
constexpr double kFirstPart = 1.0 / 1024;
constexpr std::array<int, ModeSearch::kAttempts> kPowers = {0, -1, -2, 1, 2, -3};
// w_i above minus this part of the numbers it is summed from counts as nonnegative: little more than
// rounding.
constexpr double kSearchTolerance = 2e-15;
// A step below this part of t would hardly be one: t + h is rounded.
constexpr double kLeastOfTime = 1e-14;
// Modes are kept until there are so many, and then all forgotten.
constexpr std::size_t kKeptModes = 256;

}  // namespace

ModeSearch::ModeSearch(const Problem& problem, Selection selection, SourceSampler& sources)
    : problem_(problem),
      sources_(sources),
      abs_N_(problem.N.Dense().cwiseAbs()),
      norm_A_(InfinityNorm(Balance(problem.A.Dense()).matrix)),
      solvers_([&problem, selection](double h) {
        const Matrix coupling =
            h * problem.N.Dense() * (problem.B.Dense() + h / 2 * problem.A.Dense() * problem.B.Dense());
        return MakeCoupledLcpSolver(problem.M, coupling, selection);
      }),
      basis_(problem.num_constraints(), 0),
      y_(problem.num_constraints()),
      f_begin_(problem.num_states()),
      f_end_(problem.num_states()),
      g_(problem.num_constraints()) {}

ModeSearch::Proposal ModeSearch::Find(double t, const Eigen::Ref<const Vector>& x, double scale, double longest,
                                      int attempt) {
  const double quick = norm_A_ > 0 ? 16 / norm_A_ : longest;  // beyond, the Taylor polynomial is none of e^{hA}
  double h = kFirstPart * std::min(scale, quick) * std::ldexp(1.0, 6 * kPowers[attempt]);
  h = std::min({std::max(h, kLeastOfTime * std::abs(t)), longest / 2, quick / 16});
  h = std::ldexp(1.0, std::ilogb(h));  // few lengths, so that solvers are found again
  Proposal proposal;
  sources_.F(t, Side::kRight, f_begin_);
  sources_.F(t + h, Side::kLeft, f_end_);
  sources_.G(t + h, Side::kLeft, g_);
  predicted_ = problem_.A * x + f_begin_;
  predicted_ = x + h / 2 * (predicted_ + problem_.A * (x + h * predicted_) + f_end_);
  q_ = problem_.N * predicted_ + g_;
  tolerance_ = kSearchTolerance * (abs_N_ * predicted_.cwiseAbs() + g_.cwiseAbs());
  LcpSolver& solver = solvers_.At(h);
  proposal.verdict = solver.Solve(q_, tolerance_, basis_, y_);
  ++lcps_;
  if (proposal.verdict != LcpStatus::kSolved) return proposal;
  proposal.kept_selection = solver.KeptSelection();
  proposal.mode = ModeOf(basis_);
  return proposal;
}

void ModeSearch::GuessBehind(const Mode& mode, Index guard) {
  std::fill(basis_.begin(), basis_.end(), 0);
  for (const Index i : mode.active) basis_[i] = 1;
  basis_[guard] ^= 1;
}

const Mode* ModeSearch::ModeOf(const Basis& basis) {
  std::vector<Index> active;
  for (std::size_t i = 0; i < basis.size(); ++i) {
    if (basis[i]) active.push_back(static_cast<Index>(i));
  }
  if (const auto found = modes_.find(active); found != modes_.end()) return found->second.mode.get();
  if (modes_.size() == kKeptModes) modes_.clear();
  ++modes_made_;
  Kept& kept = modes_[active];
  kept.mode = MakeMode(problem_, std::move(active));
  return kept.mode.get();
}

const Mode& ModeSearch::DrawnBack(const Mode& mode, const Vector& x, const Vector& f, const Vector& g) {
  constexpr int kSpacing = 8;      // of the exponents of rates: few modes
  constexpr double kNoticed = 16;  // the least rate, over the horizon, that makes a difference
  if (!mode.differentiated()) return mode;
  Vector terms = mode.dynamics_size * x + mode.source_f.cwiseAbs() * f + mode.source_g.cwiseAbs() * g;
  const Vector of_constraints = mode.rows.cwiseAbs() * x + mode.rows_g.cwiseAbs() * g;
  std::vector<int> exponents(mode.rows.rows(), 0);
  Vector rates = Vector::Zero(mode.rows.rows());
  for (Index c = 0; c < rates.size(); ++c) {
    double rate = std::numeric_limits<double>::infinity();
    for (Index i = 0; i < terms.size(); ++i) {
      const double on_path = std::abs(mode.correction(i, c)) * of_constraints[c];
      if (on_path > 0) rate = std::min(rate, terms[i] / on_path);
    }
    if (!std::isfinite(rate) || !(rate * problem_.horizon > kNoticed)) continue;
    exponents[c] = std::ilogb(rate * problem_.horizon) / kSpacing * kSpacing;
    if (exponents[c] > 0) rates[c] = std::ldexp(1.0, exponents[c]) / problem_.horizon;
  }
  if (rates.isZero(0)) return mode;
  auto& drawn_back = modes_.at(mode.active).drawn_back;
  auto found = drawn_back.find(exponents);
  if (found == drawn_back.end()) {
    found = drawn_back.emplace(std::move(exponents), DrawBack(problem_, mode, rates)).first;
    ++modes_made_;
  }
  return found->second ? *found->second : mode;
}

}  // namespace dlcs
