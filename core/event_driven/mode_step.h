// SPDX-License-Identifier: Apache-2.0
// One step of a linear differential equation by collocation of high degree.

#ifndef DLCS_CORE_EVENT_DRIVEN_MODE_STEP_H_
#define DLCS_CORE_EVENT_DRIVEN_MODE_STEP_H_

#include <array>
#include <complex>
#include <vector>

#include "core/discretization/legendre.h"
#include "core/event_driven/mode.h"

namespace dlcs {

// Steps of one length in one mode. On [t, t + length] x is the polynomial of degree K that satisfies x' = Â x + b, Â =
// mode.dynamics, at the K right Radau points (the zeros of P_K - P_{K-1}).
//
// At the end of the step that is the Padé approximation (K-1, K) of the exponential, applied to start and source: exact
// to rounding for ‖Â‖ length up to about 6, L-stable for any. In between the error is of the size of the last
// coefficients, which shows whether the step was short enough. In the Schur form of Â each component is a scalar
// equation, whose coefficients obey a recurrence of three terms, since ∫P_k = (P_{k+1} - P_{k-1})/(2k+1): a step of any
// length costs K m² operations and no factorization. Source: [Hairer 1996] E. Hairer, G. Wanner. Solving ordinary
// differential equations II. Sections IV.3 and IV.5.
//
// The rounding of the Schur form is relative to the largest entries of its blocks. So the residual of the equations is
// computed with Â itself, and corrected in rows where it exceeds the rounding of the row. After this iterative
// refinement each component is as accurate as its own row of Â determines it.
class ModeStepper {
 public:
  // Keeps a reference to `mode`.
  ModeStepper(const Mode& mode, double length);

  struct Solution {
    LegendreSeries x;
    // The size of the last correction, where a further one would still have changed the solution; mostly zero.
    Vector uncertainty;
  };
  // The step from `start` with the source b = `source`.
  Solution Solve(const Eigen::Ref<const Vector>& start, const LegendreSeries& source) const;

  // The propagation of errors: Solve() for constant sources, without refinement. `starts` and `sources` have one column
  // for each error. Returns the errors at the times whose LegendreValues() are the columns of `at`: all times of the
  // first error, then of the second, and so on.
  Matrix Respond(const Eigen::Ref<const Matrix>& starts, const Eigen::Ref<const Matrix>& sources,
                 const Eigen::Ref<const Matrix>& at) const;

 private:
  using Complex = std::complex<double>;
  using ComplexSeries = Eigen::Matrix<Complex, Eigen::Dynamic, kLegendreSize, Eigen::RowMajor>;
  // The coefficients of the elimination for z = λ/2: c_k = (data) + ratio_k c_{k-1}.
  struct Scalar {
    std::array<Complex, kLegendreSize> ratio, over_divisor;
    std::array<Complex, kLegendreSize> weight;  // z / (2k+3) of the next coefficient
    Complex over_pivot;
    Complex over_sum;
  };
  static Scalar Eliminate(Complex z);
  // c with Σ(-1)^k c_k = integral_0 and c_k = integral_k + the integral of z c.
  static void SolveScalar(const Scalar& scalar, Complex* integral);
  // The same for all states: column 0 of `integral` is the start, column k the coefficient of P_k in the integral of
  // the source.
  LegendreSeries SolveIntegrated(const LegendreSeries& integral) const;
  void SolveTriangle(ComplexSeries& c) const;

  const Mode& mode_;
  double half_;
  std::vector<Scalar> scalars_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_MODE_STEP_H_
