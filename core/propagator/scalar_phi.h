// SPDX-License-Identifier: Apache-2.0
// The functions φ_0, φ_1, φ_2 of a number.

#ifndef DLCS_CORE_PROPAGATOR_SCALAR_PHI_H_
#define DLCS_CORE_PROPAGATOR_SCALAR_PHI_H_

#include <array>
#include <cmath>

namespace dlcs {

struct ScalarPhi {
  // 1/2!, 1/3!, ... 1/17!
  static constexpr std::array<double, 16> kInverseFactorials = [] {
    std::array<double, 16> inverse{};
    double factorial = 1;
    for (int k = 0; k < 16; ++k) inverse[k] = 1 / (factorial *= k + 2);
    return inverse;
  }();

  double phi0, phi1, phi2;

  // To some 1e-15 relative for every z that does not overflow.
  static ScalarPhi At(double z) {
    ScalarPhi phi{std::exp(z), 1, 0.5};
    if (std::abs(z) < 0.5) {  // φ_2 = Σ z^k / (k + 2)!, without the cancellation of its definition
      double even = 0, odd = 0;  // two sums that do not wait for each other
      for (int k = 14; k >= 0; k -= 2) {
        even = even * (z * z) + kInverseFactorials[k];
        odd = odd * (z * z) + kInverseFactorials[k + 1];
      }
      phi.phi2 = even + z * odd;
      phi.phi1 = 1 + z * phi.phi2;
    } else {
      phi.phi1 = (phi.phi0 - 1) / z;
      phi.phi2 = (phi.phi1 - 1) / z;
    }
    return phi;
  }
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_SCALAR_PHI_H_
