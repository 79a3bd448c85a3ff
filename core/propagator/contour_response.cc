// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/contour_response.h"

#include <algorithm>
#include <cmath>

namespace dlcs {
namespace {

constexpr Index kColumnsPerTask = 64;  // of a product that one task forms
constexpr Index kChunk = 512;          // columns of far parts kept at a time

// Adds Re(factor · value).
void AddReal(const Eigen::MatrixXcd& value, Complex factor, Matrix& sum) {
  sum += factor.real() * value.real() - factor.imag() * value.imag();
}

// Columns 2k, 2k + 1 of `real` become Re and -Im of column k of `value`.
void Interleave(const Eigen::MatrixXcd& value, Eigen::Ref<Matrix> real) {
  for (Index k = 0; k < value.cols(); ++k) {
    real.col(2 * k) = value.col(k).real();
    real.col(2 * k + 1) = -value.col(k).imag();
  }
}

}  // namespace

ContourResponse::ContourResponse(const StepContours& contours, const TransferValues& values, Hold hold) : hold_(hold) {
  const Index n = values.front().rows(), c = values.front().cols();
  for (Matrix* sum : {&now_, &before_, &start_, &middle_now_, &middle_before_, &middle_start_}) sum->setZero(n, c);
  const auto near = static_cast<Index>(contours.near.size());
  for (Index p = 0; p < near; ++p) {
    const Complex z = contours.node(p).z;
    const Eigen::MatrixXcd& value = values[static_cast<std::size_t>(p)];
    AddReal(value, NearPulse(hold, z, 0), now_);
    AddReal(value, NearPulse(hold, z, -0.5), middle_now_);
    if (IsFarAtNextNode(hold)) continue;
    AddReal(value, NearPulse(hold, z, 1), before_);
    AddReal(value, NearPulse(hold, z, 0.5), middle_before_);
    AddReal(value, NearStart(z, 1), start_);
    AddReal(value, NearStart(z, 0.5), middle_start_);
  }
  const auto far = static_cast<Index>(contours.far.size());
  far_.resize(n, 2 * c * far);
  far_middle_.resize(n, 2 * c * far);
  for (Index p = 0; p < far; ++p) {
    const Complex z = contours.far[static_cast<std::size_t>(p)].z;
    const Eigen::MatrixXcd& value = values[static_cast<std::size_t>(near + p)];
    far_nodes_.push_back(z);
    Interleave(value, far_.middleCols(2 * c * p, 2 * c));
    Interleave(std::exp(-z / 2.0) * value, far_middle_.middleCols(2 * c * p, 2 * c));
  }
}

void ContourResponse::Next(const PulseTrain& train, Eigen::Ref<Vector> q) const {
  q.noalias() = far_ * train.FarAsReal();
  if (!IsFarAtNextNode(hold_)) q.noalias() += (train.at_start() ? start_ : before_) * train.last();
}

NodesAndMiddles ContourResponse::Respond(const Eigen::Ref<const Matrix>& signal, Workers& workers) const {
  const Index steps = signal.cols() - 1;
  NodesAndMiddles response{Matrix(now_.rows(), steps), Matrix(now_.rows(), steps)};
  PulseTrain train = Start(signal.col(0));
  Matrix far(far_.cols(), std::min(steps, kChunk));
  for (Index done = 0; done < steps; done += kChunk) {
    const Index count = std::min(kChunk, steps - done);
    for (Index k = 0; k < count; ++k) {
      far.col(k) = train.FarAsReal();
      train.Push(signal.col(done + k + 1));
    }
    workers.ForBlocks(count, kColumnsPerTask, [&](Index, Index begin, Index end) {
      const Index width = end - begin;
      const auto now = signal.middleCols(done + begin + 1, width), before = signal.middleCols(done + begin, width);
      auto nodes = response.nodes.middleCols(done + begin, width);
      auto middles = response.middles.middleCols(done + begin, width);
      nodes.noalias() = far_ * far.middleCols(begin, width);
      nodes.noalias() += now_ * now;
      middles.noalias() = far_middle_ * far.middleCols(begin, width);
      middles.noalias() += middle_now_ * now;
      if (IsFarAtNextNode(hold_)) return;
      nodes.noalias() += before_ * before;
      middles.noalias() += middle_before_ * before;
    });
  }
  if (!IsFarAtNextNode(hold_) && steps > 0) {  // of s_0 there is only half a hat
    response.nodes.col(0) += (start_ - before_) * signal.col(0);
    response.middles.col(0) += (middle_start_ - middle_before_) * signal.col(0);
  }
  return response;
}

Matrix ContourResponse::Blocks(Index count, Workers& workers) const {
  const Index n = now_.rows(), c = columns(), far_nodes = static_cast<Index>(far_nodes_.size());
  const Index near = IsFarAtNextNode(hold_) ? 1 : 2;
  Matrix blocks(n, c * count);
  blocks.leftCols(c) = now_;
  if (near == 2 && count > 1) blocks.middleCols(c, c) = before_;
  if (count <= near) return blocks;
  // Columns of `values`: the entries of a block, for each node real part and negative imaginary part.
  Matrix values(n * c, 2 * far_nodes);
  for (Index p = 0; p < far_nodes; ++p) {
    for (Index k = 0; k < c; ++k) {
      values.col(2 * p).segment(n * k, n) = far_.col(2 * (c * p + k));
      values.col(2 * p + 1).segment(n * k, n) = far_.col(2 * (c * p + k) + 1);
    }
  }
  auto far = blocks.rightCols(c * (count - near)).reshaped(n * c, count - near);
  workers.ForBlocks(count - near, kColumnsPerTask, [&](Index, Index begin, Index end) {
    Matrix pulses(2 * far_nodes, end - begin);
    for (Index k = begin; k < end; ++k) {
      for (Index p = 0; p < far_nodes; ++p) {
        const Complex z = far_nodes_[static_cast<std::size_t>(p)];
        const Complex pulse = std::exp(static_cast<double>(k + near) * z) * FarPulse(hold_, z);
        pulses(2 * p, k - begin) = pulse.real();
        pulses(2 * p + 1, k - begin) = pulse.imag();
      }
    }
    far.middleCols(begin, end - begin).noalias() = values * pulses;
  });
  return blocks;
}

NodesAndMiddles Decay(const StepContours& contours, const TransferValues& values, Index steps, Workers& workers) {
  const Index n = values.front().rows(), far_nodes = static_cast<Index>(contours.far.size());
  Matrix real(n, 2 * far_nodes);
  for (Index p = 0; p < far_nodes; ++p) {
    Interleave(values[contours.near.size() + static_cast<std::size_t>(p)], real.middleCols(2 * p, 2));
  }
  NodesAndMiddles decay{Matrix(n, steps), Matrix(n, steps)};
  workers.ForBlocks(steps, kColumnsPerTask, [&](Index, Index begin, Index end) {
    Eigen::MatrixXcd at_nodes(far_nodes, end - begin), at_middles(far_nodes, end - begin);
    for (Index j = begin; j < end; ++j) {
      for (Index p = 0; p < far_nodes; ++p) {
        const Complex z = contours.far[static_cast<std::size_t>(p)].z;
        at_nodes(p, j - begin) = std::exp(static_cast<double>(j + 1) * z);
        at_middles(p, j - begin) = std::exp((static_cast<double>(j) + 0.5) * z);
      }
    }
    const auto as_real = [&](const Eigen::MatrixXcd& m) {
      return Eigen::Map<const Matrix>(reinterpret_cast<const double*>(m.data()), 2 * far_nodes, end - begin);
    };
    decay.nodes.middleCols(begin, end - begin).noalias() = real * as_real(at_nodes);
    decay.middles.middleCols(begin, end - begin).noalias() = real * as_real(at_middles);
  });
  return decay;
}

}  // namespace dlcs
