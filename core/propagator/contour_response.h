// SPDX-License-Identifier: Apache-2.0
// The response of N x to a few input signals, from values of the transfer function on two contours.

#ifndef DLCS_CORE_PROPAGATOR_CONTOUR_RESPONSE_H_
#define DLCS_CORE_PROPAGATOR_CONTOUR_RESPONSE_H_

#include <vector>

#include "core/parallel/parallel.h"
#include "core/propagator/pulse_train.h"

namespace dlcs {

// Two contours for steps of length one: one for times 1/2 to 2, with poles at zero allowed, and one for all times from
// 1/2 on.
struct StepContours {
  std::vector<ContourNode> near;
  std::vector<ContourNode> far;
  Index longest = 0;  // the number of steps that the far contour covers
  double log_loss = 0;

  Index size() const { return static_cast<Index>(near.size() + far.size()); }
  const ContourNode& node(Index p) const {
    const auto k = static_cast<std::size_t>(p);
    return k < near.size() ? near[k] : far[k - near.size()];
  }
  bool is_near(Index p) const { return p < static_cast<Index>(near.size()); }
};

// N (zI - A)⁻¹ C, times the weight of the node, at each node: n × c.
using TransferValues = std::vector<Eigen::MatrixXcd>;

struct NodesAndMiddles {
  Matrix nodes;    // n × J, at the nodes 1..J
  Matrix middles;  // n × J
};

class ContourResponse {
 public:
  ContourResponse(const StepContours& contours, const TransferValues& values, Hold hold);

  // n × c: the response at node j to s_j.
  const Matrix& now() const { return now_; }

  // The response at the next node to all signals pushed so far.
  void Next(const PulseTrain& train, Eigen::Ref<Vector> q) const;
  PulseTrain Start(const Eigen::Ref<const Vector>& first) const { return {far_nodes_, hold_, first}; }

  // The response to s_0 ... s_J, c × J + 1, from a zero state. Same bits for any number of threads. Cost: 8 n c p J.
  NodesAndMiddles Respond(const Eigen::Ref<const Matrix>& signal, Workers& workers) const;

  // The blocks 0..count - 1 of the response at nodes, n × c each, side by side. Cost: 4 n c p each.
  Matrix Blocks(Index count, Workers& workers) const;

 private:
  Index columns() const { return now_.cols(); }

  Hold hold_;
  std::vector<Complex> far_nodes_;
  // n × c each. The response at a node to s there, to s at the node before, and at node 1 to s_0; and the response at a
  // midpoint to s at the end of the step, at its start, and to s_0.
  Matrix now_, before_, start_;
  Matrix middle_now_, middle_before_, middle_start_;
  // n × 2cp: real part and negative imaginary part of each value, so that a product with FarAsReal() is Re Σ.
  Matrix far_, far_middle_;
};

// Re Σ_p value_p e^{z_p t} at the nodes and middles 1..J: values n × 1, of the far nodes alone, times as in contours.
NodesAndMiddles Decay(const StepContours& contours, const TransferValues& values, Index steps, Workers& workers);

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_CONTOUR_RESPONSE_H_
