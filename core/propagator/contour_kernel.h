// SPDX-License-Identifier: Apache-2.0
// The kernel of steps of one length, from values of the transfer function on contours.

#ifndef DLCS_CORE_PROPAGATOR_CONTOUR_KERNEL_H_
#define DLCS_CORE_PROPAGATOR_CONTOUR_KERNEL_H_

#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "core/laplace/toeplitz_convolution.h"
#include "core/propagator/contour_response.h"
#include "core/propagator/propagator.h"

namespace dlcs {

// With p far nodes a step of a march costs 2 n² p multiplications, however many went before; a response to a whole
// window one convolution with blocks where those fit (n² W numbers), else as many steps.
class ContourKernel final : public ReducedKernel {
 public:
  // `longest` steps are the longest march and window.
  ContourKernel(double step, Index longest, ContourResponse response);

  double step() const override { return step_; }
  const Matrix& K0() const override { return response_.now(); }
  std::unique_ptr<ConvolutionHistory> Start(const Eigen::Ref<const Vector>& y0) const override;
  Matrix Respond(const Matrix& y, Workers& workers) const override;
  Matrix RespondAtMiddles(const Matrix& y, Workers& workers) const override;
  double Bound(Index window) const override;

 private:
  // Makes blocks for windows up to at least `window`, when they are first needed. False where they do not fit.
  bool ReserveBlocks(Index window, Workers& workers) const;

  double step_;
  Index longest_;
  ContourResponse response_;
  mutable std::mutex mutex_;  // of what follows
  mutable Matrix blocks_;     // side by side
  mutable std::optional<ToeplitzConvolution> convolution_;  // with blocks_
  mutable std::vector<double> bounds_;  // running maxima of ‖K_k‖_∞ / h
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_CONTOUR_KERNEL_H_
