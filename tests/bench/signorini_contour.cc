// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/signorini_contour.h"

#include <cmath>
#include <complex>

#include "core/laplace/contour.h"
#include "core/linalg/simd/simd_dispatch.h"
#include "core/propagator/kronecker_kernel.h"

namespace dlcs::bench {
namespace {

constexpr Index kContourNodes = 25;

// ∫_0^{t_j} e^{z (t_j - τ)} u(τ) dτ of the piecewise linear u through the columns of `input`, by rows.
Eigen::VectorXcd InnerIntegral(const Matrix& input, Index j, double step, std::complex<double> z) {
  const std::complex<double> zh = z * step, decay = std::exp(zh);
  const std::complex<double> phi1 = (decay - 1.0) / zh, phi2 = (phi1 - 1.0) / zh;
  const std::complex<double> at_start = step * (phi1 - phi2), at_end = step * phi2;
  Eigen::VectorXcd integral = Eigen::VectorXcd::Zero(input.rows());
  for (Index l = 0; l < j; ++l) integral = decay * integral + at_start * input.col(l) + at_end * input.col(l + 1);
  return integral;
}

}  // namespace

PrintedIterate::PrintedIterate(const Problem& problem, const Matrix& input)
    : size_(problem.num_constraints()),
      step_(problem.horizon / static_cast<double>(input.cols() - 1)),
      weight_(problem.B.Sparse().coeff(0, 0)),
      transform_(*FactorTransform::Create(problem.A.kronecker_sum()->factors[0])),
      along_(transform_.Forward(Vector::Unit(size_, 0))),
      input_(transform_.Forward(input)) {
  const Eigen::Map<const Matrix> x0(problem.x0.data(), size_, size_);
  start_ = transform_.Forward(transform_.Forward(x0).transpose());
}

Matrix PrintedIterate::State(Index j) const {
  const Vector& lambda = transform_.eigenvalues();
  const double t = Time(j);
  Matrix modes = start_;
  for (Index a = 0; a < size_; ++a) modes.col(a).array() *= (t * (lambda[a] + lambda.array())).exp();
  for (const ContourNode& node : Nodes(SourceContour(kContourNodes))) {
    const std::complex<double> z = node.z / t, weight = weight_ * node.weight / t;
    const Eigen::VectorXcd integral = weight * InnerIntegral(input_, j, step_, z);
    // Re of (zI - A)⁻¹ B times the integral: (p + iq)/(r + is), r = Re z - λ_a - λ_b, s = Im z.
    const Vector real = integral.real(), imaginary = integral.imag();
    RunWide([size = size_, modes_all = modes.data(), p = real.data(), q = imaginary.data(), lambda_b = lambda.data(),
             along = along_.data(), z_real = z.real(), s = z.imag()]() DLCS_WIDE {
      for (Index a = 0; a < size; ++a) {
        double* __restrict x = modes_all + a * size;
        const double from = z_real - lambda_b[a], factor = along[a];
        for (Index b = 0; b < size; ++b) {
          const double r = from - lambda_b[b];
          x[b] += factor * (p[b] * r + q[b] * s) / (r * r + s * s);
        }
      }
    });
  }
  return OnGrid(modes);
}

Matrix PrintedIterate::ExactState(Index j) const {
  const Vector& lambda = transform_.eigenvalues();
  Matrix modes = start_;
  for (Index a = 0; a < size_; ++a) {
    for (Index b = 0; b < size_; ++b) {
      const ScalarPhi phi = ScalarPhi::At(step_ * (lambda[a] + lambda[b]));
      const double factor = step_ * weight_ * along_[a];
      double& x = modes(b, a);
      for (Index l = 0; l < j; ++l) {
        x = phi.phi0 * x + factor * ((phi.phi1 - phi.phi2) * input_(b, l) + phi.phi2 * input_(b, l + 1));
      }
    }
  }
  return OnGrid(modes);
}

Matrix PrintedIterate::OnGrid(const Matrix& modes) const {
  return transform_.Backward(transform_.Backward(modes).transpose());
}

}  // namespace dlcs::bench
