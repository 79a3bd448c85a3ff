// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/step_length.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include "core/discretization/legendre.h"
#include "core/linalg/bounded_sum.h"

namespace dlcs {
namespace {

// By how much the next step may be longer, or should be shorter.
double FactorFor(double error_ratio) { return 0.9 * std::pow(error_ratio, -1.0 / (kLegendreDegree - 1)); }

}  // namespace

double StepLength::Next(const Mode& mode, double left) const {
  // A step multiplies a part of x that grows by the Padé approximation of its exponential, which is exact to rounding
  // up to about exp(6). The polynomial inside the step does not show that it grows more: its start is small against its
  // end.
  constexpr double kMaxGrowth = 6;
  double growth = 0;
  for (const std::complex<double>& eigenvalue : mode.eigenvalues) growth = std::max(growth, eigenvalue.real());
  const double length = growth * length_ > kMaxGrowth ? kMaxGrowth / growth : length_;
  if (length >= left) return left;
  return std::min(length, left / 2);
}

void StepLength::BeginWith(const Mode& mode) {
  double fastest = 0;
  for (const std::complex<double>& eigenvalue : mode.eigenvalues) fastest = std::max(fastest, std::abs(eigenvalue));
  length_ = fastest * horizon_ > 4 ? 4 / fastest : horizon_;
}

void StepLength::Accept(double length, double error_ratio) {
  // Rounding does not fall with the length. Where nothing else is seen, longer steps are tried now and then.
  constexpr int kManyOfOneLength = 8;
  const double factor = FactorFor(error_ratio);
  of_one_length_ = factor > 1 ? 0 : of_one_length_ + 1;
  const bool tries_longer = of_one_length_ % kManyOfOneLength == kManyOfOneLength - 1;
  length_ = std::max(length_, length * (tries_longer ? 4.0 : std::clamp(factor, 0.5, 16.0)));
  rejected_in_a_row_ = 0;
}

double StepLength::AfterError(const SmoothStep& step, double length, double shortest) {
  constexpr double kNoLess = 0.7;
  const double factor = FactorFor(step.error_ratio);
  const double shorter = length * (std::isfinite(factor) ? std::clamp(factor, 0.1, kNoLess) : 0.1);
  const bool falls = rejected_in_a_row_ == 0 || step.error_ratio < kNoLess * rejected_ratio_;
  const double layer_length = falls ? step.layer_length : step.small_layer_length;
  rejected_ratio_ = step.error_ratio;
  return std::min(shorter, std::max(layer_length, shortest));
}

int StepLength::Shorten(double length) {
  length_ = length;
  return ++rejected_in_a_row_;
}

void StepLength::EndMode(double lasted) {
  // Rounding grows with the length, and where modes accumulate little else is left.
  constexpr double kLongestAfterEvent = 16;
  length_ = std::min(length_, kLongestAfterEvent * std::max(lasted, last_mode_));
  last_mode_ = lasted;
  rejected_in_a_row_ = 0;
}

void StepLength::RaiseTo(double length) { length_ = std::max(length_, length); }

// A part of the horizon, or of the time in which the fastest part of the mode acts; t is known to its rounding only.
double StepLength::Shortest(double t, const Mode* mode, double part) const {
  constexpr double kPartOfRate = 0.01;  // StepLengthTest feels it
  const double acts = mode && mode->rate > 0 ? kPartOfRate / mode->rate : horizon_;
  return std::max(RoundingOf(16) * t, part * std::min(kShortestStep * horizon_, acts));
}

double StepLength::ShortestStep(double t, const Mode* mode) const { return Shortest(t, mode, 1); }

// Time is known so well near 0 that a mode may be a part of it that is shorter than those parts.
double StepLength::ShortestMode(double t, const Mode* mode) const {
  const double shortest = Shortest(t, mode, 1.0 / 128);
  return std::max(std::clamp(kNear * t, kNear * shortest, shortest), RoundingOf(4) * t);
}

double ShareOfTolerance(double length, double horizon) {
  constexpr double kMinShare = 0.02;
  return std::max(length / horizon, kMinShare);
}

}  // namespace dlcs
