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

// With p nodes of the far contour one time step costs 2 n² p multiplications, however many steps came before. The
// response to a whole window costs one convolution with blocks if those fit into memory (n² W numbers), otherwise W
// such steps.
class ContourKernel final : public ReducedKernel {
 public:
  // `longest` is the largest number of steps of a run or window.
  ContourKernel(double step, Index longest, ContourResponse response);

  double step() const override { return step_; }
  const Matrix& K0() const override { return response_.now(); }
  std::unique_ptr<ConvolutionHistory> Start(const Eigen::Ref<const Vector>& y0) const override;
  Matrix Respond(const Matrix& y, Workers& workers) const override;
  Matrix RespondAtMiddles(const Matrix& y, Workers& workers) const override;
  double Bound(Index window) const override;

 private:
  // Computes blocks for windows up to at least `window` when they are first needed. False if they do not fit.
  bool ReserveBlocks(Index window, Workers& workers) const;

  double step_;
  Index longest_;
  ContourResponse response_;
  mutable std::mutex mutex_;                                // guards the following members
  mutable Matrix blocks_;                                   // side by side
  mutable std::optional<ToeplitzConvolution> convolution_;  // with blocks_
  mutable std::vector<double> bounds_;                      // running maxima of ‖K_k‖_∞ / h
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_CONTOUR_KERNEL_H_
