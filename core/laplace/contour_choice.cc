// SPDX-License-Identifier: Apache-2.0
#include "core/laplace/contour_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace dlcs {
namespace {

constexpr double kRightAngle = std::numbers::pi / 2;

// Beyond this the largest terms of the sum, e^{μ(1 - sin γ)}, are no longer of size one, as the three parts suppose.
constexpr double kLargestMu = 4;

// The best μ for γ and h: the first part of the error does not depend on it, the second grows, the third falls.
void BalanceMu(Contour& contour) {
  const double shift = 2 * std::numbers::pi * contour.gamma / contour.step;
  const double cut = contour.step * static_cast<double>(contour.nodes);
  double low = 1e-3, high = kLargestMu;
  for (int k = 0; k < 50; ++k) {
    const double mu = (low + high) / 2;
    (mu - shift < std::log(2 / (mu * std::sin(contour.gamma))) - cut ? low : high) = mu;
  }
  contour.mu = low;
}

}  // namespace

double LogSourceError(const Contour& contour, double sector_angle) {
  const double around = 2 * std::numbers::pi / contour.step;
  return std::max(
      {-around * (kRightAngle - sector_angle - contour.gamma), contour.mu - around * contour.gamma,
       std::log(2 / (contour.mu * std::sin(contour.gamma))) - contour.step * static_cast<double>(contour.nodes)});
}

Contour BestSourceContour(Index nodes, double sector_angle) {
  constexpr int kTrials = 200;
  const double room = kRightAngle - sector_angle;
  const double asymptotic_step = std::sqrt(std::numbers::pi * room / static_cast<double>(nodes));
  Contour best;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 1; i < kTrials; ++i) {
    for (int j = 1; j <= kTrials; ++j) {
      Contour contour{.nodes = nodes, .gamma = room * i / kTrials, .step = asymptotic_step * 2 * j / kTrials};
      BalanceMu(contour);
      const double error = LogSourceError(contour, sector_angle);
      if (error < least) {
        least = error;
        best = contour;
      }
    }
  }
  return best;
}

namespace {

bool TakesRemark24(const Options& options, double sector_angle) {
  if (options.contour == ContourChoice::kRemark24) return sector_angle < kRightAngle;
  if (options.contour == ContourChoice::kTheorem22) return false;
  return sector_angle >= kRightAngle - SourceContour(options.num_contour_nodes).gamma && sector_angle <= kWidestSector;
}

}  // namespace

const char* ContourSource(const Options& options, double sector_angle) {
  if (options.contour_gamma > 0 || options.contour_mu > 0 || options.contour_step > 0) return "given";
  return TakesRemark24(options, sector_angle) ? "Remark 2.4" : "Theorem 2.2";
}

Contour ContourFor(const Options& options, double sector_angle) {
  Contour contour = TakesRemark24(options, sector_angle) ? BestSourceContour(options.num_contour_nodes, sector_angle)
                                                         : SourceContour(options.num_contour_nodes);
  if (options.contour_gamma > 0) contour.gamma = options.contour_gamma;
  if (options.contour_mu > 0) contour.mu = options.contour_mu;
  if (options.contour_step > 0) contour.step = options.contour_step;
  return contour;
}

double WidestSector(const Options& options) {
  if (options.contour_gamma > 0) return kRightAngle - options.contour_gamma;
  if (options.contour == ContourChoice::kTheorem22) return kRightAngle - SourceContour(options.num_contour_nodes).gamma;
  return kWidestSector;
}

}  // namespace dlcs
