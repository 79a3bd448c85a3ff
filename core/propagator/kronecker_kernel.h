// SPDX-License-Identifier: Apache-2.0
// The kernel of a Kronecker sum: a short sum of exponentials for each mode across the axis.

#ifndef DLCS_CORE_PROPAGATOR_KRONECKER_KERNEL_H_
#define DLCS_CORE_PROPAGATOR_KRONECKER_KERNEL_H_

#include <array>
#include <cmath>
#include <memory>
#include <mutex>
#include <vector>

#include "core/propagator/kronecker_modes.h"
#include "core/propagator/mode_tile.h"
#include "core/propagator/propagator.h"

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
    if (std::abs(z) < 0.5) {     // φ_2 = Σ z^k / (k + 2)!, without the cancellation of its definition
      double even = 0, odd = 0;  // two independent sums
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

// Exponentials z' = s z + û, s = (rate_k + λ_r), over steps of length h. With P_j = Σ_{l<j} e^{(j-1-l)hs} û_l the value
// at node j is α û_j + β P_j: all of the past in one number and one multiplication a step. For hats α = h φ_2 and β = h
// φ_1², for constant pieces α = h φ_1 and β = h φ_0 φ_1.
//
// Arrays hold mode r (row) and exponential k (column).
struct ExponentialSteps {
  Matrix decay;  // e^{hs}
  Matrix alpha, beta;
  // P_0 / û_0, which makes the half hat of û_0: -α/β; 0 for constant pieces, where û_0 is not used
  Matrix start;

  ExponentialSteps(const Vector& rates, const Vector& lambda, double h, Hold hold);
};

class KroneckerKernel final : public ReducedKernel {
 public:
  KroneckerKernel(std::shared_ptr<const KroneckerModes> modes, double step, Hold hold);

  double step() const override { return step_; }
  const Matrix& K0() const override { return K0_; }
  std::unique_ptr<ConvolutionHistory> Start(const Eigen::Ref<const Vector>& y0) const override;
  Matrix Respond(const Matrix& y, Workers& workers) const override;
  void AddResponse(const Eigen::Ref<const Matrix>& base, const Eigen::Ref<const Matrix>& y, Workers& workers,
                   ResponseScratch& scratch, Eigen::Ref<Matrix> q, const OnColumns& computed) const override;
  Matrix RespondAtMiddles(const Matrix& y, Workers& workers) const override;
  Motion MoveThroughout(FreeMotion free, const Eigen::Ref<const Matrix>& y, Workers& workers) const override;
  double Bound(Index window) const override;

  // ẑ at the nodes 1..W and at the midpoints of the steps, from a zero state, p × W each, for any input û of the modes
  // across the axis, p × W + 1, with û_0 at the start. Replaces the contents of `nodes` and `middles`, or is added to
  // them. If `middles` is empty, midpoints are not computed. Cost: 6 p W operations for each term.
  enum class Result { kReplaces, kAdds };
  void RespondInModes(const Eigen::Ref<const Matrix>& inputs, Result result, Eigen::Ref<Matrix> nodes,
                      Eigen::Ref<Matrix> middles, Workers& workers) const;

  const KroneckerModes& modes() const { return *modes_; }
  const ModeRecursion& terms() const { return terms_; }

 private:
  std::shared_ptr<const KroneckerModes> modes_;
  double step_;
  Hold hold_;
  ModeRecursion terms_;
  std::vector<ModeTile::Terms> tiles_;
  Matrix K0_;
  mutable std::mutex bounds_mutex_;
  mutable std::vector<double> bounds_;  // running maxima of ‖K_k‖_∞, as far as they were needed
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_KRONECKER_KERNEL_H_
