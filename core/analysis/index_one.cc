// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/index_one.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/linalg/norms.h"
#include "core/linalg/phi_functions.h"

namespace dlcs {
namespace {

using Sign = LexicographicRow::Sign;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMaxFreeSteps = 200;

Matrix Exponential(const Matrix& A) { return ComputePhiFunctions(A).phi0; }

// The largest t in [0, horizon] with PhiBound(t) <= limit, from below, by bisection.
double TimeOfPhiBound(const IndexOneSystem& system, double limit, double horizon) {
  if (PhiBound(system, horizon) <= limit) return horizon;
  double low = 0, high = horizon;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (PhiBound(system, middle) <= limit ? low : high) = middle;
  }
  return low;
}

// A time until which f_i = c + r, |r(t)| <= size (e^{‖A‖t} - 1), stays positive.
double TimePositive(double value, double size, double norm_A) {
  return norm_A == 0 || size == 0 ? kInfinity : std::log1p(value / size) / norm_A;
}

// The same for the first step, where a row may start with a derivative: while its k-th derivative is
// positive, so is the row.
double FirstStep(const IndexOneSystem& system, const Vector& x0, const std::vector<LexicographicRow>& rows) {
  const double norm_A = InfinityNorm(system.A);
  const Matrix scaled = norm_A > 0 ? system.A / std::exp2(std::ilogb(norm_A) + 1) : system.A;
  double time = kInfinity;
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
  double time = kInfinity;
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
  bounds.step = A == 0 ? kInfinity : kept / (A * (C * B + kept));
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

ShortTimeBounds ComputeShortTimeBounds(const IndexOneSystem& system, double horizon) {
  ShortTimeBounds bounds;
  bounds.sigma = TypeOneConstant(system.C * system.B);
  const double kept = 0.5 * bounds.sigma.value;
  if (!(kept > 0)) return bounds;
  bounds.epsilon1 = TimeOfPhiBound(system, kept, horizon);
  const Matrix growth = Exponential(bounds.epsilon1 * system.A.cwiseAbs());  // >= |e^{At}| up to ε_1
  bounds.sigma2 = InfinityNorm(system.C.cwiseAbs() * growth) / kept;
  bounds.sigma1 = InfinityNorm(growth) + InfinityNorm(growth * system.B.cwiseAbs()) * bounds.sigma2;
  return bounds;
}

double FreeMotionTime(const IndexOneSystem& system, const Vector& x0, const Semiobservability& start,
                      double horizon) {
  if (!start.in_cone.yes()) return 0;
  double time = std::min(horizon, FirstStep(system, x0, start.rows));
  Vector x = Exponential(time * system.A) * x0;
  for (int step = 1; step < kMaxFreeSteps && time < horizon; ++step) {
    const double rounding = 1e-14 * step * static_cast<double>(x.size());
    const double further = NextStep(system, x, start.rows, rounding);
    if (!(further > 1e-9 * horizon)) break;
    x = (Exponential(std::min(further, horizon - time) * system.A) * x).eval();
    time = std::min(horizon, time + further);
  }
  return time;
}

}  // namespace dlcs
