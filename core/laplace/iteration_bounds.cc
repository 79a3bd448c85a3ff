// SPDX-License-Identifier: Apache-2.0
#include "core/laplace/iteration_bounds.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "core/linalg/norms.h"
#include "core/linalg/phi_functions.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

using Complex = std::complex<double>;

// weight (zI - tA)⁻¹ at a node, which is weight/t (z/t I - A)⁻¹.
struct KernelTerm {
  Complex z;
  Eigen::MatrixXcd matrix;
};

std::vector<KernelTerm> KernelTerms(const Contour& contour, const Resolvent& resolvent, double t) {
  std::vector<KernelTerm> terms;
  for (const ContourNode& node : Nodes(contour)) {
    terms.push_back({node.z, node.weight / t * resolvent.Inverse(node.z / t)});
  }
  return terms;
}

// ∫_0^1 ‖Q(σ) - e^{tσA}‖ dσ with σ = e^{-u}: boundary layers of the far nodes near σ = 0 are resolved.
double KernelError(const std::vector<KernelTerm>& terms, const Matrix& A, double t) {
  constexpr int kPoints = 128;
  constexpr double kDepth = 24;  // below e^{-24} nothing is left of the integral
  double sum = 0;
  for (int k = 0; k < kPoints; ++k) {
    const double sigma = std::exp(-kDepth * (k + 0.5) / kPoints);
    Matrix error = -ComputePhiFunctions(t * sigma * A).phi0;
    for (const KernelTerm& term : terms) error += (std::exp(term.z * sigma) * term.matrix).real();
    sum += kDepth / kPoints * sigma * InfinityNorm(error);
  }
  return sum;
}

}  // namespace

double ResolventFactor(const Contour& contour, const Resolvent& resolvent, const std::vector<double>& times,
                       const std::stop_token& stop) {
  double factor = 0;
  const std::vector<ContourNode> nodes = Nodes(contour);
  for (const double t : times) {
    for (const ContourNode& node : nodes) {
      if (stop.stop_requested()) return std::numeric_limits<double>::quiet_NaN();
      factor = NanMax(factor, std::abs(node.z / t) * resolvent.Norm(node.z / t));
    }
  }
  return factor;
}

double IterationRate(const Contour& contour, double resolvent_factor, double lipschitz, const Problem& problem) {
  return contour.step * resolvent_factor * lipschitz * InfinityNorm(problem.B) * InfinityNorm(problem.N) /
         (2 * std::numbers::pi);
}

IterationBound::IterationBound(const Contour& contour, double rate, double horizon)
    : contour_(contour), log_rate_(std::log(rate * horizon)), log_factors_{0} {}

double IterationBound::LogFactor(int k) {
  while (static_cast<int>(log_factors_.size()) <= k) {
    LookForStop();
    const int l = static_cast<int>(log_factors_.size());
    log_factors_.push_back(log_factors_.back() + log_rate_ + std::log(Theta(contour_, l) / l));
  }
  return log_factors_[k];
}

std::optional<double> IterationBound::IterationsFor(double tolerance) {
  const double wanted = std::log(tolerance);
  for (int k = 0; k <= kMaxExactFactors; ++k) {
    if (LogFactor(k) <= wanted) return k;
  }
  const double log_growth = log_rate_ + std::log(ThetaMax(contour_));
  if (!std::isfinite(log_growth)) return std::nullopt;
  const auto enough = [&](double k) { return k * log_growth - std::lgamma(k + 1) <= wanted; };
  // Beyond the hump at k = e^{log_growth} the factor falls, so doubling and halving find where it passes.
  double low = std::max<double>(kMaxExactFactors, std::exp(log_growth)), high = low;
  while (!enough(high)) high *= 2;
  while (high - low > 1 && high - low > 1e-12 * high) (enough((low + high) / 2) ? high : low) = (low + high) / 2;
  return std::ceil(high);
}

double IterationBound::LogAmplification() {
  // The sum of r^k/k! is e^r; here r = L̃ T Θ_max bounds where the terms have become negligible.
  double largest = 0;
  for (int k = 1; k <= kMaxExactFactors; ++k) {
    largest = std::max(largest, LogFactor(k));
    if (LogFactor(k) < largest - 40 && LogFactor(k) < LogFactor(k - 1)) {
      double sum = 0;
      for (int r = 0; r <= k; ++r) sum += std::exp(LogFactor(r) - largest);
      return largest + std::log(sum);
    }
  }
  return std::exp(log_rate_) * ThetaMax(contour_);
}

double LogReducedFactor(double rate, double window, int k) {
  if (k == 0) return 0;
  return k * std::log(rate) + std::lgamma(window + k) - std::lgamma(k + 1.0) - std::lgamma(window);
}

double RecommendedWindow(double rate, double most) {
  return rate > 0 ? std::clamp(std::floor(1 / rate), 1.0, most) : most;
}

std::optional<double> ReducedIterationsFor(double rate, double window, double tolerance) {
  if (!(rate < 1)) return std::nullopt;
  int k = 0;
  while (LogReducedFactor(rate, window, k) > std::log(tolerance)) ++k;
  return k;
}

double SourceQuadratureError(const Contour& contour, const Resolvent& resolvent, const Matrix& A,
                             const std::vector<double>& times) {
  double error = 0;
  for (const double t : times) {
    error = NanMax(error, t * KernelError(KernelTerms(contour, resolvent, t), A, t));
  }
  return error;
}

}  // namespace dlcs
