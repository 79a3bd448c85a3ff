// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/index_one.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"
#include "core/linalg/phi_functions.h"

namespace dlcs {
namespace {

using Sign = LexicographicRow::Sign;

constexpr int kMaxFreeSteps = 200;

Matrix Exponential(const Matrix& A) { return ComputePhiFunctions(A).phi0; }

// Follows d(t) = (e^{|A|t} - I)b, b = |B|e, whose norm ‖ |C| d ‖ is PhiBound(t): the matrices are nonnegative, so the
// row sums of their product are its product with e, and nothing cancels.
class PhiBoundSearch {
 public:
  PhiBoundSearch(const IndexOneSystem& system, double first_step)
      : abs_C_(system.C.cwiseAbs()), b_(system.B.cwiseAbs().rowwise().sum()), d_(Vector::Zero(b_.size())) {
    const Matrix Z = first_step * system.A.cwiseAbs();
    growth_.push_back(Z * ComputePhiFunctions(Z).phi1);
  }

  // e^{|A|2t} - I = 2D + D² for D = e^{|A|t} - I. Returns the bound for the doubled step alone.
  double Double() {
    const Matrix& D = growth_.back();
    growth_.push_back(2 * D + D * D);
    return MaxAbs(Vector(abs_C_ * (growth_.back() * b_)));
  }

  // Advances by the step of growth matrix `level` if the bound stays below `limit`.
  bool Advance(std::size_t level, double limit) {
    const Vector d = d_ + growth_[level] * (b_ + d_);
    const bool within = MaxAbs(Vector(abs_C_ * d)) <= limit;
    if (within) d_ = d;
    return within;
  }

  std::size_t levels() const { return growth_.size(); }

 private:
  Matrix abs_C_;
  Vector b_, d_;
  std::vector<Matrix> growth_;  // e^{|A|t} - I for t = first_step 2^k
};

// A lower bound of the largest t in [0, horizon] with PhiBound(t) <= limit, to about one part in 500: the binary digits
// of t one after the other. At most kMaxDoublings products of m × m matrices; a stop leaves what is proven.
double TimeOfPhiBound(const IndexOneSystem& system, double limit, double horizon, const std::stop_token& stop) {
  constexpr int kDigits = 9, kMaxDoublings = 30;
  const double A = InfinityNorm(system.A), BC = InfinityNorm(system.B) * InfinityNorm(system.C);
  if (A == 0 || BC == 0) return horizon;
  const double sure = std::log1p(limit / BC) / A;  // ‖C‖(e^{‖A‖t} - 1)‖B‖ <= limit
  if (sure >= horizon || stop.stop_requested()) return std::min(sure, horizon);
  const double step = std::ldexp(sure, -kDigits);
  PhiBoundSearch search(system, step);
  const auto length = [&](std::size_t level) { return std::ldexp(step, static_cast<int>(level)); };
  for (int k = 0; k < kMaxDoublings && !stop.stop_requested() && length(search.levels() - 1) < horizon; ++k) {
    if (!(search.Double() <= limit)) break;
  }
  double time = 0;
  for (std::size_t level = search.levels(); level-- > 0;) {
    if (time + length(level) < horizon && search.Advance(level, limit)) time += length(level);
  }
  if (time + 2 * step >= horizon && PhiBound(system, horizon) <= limit) return horizon;
  return std::max(time, sure);
}

// e^{At} x for ‖A‖t <= 1 by Taylor's series, whose terms have fallen below 1e-16 ‖x‖ after 18.
Vector ExponentialTimes(const Matrix& A, double t, Vector x) {
  constexpr int kTerms = 19;
  Vector term = x;
  for (int k = 1; k <= kTerms; ++k) {
    term = (t / k * (A * term)).eval();
    x += term;
  }
  return x;
}

// A time until which f_i = c + r, |r(t)| <= size (e^{‖A‖t} - 1), stays positive; since c <= size, ‖A‖ times it is at
// most log 2.
double TimePositive(double value, double size, double norm_A) {
  return norm_A == 0 || size == 0 ? HUGE_VAL : std::log1p(value / size) / norm_A;
}

// The same for the first step, where a row may start with a derivative: while its k-th derivative is
// positive, so is the row.
double FirstStepLength(const IndexOneSystem& system, const Vector& x0, const std::vector<LexicographicRow>& rows) {
  const double norm_A = InfinityNorm(system.A);
  const Matrix scaled = norm_A > 0 ? system.A / std::exp2(std::ilogb(norm_A) + 1) : system.A;
  double time = HUGE_VAL;
  Vector derivative = x0;  // in the unit of the rows
  for (int power = 0; power < system.A.rows(); ++power) {
    for (Index i = 0; i < system.C.rows(); ++i) {
      if (rows[i].sign != Sign::kPositive || rows[i].power != power) continue;
      const double size = system.C.row(i).cwiseAbs().sum() * MaxAbs(derivative);
      time = std::min(time, TimePositive(rows[i].value - rows[i].error, size, norm_A));
    }
    derivative = (scaled * derivative).eval();
  }
  return time;
}

// One further step, from a state where all rows but the unobservable ones are positive.
double NextStep(const IndexOneSystem& system, const Vector& x, const std::vector<LexicographicRow>& rows,
                double rounding) {
  const double norm_A = InfinityNorm(system.A);
  double time = HUGE_VAL;
  for (Index i = 0; i < system.C.rows(); ++i) {
    if (rows[i].sign == Sign::kZero) continue;
    const double size = system.C.row(i).cwiseAbs().sum() * MaxAbs(x);
    const double value = system.C.row(i).dot(x) - rounding * size;
    time = std::min(time, value > 0 ? TimePositive(value, size, norm_A) : 0);
  }
  return time;
}

}  // namespace

SteppingBounds ComputeSteppingBounds(const IndexOneSystem& system) {
  const double A = InfinityNorm(system.A), B = InfinityNorm(system.B), C = InfinityNorm(system.C);
  SteppingBounds bounds;
  bounds.sigma = SemicopositiveConstant(system.C * system.B);
  const double kept = 0.5 * bounds.sigma.value;
  if (!(kept > 0)) return bounds;
  bounds.step = A == 0 ? HUGE_VAL : kept / (A * (C * B + kept));
  const double resolvent = A == 0 ? 1 : 1 / (1 - bounds.step * A);  // ‖(I - hA)⁻¹‖ for h <= h̄
  bounds.rho_u = C * A * resolvent / kept;
  bounds.psi_x = resolvent * (B * bounds.rho_u + A);
  return bounds;
}

double PhiBound(const IndexOneSystem& system, double t) {
  const Matrix abs_A = system.A.cwiseAbs();
  const Matrix growth = t * abs_A * ComputePhiFunctions(t * abs_A).phi1;  // e^{|A|t} - I without cancellation
  return InfinityNorm(system.C.cwiseAbs() * growth * system.B.cwiseAbs());
}

ShortTimeBounds ComputeShortTimeBounds(const IndexOneSystem& system, double horizon, std::stop_token stop) {
  ShortTimeBounds bounds;
  bounds.sigma = TypeOneConstant(system.C * system.B);
  const double kept = 0.5 * bounds.sigma.value;
  if (!(kept > 0)) return bounds;
  bounds.epsilon1 = TimeOfPhiBound(system, kept, horizon, stop);
  const Matrix growth = Exponential(bounds.epsilon1 * system.A.cwiseAbs());  // >= |e^{At}| up to ε_1
  bounds.sigma2 = InfinityNorm(system.C.cwiseAbs() * growth) / kept;
  bounds.sigma1 = InfinityNorm(growth) + InfinityNorm(growth * system.B.cwiseAbs()) * bounds.sigma2;
  return bounds;
}

double FreeMotionTime(const IndexOneSystem& system, const Vector& x0, const Semiobservability& start, double horizon,
                      std::stop_token stop) {
  if (!start.in_cone.yes()) return 0;
  double time = std::min(horizon, FirstStepLength(system, x0, start.rows));
  Vector x = x0;
  double further = time;
  for (int step = 1; step < kMaxFreeSteps && time < horizon && !stop.stop_requested(); ++step) {
    x = ExponentialTimes(system.A, further, std::move(x));  // ‖A‖ further <= log 2
    const double rounding = RoundingOf(64 * x.size()) * step;
    further = NextStep(system, x, start.rows, rounding);
    if (!(further > 1e-9 * horizon)) break;
    time = std::min(horizon, time + further);
  }
  return time;
}

}  // namespace dlcs
