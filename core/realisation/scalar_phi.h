// SPDX-License-Identifier: Apache-2.0
// The functions φ_0, φ_1, φ_2 of a number.

#ifndef DLCS_CORE_REALISATION_SCALAR_PHI_H_
#define DLCS_CORE_REALISATION_SCALAR_PHI_H_

#include <cmath>

namespace dlcs {

struct ScalarPhi {
  double phi0, phi1, phi2;

  // To some 1e-15 relative for every z that does not overflow.
  static ScalarPhi At(double z) {
    ScalarPhi phi{std::exp(z), 1, 0.5};
    if (std::abs(z) < 0.5) {  // φ_2 = Σ z^k / (k + 2)!, without the cancellation of its definition
      phi.phi2 = 0;
      for (int k = 15; k >= 0; --k) phi.phi2 = (phi.phi2 * z + 1) / (k + 2);
      phi.phi1 = 1 + z * phi.phi2;
    } else {
      phi.phi1 = std::expm1(z) / z;
      phi.phi2 = (phi.phi1 - 1) / z;
    }
    return phi;
  }
};

}  // namespace dlcs

#endif  // DLCS_CORE_REALISATION_SCALAR_PHI_H_
