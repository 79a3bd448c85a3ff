// SPDX-License-Identifier: Apache-2.0

#include "core/laplace/contour.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dlcs {
namespace {

using Complex = std::complex<double>;

// l ∫_0^1 (1-τ)^{l-1} e^{aτ} dτ.
double PowerExponentialIntegral(int l, double a) {
  if (a < -l) {
    // J_1 = (e^a - 1)/a, J_{k+1} = (k J_k - 1)/a: stable upwards while k < |a|.
    double J = std::expm1(a) / a;
    for (int k = 1; k < l; ++k) J = (k * J - 1) / a;
    return l * J;
  }
  if (a >= 0) {
    // The integral is Kummer's function M(1, l+1, a) = Σ a^k/((l+1)⋯(l+k)).
    double sum = 1, term = 1;
    for (int k = 1; sum + term > sum; ++k) sum += term *= a / (l + k);
    return sum;
  }
  // Downwards J_k = (1 + a J_{k+1})/k: stable while k > |a|. Above l the start is forgotten by a product of |a|/k.
  const int first = 2 * static_cast<int>(std::max<double>(l, -a)) + 60;
  double J = 1 / (first - a);
  for (int k = first - 1; k >= l; --k) J = (1 + a * J) / k;
  return l * J;
}

}  // namespace

Contour SourceContour(Index nodes) {
  const double root = std::sqrt(static_cast<double>(nodes));
  // Table: of the source, as SourceContour() states it.
  constexpr double kGamma = 0.794, kStep = 2.06;
  return {.nodes = nodes, .mu = root / 4, .gamma = kGamma, .step = kStep / root};
}

Contour InitialStateContour(Index nodes) {
  const double count = static_cast<double>(nodes);
  // Table: of the source, as InitialStateContour() states it.
  constexpr double kMu = 4.4921, kGamma = 1.1721, kStep = 1.0818;
  return {.nodes = nodes, .mu = kMu * count, .gamma = kGamma, .step = kStep / count};
}

std::vector<ContourNode> Nodes(const Contour& contour) {
  std::vector<ContourNode> nodes;
  for (Index p = 0; p <= contour.nodes; ++p) {
    const Complex angle(-contour.gamma, static_cast<double>(p) * contour.step);
    const Complex derivative = Complex(0, contour.mu) * std::cos(angle);
    ContourNode node;
    node.z = contour.mu * (1.0 + std::sin(angle));
    node.weight = (p == 0 ? 1.0 : 2.0) * contour.step / Complex(0, 2 * std::numbers::pi) * derivative;
    node.log_derivative = std::abs(derivative / node.z);
    nodes.push_back(node);
  }
  return nodes;
}

double Theta(const Contour& contour, int l) {
  double sum = 0;
  const std::vector<ContourNode> nodes = Nodes(contour);
  for (Index p = 0; p <= contour.nodes; ++p) {
    const double exponent =
        contour.mu * (1 - std::sin(contour.gamma) * std::cosh(static_cast<double>(p) * contour.step));
    sum += (p == 0 ? 1 : 2) * nodes[p].log_derivative * PowerExponentialIntegral(l, exponent);
  }
  return sum;
}

double ThetaMax(const Contour& contour) {
  const double sine = std::sin(contour.gamma);
  return static_cast<double>(2 * contour.nodes + 1) * std::exp(contour.mu * (1 - sine)) *
         std::sqrt((1 + sine) / (1 - sine));
}

}  // namespace dlcs
