// SPDX-License-Identifier: Apache-2.0
// One step of a linear differential equation by collocation of high degree.

#ifndef DLCS_CORE_EVENT_DRIVEN_MODE_STEP_H_
#define DLCS_CORE_EVENT_DRIVEN_MODE_STEP_H_

#include <array>
#include <complex>
#include <optional>
#include <vector>

#include "core/discretization/legendre.h"
#include "core/event_driven/mode.h"

namespace dlcs {

// An upper bound of |series| on a step, for each row.
inline Vector SizeOfRows(const LegendreSeries& series) { return series.cwiseAbs().rowwise().sum(); }

// Steps of one length in one mode. On [t, t + length] x is the polynomial of degree K that satisfies E x' = F x + b
// (core/event_driven/mode.h) at the K right Radau points (the zeros of P_K - P_{K-1}).
//
// At the end of the step that is the Padé approximation (K-1, K) of the exponential, applied to start and source: exact
// to rounding for rates times length up to about 6, L-stable for any; algebraic equations hold exactly. In between the
// error is of the size of the last coefficients, which shows whether the step was short enough. In the triangular form
// of the mode each component is a scalar equation, whose coefficients obey a recurrence of three terms, since ∫P_k =
// (P_{k+1} - P_{k-1})/(2k+1): a step of any length costs K m² operations and no factorization. Source: [Hairer 1996] E.
// Hairer, G. Wanner. Solving ordinary differential equations II. Sections IV.3, IV.5, and VI.1.
//
// The rounding of the triangular form is relative to the largest entries of its blocks. So the residual of the
// equations is computed with E and F themselves, and corrected in rows where it exceeds the rounding of the row. After
// this iterative refinement each component is as accurate as the rows of E and F determine it.
class ModeStepper {
 public:
  // Keeps a reference to `mode`.
  ModeStepper(const Mode& mode, double length);

  const Mode& mode() const { return *mode_; }
  double length() const { return 2 * half_; }

  struct Solution {
    LegendreSeries x;
    LegendreSeries slope;       // x', as a polynomial of degree K - 1; empty for an explicit mode
    Vector slope_noise;         // the rounding error of each row of it, ...
    Vector source_slope_noise;  // ... and the part of it that the slopes of polynomials of sources have
    // A fast state that does not start where it settles leaves a multiple of P_K - P_{K-1} on a step that is much
    // longer than it takes to settle. No Radau point sees it. It is subtracted: x and slope are what remains. Of each
    // state what was subtracted, ...
    Vector layer;
    Eigen::VectorXcd layer_parts;  // ... and of each component of the triangular form; may be empty where it is zero.
    // The states that are zero, since nothing that is not zero reaches them; known where E is not the identity.
    std::vector<Index> unreached;
    // The size of layers that may be rounding and were left in x, as far as its last coefficients show them.
    Vector kept_layer;
    // The size of the last correction, where a further one would still have changed the solution; mostly zero.
    Vector uncertainty;
    // Half the length of the step in the times in which the terms of each row act, at most 2K + 1: by these stiff rows
    // answer to rounding in their coefficients, which come to (2k + 1) times that of an integral.
    Vector stiffness;
    // Where a row is stiffer than this, its value at the end of the step does not depend on that at the start.
    static constexpr double kForgets = 2;
    bool IsStiff() const { return (stiffness.array() > kForgets).any(); }
    // What one more correction would change in x: the rounding that the refinement leaves, inside the step too.
    LegendreSeries left;
    // Of its last coefficients. Zero if no row is stiff, or if all last coefficients are no more than rounding of x.
    Vector last_noise;
  };
  // The derivative of the source of the algebraic equations, where it is known better than from its polynomial: its
  // noise is infinite where it is not.
  struct SlopeOfSource {
    LegendreSeries values;
    Vector noise;
  };
  // The step from `start` with the source b = `source`, whose coefficients have rounding errors of the size
  // `source_noise`.
  Solution Solve(const Eigen::Ref<const Vector>& start, const LegendreSeries& source, const Vector& source_noise,
                 const SlopeOfSource& slope = {}) const;

  // The propagation of errors: Solve() for constant sources, without refinement and layers. `starts` and `sources` have
  // one column for each error; an empty `sources` stands for zero. `values` are the errors at the times whose
  // LegendreValues() are the columns of `at`: all times of the first error, then of the second, and so on; `slopes`
  // their derivatives, if the mode is not explicit.
  struct Response {
    Matrix values;
    Matrix slopes;
  };
  Response Respond(const Eigen::Ref<const Matrix>& starts, const Eigen::Ref<const Matrix>& sources,
                   const Eigen::Ref<const Matrix>& at) const;
  // The same at one position, and the values at kLooks positions, the last one the end.
  Response RespondAt(double s, const Eigen::Ref<const Matrix>& starts, const Eigen::Ref<const Matrix>& sources) const;
  static constexpr Index kLooks = 4;
  Matrix RespondAtLooks(const Eigen::Ref<const Matrix>& starts, const Eigen::Ref<const Matrix>& sources) const;

  // What the starts in the columns, without sources, make of the last two coefficients of x at most: rounding of the
  // start that a fast state has to settle from.
  Vector LastOfStarts(const Eigen::Ref<const Matrix>& starts) const;

  // The slopes at the start of the layers `parts` (Solution::layer_parts), for each component of the triangular form:
  // of what they are beyond what an ulp of `start`, and the errors of it in the columns of `errors`, make. Algebraic
  // components have none.
  Eigen::VectorXcd SlopesOfLayers(const Eigen::VectorXcd& parts, const Eigen::Ref<const Vector>& start,
                                  const Eigen::Ref<const Matrix>& errors) const;

  // Makes the looks, and the end as one position, products with kept matrices from now on, as pays where a step is
  // taken many times. Does nothing for more than a few states, and where a component is fast, since what is a layer is
  // no linear function.
  void KeepResponses();

 private:
  using Complex = std::complex<double>;
  using ComplexRow = Eigen::Matrix<Complex, 1, kLegendreSize>;
  using ComplexSeries = Eigen::Matrix<Complex, Eigen::Dynamic, kLegendreSize, Eigen::RowMajor>;
  // The coefficients of the elimination for z = λ/2: c_k = (data) + ratio_k c_{k-1}.
  struct Scalar {
    Complex z;
    Complex over_slope;  // 1 / slope_triangle(j, j)
    std::array<Complex, kLegendreSize> ratio, over_divisor;
    std::array<Complex, kLegendreSize> weight;  // z / (2k+3) of the next coefficient
    Complex over_pivot;
    Complex over_sum;
  };
  static Scalar Eliminate(Complex slope, Complex half_rate);
  // c with Σ(-1)^k c_k = integral_0 and c_k = integral_k + the integral of z c.
  static void SolveScalar(const Scalar& scalar, Complex* integral);
  // The components of the triangular form: row j of `c` holds the start in column 0, in column k the coefficient of P_k
  // in the integral of the source.
  void SolveTriangle(ComplexSeries& c) const;
  // The same for states and equations: column 0 of `integral` belongs to the states, the others to the equations.
  ComplexSeries SolveIntegrated(const LegendreSeries& integral) const;
  LegendreSeries States(const ComplexSeries& c) const;
  // The residual of `x` in the integrated equations, and in column 0 what it misses of `start`.
  LegendreSeries Missing(const LegendreSeries& x, const LegendreSeries& integral,
                         const Eigen::Ref<const Vector>& start) const;
  // Calls visit(c) with the components that each of the starts in the columns makes, without a source.
  template <typename Visit>
  void SolveStarts(const Eigen::Ref<const Matrix>& starts, const Visit& visit) const;
  // The states that stay zero: they start there, and nothing moves them.
  std::vector<Index> UnreachedStates(const Vector& start, const LegendreSeries& source) const;

  // Solution::stiffness for rows of x of these sizes.
  Vector Stiffness(const Vector& size) const;
  // The multiple of P_K - P_{K-1} that is a layer, for each component of the triangular form; with those of rounding or
  // without them. `source`: its coefficients of P_{K-1} and P_K in each component.
  enum class OfRounding { kToo, kNot };
  Eigen::VectorXcd LayersOf(const ComplexSeries& c, const Eigen::Ref<const Eigen::MatrixXcd>& source,
                            OfRounding of_rounding) const;
  void AddSlope(const ComplexSeries& c, const LegendreSeries& source, const Vector& source_noise,
                Solution& solution) const;
  void RefineSlope(const LegendreSeries& source, const Vector& source_noise, const SlopeOfSource& slope,
                   const Vector& x_noise, Solution& solution) const;

  // What unit starts and unit sources, side by side, make of x at each look, and of x' at the end.
  struct UnitResponses {
    std::array<Matrix, kLooks> values;
    Matrix slopes;
  };

  const Mode* mode_;
  double half_;
  std::vector<Scalar> scalars_;
  std::optional<UnitResponses> units_;
  bool has_fast_ = false;  // some component is fast on the step
};

}  // namespace dlcs

#endif  // DLCS_CORE_EVENT_DRIVEN_MODE_STEP_H_
