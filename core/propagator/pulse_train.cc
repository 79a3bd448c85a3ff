// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/pulse_train.h"

#include <cmath>

namespace dlcs {

Complex NearPulse(Hold hold, Complex z, double t) {
  if (hold == Hold::kConstant) return std::exp((t + 1) * z) / z;
  const Complex ramps = t > 0 ? std::exp((t + 1) * z) - 2.0 * std::exp(t * z) : std::exp((t + 1) * z);
  return ramps / (z * z);
}

Complex NearStart(Complex z, double t) { return std::exp(t * z) * (z - 1.0) / (z * z); }

Complex FarPulse(Hold hold, Complex z) {
  const Complex difference = 2.0 * std::sinh(z / 2.0) / z;  // Re z > -100: no overflow
  return hold == Hold::kConstant ? std::exp(z / 2.0) * difference : difference * difference;
}

Complex FarStart(Complex z) {
  if (std::abs(z) > 0.5) return (1.0 + (z - 1.0) * std::exp(z)) / (z * z);
  // Σ z^k (k + 1)/(k + 2)!
  Complex sum = 0, power = 0.5;
  for (int k = 0; k < 16; ++k) {
    sum += power * static_cast<double>(k + 1);
    power *= z / static_cast<double>(k + 3);
  }
  return sum;
}

PulseTrain::PulseTrain(const std::vector<Complex>& nodes, Hold hold, const Eigen::Ref<const Vector>& first)
    : hold_(hold),
      shift_(nodes.size()),
      pulse_(nodes.size()),
      start_pulse_(nodes.size()),
      far_(Eigen::MatrixXcd::Zero(first.size(), static_cast<Index>(nodes.size()))),
      last_(first) {
  for (std::size_t p = 0; p < nodes.size(); ++p) {
    const auto i = static_cast<Index>(p);
    shift_[i] = std::exp(nodes[p]);
    pulse_[i] = std::exp((IsFarAtNextNode(hold) ? 1.0 : 2.0) * nodes[p]) * FarPulse(hold, nodes[p]);
    start_pulse_[i] = std::exp(nodes[p]) * FarStart(nodes[p]);
  }
}

void PulseTrain::Push(const Eigen::Ref<const Vector>& s) {
  const bool far_already = IsFarAtNextNode(hold_);
  const Eigen::ArrayXcd& pulse = !far_already && pushed_ == 0 ? start_pulse_ : pulse_;
  const Vector height = far_already ? Vector(s) : last_;
  for (Index p = 0; p < far_.cols(); ++p) far_.col(p) = shift_[p] * far_.col(p) + pulse[p] * height;
  last_ = s;
  ++pushed_;
}

void PulseTrain::Advance() { Push(Vector::Zero(last_.size())); }

}  // namespace dlcs
