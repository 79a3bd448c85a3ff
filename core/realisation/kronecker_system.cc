// SPDX-License-Identifier: Apache-2.0
#include "core/realisation/kronecker_system.h"

#include <cmath>
#include <utility>

#include "core/linalg/low_rank.h"
#include "core/linalg/norms.h"
#include "core/linalg/wide_loops.h"
#include "core/realisation/scalar_phi.h"

namespace dlcs {
namespace {

// e^{rate_k i dt} for i = 0 ... count - 1 in column i: products of two tables, 2√count exponentials for each rate.
Matrix ExponentialTable(const Vector& rates, double dt, Index count) {
  constexpr Index kFine = 32;
  Matrix fine(rates.size(), kFine);
  for (Index i = 0; i < kFine; ++i) fine.col(i) = (rates * (dt * static_cast<double>(i))).array().exp();
  Matrix table(rates.size(), count);
  Vector coarse;
  for (Index i = 0; i < count; ++i) {
    if (i % kFine == 0) coarse = (rates * (dt * static_cast<double>(i))).array().exp();
    table.col(i) = coarse.cwiseProduct(fine.col(i % kFine));
  }
  return table;
}

// Weights of one step for every mode: x_j = decay x_{j-1} + before s_{j-1} + after s_j.
struct ModalWeights {
  Matrix decay, before, after;

  // For s linear over a step of length h, at its end (part = 1) or middle (1/2).
  ModalWeights(const KroneckerModes& modes, double h, double part)
      : decay(modes.mu.size(), modes.num_modes()), before(decay), after(decay) {
    for (Index r = 0; r < decay.cols(); ++r) {
      for (Index a = 0; a < decay.rows(); ++a) {
        const ScalarPhi phi = ScalarPhi::At(part * h * (modes.mu[a] + modes.lambda[r]));
        decay(a, r) = phi.phi0;
        after(a, r) = part * part * h * phi.phi2;
        before(a, r) = part * h * phi.phi1 - after(a, r);
      }
    }
  }

  Matrix Apply(const Matrix& x, const Matrix& s_before, const Matrix& s_after) const {
    return decay.cwiseProduct(x) + before.cwiseProduct(s_before) + after.cwiseProduct(s_after);
  }
};

bool IsZero(const TimeFunction& function) {
  for (const TimeFunction::Piece& piece : function.pieces) {
    const auto* constant = std::get_if<ConstantFunction>(&piece.function);
    if (!constant || !constant->value.isZero(0)) return false;
  }
  return true;
}

// `lift` as b ⊗ C' with the b of `along`, in modes already.
std::optional<SparseMatrix> AlongTheSameWall(const KroneckerModes& modes, const StructuredMatrix& lift) {
  const auto form = AsOuterProduct(lift.Sparse(), modes.axis);
  if (!form) return std::nullopt;
  const Vector b = modes.along.Forward(form->along);
  const double ratio = b.dot(modes.b) / modes.b.squaredNorm();
  if (!(MaxAbs(b - ratio * modes.b) <= 1e-14 * MaxAbs(b))) return std::nullopt;
  return SparseMatrix(ratio * form->across);
}

// For each input the values of the exponentials of `basis` at `nodes`: basis × p for each node.
void AddResponses(const ExponentialSteps& steps, const Matrix& inputs, Hold hold, const std::vector<Index>& nodes,
                  Workers& workers, std::vector<Matrix>& values) {
  constexpr Index kModesPerBlock = 16;  // their past stays in the first cache
  workers.ForBlocks(inputs.rows(), kModesPerBlock, [&](Index, Index begin, Index end) {
    const Index count = end - begin, terms = steps.decay.cols();
    const Matrix decay = steps.decay.middleRows(begin, count);
    Matrix past = steps.start.middleRows(begin, count).array().colwise() * inputs.col(0).segment(begin, count).array();
    Matrix input = inputs.middleRows(begin, count);
    if (hold == Hold::kConstant) input.col(0).setZero();
    Index from = 0;
    for (std::size_t next = 0; next < nodes.size(); ++next) {
      const Index to = nodes[next];
      RunWide([=, e_all = decay.data(), p_all = past.data(), u_all = input.data()]() DLCS_WIDE {
        for (Index k = 0; k < terms; ++k) {
          const double* __restrict e = e_all + k * count;
          double* __restrict p = p_all + k * count;
          for (Index j = from; j < to; ++j) {
            const double* __restrict u = u_all + j * count;
            for (Index r = 0; r < count; ++r) p[r] = e[r] * p[r] + u[r];
          }
        }
      });
      from = to;
      const auto alpha = steps.alpha.middleRows(begin, count), beta = steps.beta.middleRows(begin, count);
      values[next].middleCols(begin, count) +=
          (beta.cwiseProduct(past) + (alpha.array().colwise() * input.col(to).array()).matrix()).transpose();
    }
  });
}

}  // namespace

std::unique_ptr<KroneckerSystem> KroneckerSystem::Create(const Problem& problem, std::string& why_not) {
  auto modes = FindKroneckerModes(problem, why_not);
  if (!modes) return nullptr;
  return std::unique_ptr<KroneckerSystem>(new KroneckerSystem(std::move(modes), problem));
}

KroneckerSystem::KroneckerSystem(std::shared_ptr<const KroneckerModes> modes, const Problem& problem)
    : modes_(std::move(modes)) {
  if (IsZero(problem.f)) return;
  form_ = SourceForm::kGeneral;
  lift_ = problem.f.lift;
  if (!problem.f.is_lifted()) return;
  if (auto across = AlongTheSameWall(*modes_, lift_)) {
    form_ = SourceForm::kAlongWall;
    C_psi_ = *std::move(across);
  }
}

std::shared_ptr<const KroneckerKernel> KroneckerSystem::Kernel(double step, Hold hold) {
  for (const KeptKernel& kept : kernels_) {
    if (kept.step == step && kept.hold == hold) return kept.kernel;
  }
  constexpr std::size_t kMostKept = 8;
  if (kernels_.size() == kMostKept) kernels_.erase(kernels_.begin());
  kernels_.push_back({step, hold, std::make_shared<KroneckerKernel>(modes_, step, hold)});
  return kernels_.back().kernel;
}

std::shared_ptr<const ReducedKernel> KroneckerSystem::MakeKernel(double step, Hold hold, Index /*longest_window*/,
                                                                 Workers& /*workers*/,
                                                                 const std::stop_token& /*stop*/) {
  return Kernel(step, hold);
}

void KroneckerSystem::CarrySources(const RunSources& sources, const std::stop_token& stop,
                                   const std::function<void(Index, const Matrix&, const Matrix&)>& visit) const {
  const auto modes_of = [&](Index j) {
    const Vector f = lift_.size() > 0 ? Vector(lift_ * sources.psi.col(j)) : Vector(sources.psi.col(j));
    return modes_->StateToModes(f);
  };
  const ModalWeights whole(*modes_, sources.step, 1), half(*modes_, sources.step, 0.5);
  Matrix x = Matrix::Zero(modes_->mu.size(), modes_->num_modes());
  Matrix before = modes_of(0);
  for (Index j = 1; j < sources.psi.cols() && !stop.stop_requested(); ++j) {
    Matrix after = modes_of(j);
    const Matrix middle = half.Apply(x, before, after);
    x = whole.Apply(x, before, after);
    visit(j, x, middle);
    before = std::move(after);
  }
}

FreeMotion KroneckerSystem::Move(const Vector& x, const RunSources& sources, Workers& workers,
                                 const std::stop_token& stop) {
  const KroneckerModes& modes = *modes_;
  const Index steps = sources.psi.cols() - 1;
  const Matrix state = modes.StateToModes(x);

  // e^{tA} x0 by the exponentials of the basis; those along the axis are at most 1 and carry no shift.
  const double top = modes.mu.maxCoeff();
  const Vector rates = (modes.mu(modes.basis.kept).array() - top).matrix();
  const Vector shifted = (modes.lambda.array() + top).matrix();
  const Index times = 2 * steps + 1;
  // Smooth states have a low rank, a product of functions of each direction the rank one.
  const LowRank seen = FactorByRank(modes.basis.weights.transpose() * (modes.n.asDiagonal() * state));
  Matrix motion =
      seen.rows.transpose() * (seen.columns.transpose() * ExponentialTable(rates, sources.step / 2, times)).eval();
  motion = motion.cwiseProduct(ExponentialTable(shifted, sources.step / 2, times));
  motion.col(0) = state.transpose() * modes.n;

  Matrix nodes = motion(Eigen::all, Eigen::seqN(0, steps + 1, 2));
  Matrix middles = motion(Eigen::all, Eigen::seqN(1, steps, 2));
  if (form_ == SourceForm::kAlongWall) {
    const Matrix inputs = modes.ToModes(C_psi_ * sources.psi);
    const auto kernel = Kernel(sources.step, Hold::kLinear);
    nodes += kernel->ModesAtNodes(inputs, workers);
    middles += kernel->ModesAtMiddles(inputs, workers);
  } else if (form_ == SourceForm::kGeneral) {
    CarrySources(sources, stop, [&](Index j, const Matrix& node, const Matrix& middle) {
      nodes.col(j) += node.transpose() * modes.n;
      middles.col(j - 1) += middle.transpose() * modes.n;
    });
  }
  return {.nodes = modes.D * modes.FromModes(nodes), .middles = modes.D * modes.FromModes(middles)};
}

Matrix KroneckerSystem::States(const Vector& x, const RunSources& sources, const Matrix& y, Hold hold,
                               const std::vector<Index>& nodes, Workers& workers, const std::stop_token& stop) {
  const KroneckerModes& modes = *modes_;
  const Index count = static_cast<Index>(nodes.size());
  const Vector rates = modes.mu(modes.basis.kept);
  std::vector<Matrix> driven(nodes.size(), Matrix::Zero(rates.size(), modes.num_modes()));
  const bool along_wall = form_ == SourceForm::kAlongWall;
  Matrix inputs = modes.C * y;
  if (along_wall && hold == Hold::kLinear) inputs += C_psi_ * sources.psi;
  AddResponses({rates, modes.lambda, sources.step, hold}, modes.ToModes(inputs), hold, nodes, workers, driven);
  if (along_wall && hold == Hold::kConstant) {
    AddResponses({rates, modes.lambda, sources.step, Hold::kLinear}, modes.ToModes(C_psi_ * sources.psi), Hold::kLinear,
                 nodes, workers, driven);
  }
  std::vector<Matrix> carried(nodes.size());
  if (form_ == SourceForm::kGeneral) {
    std::size_t next = 0;
    CarrySources(sources, stop, [&](Index j, const Matrix& node, const Matrix&) {
      if (next < nodes.size() && nodes[next] == j) carried[next++] = node;
    });
    if (next < nodes.size()) return {};
  }

  const Matrix state = modes.StateToModes(x);
  const double top = modes.mu.maxCoeff();
  Matrix states(modes.num_states, count);
  workers.ForBlocks(count, 1, [&](Index i, Index, Index) {
    if (stop.stop_requested()) return;
    const auto at = static_cast<std::size_t>(i);
    const double t = sources.step * static_cast<double>(nodes[at]);
    const Vector along = ((modes.mu.array() - top) * t).exp();
    const Vector across = ((modes.lambda.array() + top) * t).exp();
    Matrix value = along.asDiagonal() * state * across.asDiagonal();
    value.noalias() += modes.b.asDiagonal() * modes.basis.weights * driven[at];
    if (carried[at].size() > 0) value += carried[at];
    states.col(i) = modes.StateFromModes(value);
  });
  return states;
}

RealisationRecord KroneckerSystem::record() const {
  return {.used = Realisation::kKroneckerSum,
          .reason = "A is a symmetric Kronecker sum, B and N act along one axis of its grid",
          .terms = modes_->response.rates.size(),
          .factorizations = 0,
          .error = modes_->response.error};
}

}  // namespace dlcs
