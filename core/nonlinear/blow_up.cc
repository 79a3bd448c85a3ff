// SPDX-License-Identifier: Apache-2.0
#include "core/nonlinear/blow_up.h"

#include <cmath>
#include <limits>
#include <utility>

#include "core/linalg/norms.h"
#include "core/nonlinear/josephy_newton.h"
#include "core/nonlinear/window_sources.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

// x' as a function of t and x alone.
class Slope {
 public:
  Slope(NonlinearFunctions& functions, Selection selection, Vector y)
      : functions_(functions), newton_(selection), y_(std::move(y)) {}

  // NaN where there is no y.
  Vector At(double t, const Vector& x) {
    const bool solved = SolveForY(functions_, newton_, t, x, y_).verdict == ComplementarityResult::Verdict::kSolved;
    if (!solved) return Vector::Constant(x.size(), std::numeric_limits<double>::quiet_NaN());
    return functions_.F(t, x, y_);
  }

 private:
  NonlinearFunctions& functions_;
  JosephyNewton newton_;
  Vector y_;  // the last one, as a guess for the next
};

}  // namespace

std::optional<BlowUp> FindBlowUp(NonlinearFunctions& functions, Selection selection, double t, double horizon,
                                 const Vector& x0, const Vector& y) {
  constexpr int kMostSteps = 4000;
  constexpr double kGrowth = 0.1;  // of x in a step
  constexpr double kGrown = 1e30;
  constexpr double kShrunk = 1e-3;  // of the time that x takes to grow
  Slope slope(functions, selection, y);
  Vector x = x0;
  double first_time_scale = 0;
  for (int k = 0; k < kMostSteps; ++k) {
    LookForStop();
    const Vector k1 = slope.At(t, x);
    const double size = MaxAbs(x);
    const double time_scale = size / MaxAbs(k1);
    if (!(time_scale > 0) || !std::isfinite(time_scale)) return std::nullopt;
    if (k == 0) first_time_scale = time_scale;
    if (size >= kGrown * MaxAbs(x0)) {
      if (time_scale > kShrunk * first_time_scale) return std::nullopt;
      BlowUp found;
      x.cwiseAbs().maxCoeff(&found.state);
      found.time = t;
      found.value = x[found.state];
      return found;
    }
    const double h = kGrowth * time_scale;
    if (!(t + h <= horizon)) return std::nullopt;
    const Vector k2 = slope.At(t + h / 2, x + h / 2 * k1);
    const Vector k3 = slope.At(t + h / 2, x + h / 2 * k2);
    const Vector k4 = slope.At(t + h, x + h * k3);
    x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    t += h;
  }
  return std::nullopt;
}

}  // namespace dlcs
