// SPDX-License-Identifier: Apache-2.0

#include "core/nonlinear/nonlinear_step.h"

#include <limits>

#include "core/lcp/basis/tolerance.h"
#include "core/linalg/norms.h"
#include "core/linalg/panel_lu.h"
#include "core/linalg/panel_product.h"

namespace dlcs {
namespace {

class JointStep {
 public:
  JointStep(NonlinearFunctions& functions, double t, const Vector& known, const Matrix& after, const Matrix& W,
            const Vector& guess)
      : functions_(functions), t_(t), known_(known), after_(after), W_(W), guess_(guess) {}

  // x for a given y: NaN where Newton's method finds none.
  Vector State(const Vector& y) {
    constexpr int kMaxNewtonSteps = 30;
    Vector x = guess_;
    double last_change = std::numeric_limits<double>::infinity();
    for (int k = 0; k < kMaxNewtonSteps; ++k) {
      const Vector defect = x - known_ - after_ * (functions_.F(t_, x, y) - W_ * x);
      const Vector dx = PanelLu(Slope(x, y)).Solve(-defect);
      if (!dx.allFinite()) break;
      x += dx;
      const double change = MaxAbs(dx);
      const double size = MaxAbs(x) + MaxAbs(known_);
      if (change <= kRowRounding * size || (change >= last_change && change <= kMaybeZero * size)) return x;
      last_change = change;
    }
    return Vector::Constant(guess_.size(), std::numeric_limits<double>::quiet_NaN());
  }

  Vector Value(const Vector& y) { return functions_.G(t_, State(y), y); }

  Matrix Jacobian(const Vector& y) {
    const Vector x = State(y);
    const Matrix x_by_y = PanelLu(Slope(x, y)).Solve(Product(after_, functions_.FByY(t_, x, y)));
    return functions_.GByY(t_, x, y) + Product(functions_.GByX(t_, x, y), x_by_y);
  }

 private:
  Matrix Slope(const Vector& x, const Vector& y) {
    return Matrix::Identity(x.size(), x.size()) - Product(after_, functions_.FByX(t_, x, y) - W_);
  }

  NonlinearFunctions& functions_;
  const double t_;
  const Vector& known_;
  const Matrix& after_;
  const Matrix& W_;
  const Vector guess_;
};

}  // namespace

ComplementarityResult SolveCoupledStep(NonlinearFunctions& functions, double t, const Vector& known,
                                       const Matrix& after, const Matrix& W, Vector& x, Vector& y) {
  JointStep step(functions, t, known, after, W, x);
  const ComplementarityFunction function{[&](const Vector& at) { return step.Value(at); },
                                         [&](const Vector& at) { return step.Jacobian(at); }};
  ComplementarityResult result = JosephyNewton(Selection::kAny).Solve(function, y);
  const Vector found = step.State(y);
  if (result.verdict == ComplementarityResult::Verdict::kSolved) {
    x = found;
  } else if (!found.allFinite()) {
    result.verdict = ComplementarityResult::Verdict::kStalled;
    result.why = "Newton's method finds no x at its end: f may jump there, or change too fast with x";
    result.no_state = true;
  }
  return result;
}

}  // namespace dlcs
