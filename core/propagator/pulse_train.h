// SPDX-License-Identifier: Apache-2.0
// The excitation of the nodes of a contour by a train of hats or boxes.

#ifndef DLCS_CORE_PROPAGATOR_PULSE_TRAIN_H_
#define DLCS_CORE_PROPAGATOR_PULSE_TRAIN_H_

#include <complex>
#include <vector>

#include "core/laplace/contour.h"
#include "core/propagator/propagator.h"
#include "core/types.h"

namespace dlcs {

// A signal s is made of pulses: hats of width two, s linear between nodes (of the value s_0 at the start only the
// falling half), or boxes on (t_{l-1}, t_l]. With steps of length one, the response of a system with the transfer
// function H to the pulse of node l is
//
//     1/(2πi) ∫ P_t(z) H(z) dz,     t = j - l steps later,
//
// where e^{-tz} P_t does not depend on t once the pulse is over ("far": no pole at zero either), and P_t has a pole of
// order one or two at zero while it is felt ("near"). The contour must serve the times given.
using Complex = std::complex<double>;

// P_t during the pulse and one step after it. Linear: -1 < t <= 1, for the times t + 1 and t > 0; constant: -1 < t <=
// 0, for the times t + 1.
Complex NearPulse(Hold hold, Complex z, double t);
// The same for the falling half hat at the start, 0 < t <= 1, for the times t.
Complex NearStart(Complex z, double t);
// Whether the pulse of node l is far at node l + 1; if not, it is at node l + 2.
inline bool IsFarAtNextNode(Hold hold) { return hold == Hold::kConstant; }
// e^{-tz} P_t after the pulse. Linear: (2 sinh(z/2)/z)², for the times t - 1 to t + 1; constant: (e^z - 1)/z, for the
// times t and t + 1.
Complex FarPulse(Hold hold, Complex z);
// e^{-(t-1)z} P_t for the falling half hat at the start, for the times t - 1 and t: (1 + (z - 1) e^z)/z².
Complex FarStart(Complex z);

// F_p = Σ P(z_p) s over all pulses that are far at the next node, by one complex multiplication per node and component.
class PulseTrain {
 public:
  // `first` is s_0; it is not used for boxes. Column 0 of the train is the response at node 1.
  PulseTrain(const std::vector<Complex>& nodes, Hold hold, const Eigen::Ref<const Vector>& first);

  // components × nodes: at node j + 1 once s_1 ... s_j were pushed.
  const Eigen::MatrixXcd& far() const { return far_; }
  // As real numbers: real and imaginary part of each.
  Eigen::Map<const Vector> FarAsReal() const { return {reinterpret_cast<const double*>(far_.data()), 2 * far_.size()}; }
  // s_j, or s_0 before the first Push().
  const Vector& last() const { return last_; }
  bool at_start() const { return pushed_ == 0; }

  void Push(const Eigen::Ref<const Vector>& s);
  // Advances to the next node with a zero signal.
  void Advance();

 private:
  Hold hold_;
  Eigen::ArrayXcd shift_;        // e^z
  Eigen::ArrayXcd pulse_;        // of the newest far pulse, at the next node
  Eigen::ArrayXcd start_pulse_;  // of the half hat at the start, at the next node
  Eigen::MatrixXcd far_;
  Vector last_;
  Index pushed_ = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_PULSE_TRAIN_H_
