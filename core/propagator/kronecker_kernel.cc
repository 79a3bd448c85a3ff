// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/kronecker_kernel.h"

#include <algorithm>
#include <mutex>
#include <utility>

#include "core/linalg/norms.h"
#include "core/propagator/mode_history.h"

namespace dlcs {
namespace {

ModeRecursion MakeTerms(const KroneckerModes& modes, double h, Hold hold) {
  const SumOfExponentials& sum = modes.response;
  const Index p = modes.num_modes(), terms = sum.rates.size();
  ExponentialSteps steps(sum.rates, modes.lambda, h, hold);
  ModeRecursion made{.decay = std::move(steps.decay),
                     .start = std::move(steps.start),
                     .past = steps.beta * sum.weights.asDiagonal(),
                     .mid_past = Matrix(p, terms),
                     .now = steps.alpha * sum.weights,
                     .mid_before = Vector::Zero(p),
                     .mid_after = Vector::Zero(p)};
  for (Index k = 0; k < terms; ++k) {
    const double w = sum.weights[k];
    for (Index r = 0; r < p; ++r) {
      const ScalarPhi half = ScalarPhi::At(h / 2 * (sum.rates[k] + modes.lambda[r]));
      made.mid_past(r, k) = half.phi0 * made.past(r, k);
      // Over the first half the input runs from û_{j-1} to (û_{j-1} + û_j)/2, or it is û_j.
      const bool linear = hold == Hold::kLinear;
      const double after = linear ? h / 4 * half.phi2 : h / 2 * half.phi1;
      const double before = linear ? h / 2 * half.phi1 - after : 0;
      made.mid_before[r] += w * (half.phi0 * steps.alpha(r, k) + before);
      made.mid_after[r] += w * after;
    }
  }
  return made;
}

class KroneckerHistory final : public ConvolutionHistory {
 public:
  KroneckerHistory(const KroneckerKernel& kernel, const Eigen::Ref<const Vector>& y0)
      // A constant piece takes nothing from y_0; the half hat of a linear one is in `start`.
      : modes_(kernel.modes()), past_(kernel.terms(), ModesOf(y0), kernel.terms().start.isZero(0)) {}

  void Next(Eigen::Ref<Vector> q) override {
    output_ = past_.sum();
    modes_.FromModesInPlace(output_, workspace_);
    modes_.D.Multiply(output_, q);
  }

  Matrix History(Index steps) override {
    ModeHistory future = past_;
    Matrix history(modes_.num_modes(), steps);
    for (Index j = 0; j < steps; ++j) {
      history.col(j) = future.sum();
      future.Push(Vector::Zero(modes_.num_modes()));
    }
    return modes_.D.sparse() * modes_.FromModes(std::move(history));
  }

  void Push(const Eigen::Ref<const Vector>& y) override { past_.Push(ModesOf(y)); }

 private:
  const Vector& ModesOf(const Eigen::Ref<const Vector>& y) {
    input_.resize(modes_.num_modes());
    modes_.C.Multiply(y, input_);
    modes_.ToModesInPlace(input_, workspace_);
    return input_;
  }

  const KroneckerModes& modes_;
  FactorTransform::Workspace workspace_;
  Vector input_, output_;
  ModeHistory past_;
};

}  // namespace

ExponentialSteps::ExponentialSteps(const Vector& rates, const Vector& lambda, double h, Hold hold)
    : decay(lambda.size(), rates.size()), alpha(decay), beta(decay), start(Matrix::Zero(lambda.size(), rates.size())) {
  for (Index k = 0; k < rates.size(); ++k) {
    for (Index r = 0; r < lambda.size(); ++r) {
      const ScalarPhi phi = ScalarPhi::At(h * (rates[k] + lambda[r]));
      const bool linear = hold == Hold::kLinear;
      decay(r, k) = phi.phi0;
      alpha(r, k) = h * (linear ? phi.phi2 : phi.phi1);
      beta(r, k) = h * phi.phi1 * (linear ? phi.phi1 : phi.phi0);
      if (linear) start(r, k) = -alpha(r, k) / beta(r, k);
    }
  }
}

KroneckerKernel::KroneckerKernel(std::shared_ptr<const KroneckerModes> modes, double step, Hold hold)
    : modes_(std::move(modes)), step_(step), hold_(hold), terms_(MakeTerms(*modes_, step, hold)) {
  K0_ = modes_->Couple(terms_.now);
  const Index modes_in_all = modes_->num_modes();
  for (Index begin = 0; begin < modes_in_all; begin += ModeTile::kModes) {
    tiles_.emplace_back(terms_, begin, std::min(ModeTile::kModes, modes_in_all - begin));
  }
}

std::unique_ptr<ConvolutionHistory> KroneckerKernel::Start(const Eigen::Ref<const Vector>& y0) const {
  return std::make_unique<KroneckerHistory>(*this, y0);
}

void KroneckerKernel::RespondInModes(const Eigen::Ref<const Matrix>& inputs, Result result, Eigen::Ref<Matrix> nodes,
                                     Eigen::Ref<Matrix> middles, Workers& workers) const {
  const Index steps = inputs.cols() - 1;
  const auto sums = middles.cols() > 0 ? ModeTile::Sums::kNodesAndMiddles : ModeTile::Sums::kNodes;
  workers.ForBlocks(inputs.rows(), ModeTile::kModes, [&](Index block, Index, Index) {
    ModeTile tile(tiles_[static_cast<std::size_t>(block)], inputs.col(0), hold_ == Hold::kConstant,
                  std::min(ModeTile::kSteps, steps));
    for (Index from = 0; from < steps; from += ModeTile::kSteps) {
      const Index count = std::min(ModeTile::kSteps, steps - from);
      tile.Carry(inputs.middleCols(from + 1, count), sums);
      const bool adds = result == Result::kAdds;
      auto at_nodes = nodes.middleCols(from, count);
      adds ? tile.AddNodes(at_nodes) : tile.StoreNodes(at_nodes);
      if (middles.cols() == 0) continue;
      auto at_middles = middles.middleCols(from, count);
      adds ? tile.AddMiddles(at_middles) : tile.StoreMiddles(at_middles);
    }
  });
}

Matrix KroneckerKernel::Respond(const Matrix& y, Workers& workers) const {
  Matrix q = Matrix::Zero(y.rows(), y.cols());
  ResponseScratch scratch;
  AddResponse(q, y, workers, scratch, q, [](Index, Index) {});
  return q;
}

void KroneckerKernel::AddResponse(const Eigen::Ref<const Matrix>& base, const Eigen::Ref<const Matrix>& y,
                                  Workers& workers, ResponseScratch& scratch, Eigen::Ref<Matrix> q,
                                  const OnColumns& computed) const {
  auto& [inputs, outputs] = scratch;
  inputs.resize(modes_->num_modes(), y.cols() + 1);
  outputs.resize(modes_->num_modes(), y.cols());
  inputs.col(0).setZero();
  modes_->Drive(modes_->C, y, inputs.rightCols(y.cols()), workers);
  Matrix no_middles;
  RespondInModes(inputs, Result::kReplaces, outputs, no_middles, workers);
  modes_->AddObserved(base, outputs, workers, q, computed);
}

Matrix KroneckerKernel::RespondAtMiddles(const Matrix& y, Workers& workers) const {
  FreeMotion rest;
  rest.modes.nodes = rest.modes.middles = Matrix::Zero(modes_->num_modes(), y.cols() - 1);
  return MoveThroughout(std::move(rest), y, workers).middles;
}

Motion KroneckerKernel::MoveThroughout(FreeMotion free, const Eigen::Ref<const Matrix>& y, Workers& workers) const {
  const Index steps = y.cols() - 1;
  auto& [free_inputs, nodes, middles] = free.modes;
  Matrix inputs(modes_->num_modes(), steps + 1);
  modes_->Drive(modes_->C, y, inputs, workers);
  if (free_inputs.size() > 0) inputs += free_inputs.leftCols(steps + 1);
  if (steps < nodes.cols()) {  // the march ended there
    nodes.conservativeResize(Eigen::NoChange, steps);
    middles.conservativeResize(Eigen::NoChange, steps);
  }
  RespondInModes(inputs, Result::kAdds, nodes, middles, workers);
  return {.nodes = modes_->Observe(std::move(nodes), workers), .middles = modes_->Observe(std::move(middles), workers)};
}

double KroneckerKernel::Bound(Index window) const {
  const std::lock_guard lock(bounds_mutex_);
  if (bounds_.empty()) bounds_.push_back(InfinityNorm(K0_));
  if (modes_->keeps_sign && static_cast<Index>(bounds_.size()) < window) {
    // ‖K_k‖_∞ is the largest entry of K_k (1, ..., 1).
    const Vector input = modes_->ToModes(modes_->C.sparse() * Vector::Ones(modes_->C.sparse().cols()));
    Matrix past = Matrix::Ones(terms_.decay.rows(), terms_.decay.cols());
    Matrix responses(past.rows(), window - 1);
    for (Index k = 0; k + 1 < window; ++k) {
      responses.col(k) = terms_.past.cwiseProduct(past).rowwise().sum().cwiseProduct(input);
      past = past.cwiseProduct(terms_.decay);
    }
    const Matrix of_ones = modes_->D.sparse() * modes_->FromModes(std::move(responses));
    for (Index k = static_cast<Index>(bounds_.size()); k < window; ++k) {
      bounds_.push_back(NanMax(bounds_.back(), MaxAbs(of_ones.col(k - 1))));
    }
  }
  if (modes_->keeps_sign) return bounds_[static_cast<std::size_t>(std::max<Index>(window, 1) - 1)] / step_;
  // ‖D‖ ‖Q‖ max_r |Σ_k ...| ‖Q‖ ‖C‖, in the ∞-norm with ‖Q‖_∞ <= √p.
  const auto norm = [](const SparseMatrix& matrix) { return InfinityNorm(StructuredMatrix(matrix)); };
  const auto p = static_cast<double>(modes_->num_modes());
  Matrix weight = terms_.past.cwiseAbs();
  double largest = MaxAbs(terms_.now);
  for (Index k = 1; k < window; ++k) {
    largest = NanMax(largest, MaxAbs(weight.rowwise().sum()));
    if (terms_.decay.maxCoeff() <= 1) break;  // no later block is larger
    weight = weight.cwiseProduct(terms_.decay);
  }
  return norm(modes_->D.sparse()) * norm(modes_->C.sparse()) * p * largest / step_;
}

}  // namespace dlcs
