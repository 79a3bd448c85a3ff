// SPDX-License-Identifier: Apache-2.0

#include "core/laplace/contour.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <complex>

#include "core/laplace/resolvent.h"
#include "core/linalg/phi_functions.h"

namespace dlcs {
namespace {

using Complex = std::complex<double>;

// e^{-t} from its transform 1/(z + 1).
double InvertExponential(const Contour& contour, double t) {
  Complex sum = 0;
  for (const ContourNode& node : Nodes(contour)) sum += node.weight / t * std::exp(node.z) / (node.z / t + 1.0);
  return sum.real();
}

TEST(ContourTest, InitialStateContourConvergesAtTheRateOfRemark23) {
  for (const double t : {0.1, 1.0, 10.0}) {
    for (const Index nodes : {4, 7, 10}) {
      const double error = std::abs(InvertExponential(InitialStateContour(nodes), t) - std::exp(-t));
      EXPECT_LT(error, 10 * std::exp(-2.32 * static_cast<double>(nodes))) << nodes << " " << t;
      EXPECT_GT(error, 0) << "suspiciously exact";
    }
    EXPECT_NEAR(InvertExponential(InitialStateContour(13), t), std::exp(-t), 1e-12);
  }
}

TEST(ContourTest, SourceContourConvergesLikeTheRootOfItsNodes) {
  // The source term of x' = -x + 1: ∫ e^{z(t-τ)} dτ = (e^{zt} - 1)/z.
  const auto error = [](Index nodes) {
    const double t = 1;
    Complex sum = 0;
    for (const ContourNode& node : Nodes(SourceContour(nodes))) {
      sum += node.weight * (std::exp(node.z) - 1.0) / node.z / (node.z + 1.0);
    }
    return std::abs(sum.real() - (1 - std::exp(-t)));
  };
  for (const Index nodes : {9, 16, 25, 36, 49, 64}) {
    EXPECT_LT(error(nodes), 20 * std::exp(-2.06 * std::sqrt(static_cast<double>(nodes)))) << nodes;
  }
  // From P = 9 to 64 the root grows by 5: the error falls by e^{-10.3} = 3e-5, give or take its oscillation.
  EXPECT_LT(error(64), 1e-3 * error(9));
}

TEST(ContourTest, ThetaMatchesQuadrature) {
  const Contour contour = SourceContour(16);
  for (const int l : {1, 2, 5, 20}) {
    // Midpoint rule in s with τ = s⁴, which resolves the spikes e^{-|a|τ} at 0.
    double sum = 0;
    const int points = 200000;
    for (Index p = 0; p <= contour.nodes; ++p) {
      const ContourNode node = Nodes(contour)[p];
      const double a = contour.mu * (1 - std::sin(contour.gamma) * std::cosh(static_cast<double>(p) * contour.step));
      double integral = 0;
      for (int k = 0; k < points; ++k) {
        const double s = (k + 0.5) / points;
        const double tau = s * s * s * s;
        integral += std::pow(1 - tau, l - 1) * std::exp(a * tau) * 4 * s * s * s / points;
      }
      sum += (p == 0 ? 1 : 2) * node.log_derivative * l * integral;
    }
    EXPECT_NEAR(Theta(contour, l) / sum, 1, 1e-5) << l;
  }
}

TEST(ResolventTest, SolvesAndMeasures) {
  Matrix A(3, 3);
  A << -1, 2, 0, -3, -1, 0.5, 0, 1, -4;
  const Resolvent resolvent(A);
  const Complex z(0.3, 2);
  const Eigen::MatrixXcd inverse = (z * Eigen::MatrixXcd::Identity(3, 3) - A.cast<Complex>()).inverse();
  Eigen::VectorXcd b = resolvent.ToSchur(Vector{{1, 2, 3}}.cast<Complex>());
  resolvent.Solve(z, b);
  const Vector expected = (inverse * Vector{{1, 2, 3}}.cast<Complex>()).real();
  EXPECT_LT((resolvent.FromSchur(b) - expected).norm(), 1e-14);
  EXPECT_NEAR(resolvent.Norm(z), inverse.cwiseAbs().rowwise().sum().maxCoeff(), 1e-14);
}

TEST(ResolventTest, MeasuresTheSectorOfTheSpectrum) {
  Matrix rotation(2, 2);
  rotation << -1, 1, -1, -1;  // eigenvalues -1 ± i
  EXPECT_NEAR(SectorAngle(Resolvent(rotation).Eigenvalues()), M_PI / 4, 1e-14);
  EXPECT_EQ(SectorAngle(Resolvent(-Matrix::Identity(2, 2)).Eigenvalues()), 0);
  EXPECT_NEAR(SectorAngle(Resolvent(Matrix::Identity(1, 1)).Eigenvalues()), M_PI, 1e-14);
  EXPECT_EQ(SectorAngle(Resolvent(Matrix::Zero(2, 2)).Eigenvalues()), 0);
}

}  // namespace
}  // namespace dlcs
