// SPDX-License-Identifier: Apache-2.0
#include "core/laplace/range_contour.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace dlcs {
namespace {

constexpr double kLargestLoss = 7;  // e^7 · 1e-16 = 1e-13
constexpr double kDiedOut = 45;
constexpr double kOnAxis = 1e-4;  // far from the contour by the scale of its times

// The hyperbola for the sector α over times of ratio `ratio`, where `loss` of kLargestLoss is spent already. Zero
// nodes where there is none.
Contour BestHyperbola(double alpha, double ratio, double accuracy, double loss) {
  constexpr int kTrials = 64;
  const double room = std::numbers::pi / 2 - alpha;
  Contour best;
  for (int i = 1; i < kTrials; ++i) {
    Contour contour{.gamma = room * i / kTrials};
    const double gamma = contour.gamma, delta = room - gamma, bend = 1 - std::cos(alpha);
    // The first two conditions with equal signs, or the fourth where it is the sharper one.
    contour.mu = (kLargestLoss - loss) / (1 - std::sin(gamma));
    if (delta > gamma * bend) {
      contour.mu = std::min(contour.mu, accuracy * (gamma - delta) / (delta - gamma * bend));
    }
    if (!(contour.mu > 0)) continue;
    contour.step =
        2 * std::numbers::pi * std::min(delta / (accuracy + contour.mu * bend), gamma / (accuracy + contour.mu));
    const double last = std::acosh((1 + accuracy * ratio / contour.mu) / std::sin(gamma));
    contour.nodes = static_cast<Index>(std::ceil(last / contour.step));
    if (best.nodes == 0 || contour.nodes < best.nodes) best = contour;
  }
  return best;
}

}  // namespace

std::vector<ContourNode> RangeContour::Nodes() const {
  std::vector<ContourNode> nodes = dlcs::Nodes(hyperbola);
  for (ContourNode& node : nodes) {
    node.z = shift + node.z / end;
    node.weight /= end;
  }
  return nodes;
}

std::optional<RangeContour> FindRangeContour(double begin, double least_end, double accuracy,
                                             const Eigen::VectorXcd& eigenvalues) {
  constexpr int kAngles = 16;
  constexpr double kWidestAngle = 1.5;
  double growth = 0;
  for (const std::complex<double>& lambda : eigenvalues) growth = std::max(growth, lambda.real());

  std::optional<RangeContour> best;
  double fewest = std::numeric_limits<double>::infinity();  // nodes per octave
  for (int i = 0; i < kAngles; ++i) {
    const double alpha = kWidestAngle * i / (kAngles - 1);
    double shift = 0;
    for (const std::complex<double>& lambda : eigenvalues) {
      if (lambda.real() * begin < -kDiedOut) continue;
      const bool on_axis = std::abs(lambda.imag()) * begin < kOnAxis;
      const double turn = on_axis ? 0 : std::abs(lambda.imag()) / std::tan(alpha);
      shift = std::max(shift, lambda.real() + turn);
    }
    for (const double ratio : {16, 8, 4, 2}) {
      const double loss = (shift - growth) * begin * ratio;
      if (begin * ratio < least_end || !(loss < kLargestLoss)) continue;
      const Contour hyperbola = BestHyperbola(alpha, ratio, accuracy, loss);
      if (hyperbola.nodes == 0) continue;
      const double cost = static_cast<double>(hyperbola.nodes) / std::log2(ratio);
      if (cost >= fewest) continue;
      fewest = cost;
      best = RangeContour{.begin = begin,
                          .end = begin * ratio,
                          .shift = shift,
                          .hyperbola = hyperbola,
                          .log_loss = loss + hyperbola.mu * (1 - std::sin(hyperbola.gamma))};
    }
  }
  return best;
}

std::optional<RangeContour> FindSectorContour(double begin, double end, double accuracy, double angle, double shift) {
  const double loss = shift * end;
  if (!(loss < kLargestLoss)) return std::nullopt;
  const Contour hyperbola = BestHyperbola(angle, end / begin, accuracy, loss);
  if (hyperbola.nodes == 0) return std::nullopt;
  return RangeContour{.begin = begin,
                      .end = end,
                      .shift = shift,
                      .hyperbola = hyperbola,
                      .log_loss = loss + hyperbola.mu * (1 - std::sin(hyperbola.gamma))};
}

}  // namespace dlcs
