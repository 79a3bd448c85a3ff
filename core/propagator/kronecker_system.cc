// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/kronecker_system.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/linalg/bounded_sum.h"
#include "core/linalg/low_rank.h"
#include "core/linalg/norms.h"
#include "core/linalg/simd/elimination_loops.h"
#include "core/propagator/kronecker_kernel.h"

namespace dlcs {
namespace {

// Exponentials below this value are negligible beside 1 and are set to zero. Otherwise products with them would be
// subnormal, and each subnormal product takes a processor some hundred cycles.
constexpr double kNothing = 1e-100;
Vector WithoutNothing(const Vector& exponentials) { return (exponentials.array() > kNothing).select(exponentials, 0); }

// e^{rate_k i dt} for i = 0, 1, ..., one at a time: products of two tables, 2√count exponentials for each rate.
class Exponentials {
 public:
  Exponentials(const Vector& rates, double dt) : rates_(rates), dt_(dt), fine_(rates.size(), kFine) {
    for (Index i = 0; i < kFine; ++i) fine_.col(i) = Direct(i);
  }

  // Must be called with i = 0, 1, ... in this order, without gaps.
  const Vector& At(Index i) {
    if (i % kFine == 0) coarse_ = Direct(i);
    value_ = coarse_.cwiseProduct(fine_.col(i % kFine));
    return value_;
  }

 private:
  static constexpr Index kFine = 32;
  Vector Direct(Index i) const { return WithoutNothing((rates_ * (dt_ * static_cast<double>(i))).array().exp()); }

  Vector rates_;
  double dt_;
  Matrix fine_;
  Vector coarse_, value_;
};

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

// Computes sum -= left · right with the widest registers available.
void Subtract(const Matrix& left, const Matrix& right, Matrix& sum) {
  SubtractProduct(sum.rows(), sum.cols(), left.cols(), left.data(), left.rows(), right.data(), right.rows(), sum.data(),
                  sum.rows());
}

// The size of the cache that holds some kernels of a large grid if the caller provides none.
constexpr Index kOwnModesBytes = 64'000'000;

double BytesOf(const KroneckerModes& modes) {
  const double q = static_cast<double>(modes.mu.size()), p = static_cast<double>(modes.num_modes());
  double numbers = static_cast<double>(modes.basis.weights.size()) + 16 * (p + q);
  // Transforms hold at most a square matrix each.
  numbers += q * q;
  for (const FactorTransform& factor : modes.across) numbers += std::pow(static_cast<double>(factor.size()), 2);
  return 8 * numbers;
}

double BytesOf(const KroneckerKernel& kernel) {
  const ModeRecursion& terms = kernel.terms();
  double numbers = static_cast<double>(kernel.K0().size());
  for (const Matrix* matrix : {&terms.decay, &terms.start, &terms.past, &terms.mid_past}) {
    numbers += static_cast<double>(matrix->size());
  }
  return 8 * numbers;
}

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
  if (!(MaxAbs(b - ratio * modes.b) <= RoundingOf(64) * MaxAbs(b))) return std::nullopt;
  return SparseMatrix(ratio * form->across);
}

// What the exponentials of the basis show of a state: Wᵀ diag(n) `state`, W the weights.
LowRank SeenByBasis(const KroneckerModes& modes, const Matrix& state) {
  constexpr Index kLow = 8;  // a product of functions of each direction has the rank one
  const Matrix& weights = modes.basis.weights;
  // What transforms leave of a column by rounding, found by trial on 40² to 512² points: 38 ε of 86 ε for 256².
  const double rounding =
      RoundingOf(8) * modes.n.norm() * state.norm() / std::sqrt(static_cast<double>(modes.num_modes()));
  if (auto factors = FactorIfRankIsAtMost(kLow, rounding, modes.n.asDiagonal() * state)) {
    return {weights.transpose() * factors->columns, std::move(factors->rows)};
  }
  // Smooth states have a low rank here.
  Matrix projected = Matrix::Zero(weights.cols(), modes.num_modes());
  Subtract(-weights.transpose(), modes.n.asDiagonal() * state, projected);
  return FactorByRank(std::move(projected));
}

// For each input the values of the exponentials of `basis` at `nodes`: basis × p for each node.
void AddResponses(const ExponentialSteps& steps, const Matrix& inputs, Hold hold, const std::vector<Index>& nodes,
                  Workers& workers, std::vector<Matrix>& values) {
  ModeRecursion recursion;
  recursion.decay = steps.decay;
  recursion.start = steps.start;
  workers.ForBlocks(inputs.rows(), ModeTile::kModes, [&](Index, Index begin, Index end) {
    const Index count = end - begin;
    const auto alpha = steps.alpha.middleRows(begin, count), beta = steps.beta.middleRows(begin, count);
    const ModeTile::Terms terms(recursion, begin, count);
    ModeTile tile(terms, inputs.col(0), hold == Hold::kConstant, ModeTile::kSteps);
    Index done = 0;  // steps that P_j has in it: û_j enters in the next
    for (std::size_t next = 0; next < nodes.size(); ++next) {
      while (done < nodes[next]) {
        const Index here = std::min(ModeTile::kSteps, nodes[next] - done);
        tile.Carry(inputs.middleCols(done + 1, here), ModeTile::Sums::kNone);
        done += here;
      }
      const auto input = inputs.col(done).segment(begin, count).array();
      values[next].middleCols(begin, count) +=
          (beta.cwiseProduct(tile.Past()) + (alpha.array().colwise() * input).matrix()).transpose();
    }
  });
}

}  // namespace

std::unique_ptr<KroneckerSystem> KroneckerSystem::Create(const Problem& problem, std::string& why_not,
                                                         SetupCache* setups) {
  SharedSetups shared(setups, kOwnModesBytes);
  SetupKey matrices("Kronecker");
  matrices.Add(problem.A).Add(problem.B).Add(problem.N).Add(problem.E);
  auto modes = shared->Get<KroneckerModes>(matrices, [&]() -> SetupCache::Made<KroneckerModes> {
    auto made = FindKroneckerModes(problem, why_not);
    const double bytes = made ? BytesOf(*made) : 0;
    return {std::move(made), bytes};
  });
  if (!modes) return nullptr;
  return std::unique_ptr<KroneckerSystem>(
      new KroneckerSystem(std::move(modes), std::move(matrices), std::move(shared), problem));
}

KroneckerSystem::KroneckerSystem(std::shared_ptr<const KroneckerModes> modes, SetupKey matrices, SharedSetups setups,
                                 const Problem& problem)
    : modes_(std::move(modes)), matrices_(std::move(matrices)), setups_(std::move(setups)) {
  if (IsZero(problem.f)) return;
  form_ = SourceForm::kGeneral;
  lift_ = problem.f.lift;
  if (!problem.f.is_lifted()) return;
  if (auto across = AlongTheSameWall(*modes_, lift_)) {
    form_ = SourceForm::kAlongWall;
    C_psi_ = SeparableMatrix(*std::move(across));
  }
}

std::shared_ptr<const KroneckerKernel> KroneckerSystem::Kernel(double step, Hold hold) {
  SetupKey key = matrices_;
  key.Add(step).Add(static_cast<Index>(hold));
  return setups_->Get<KroneckerKernel>(key, [&]() -> SetupCache::Made<KroneckerKernel> {
    auto kernel = std::make_shared<const KroneckerKernel>(modes_, step, hold);
    const double bytes = BytesOf(*kernel);
    return {std::move(kernel), bytes};
  });
}

const Matrix& KroneckerSystem::ModesOf(const Vector& x) {
  if (state_.size() == 0 || state_ != x) {
    state_modes_ = modes_->StateToModes(x);
    state_ = x;
  }
  return state_modes_;
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

FreeMotion KroneckerSystem::Move(const Vector& x, const RunSources& sources, Hold hold, Workers& workers,
                                 const std::stop_token& stop) {
  const KroneckerModes& modes = *modes_;
  const Index steps = sources.psi.cols() - 1;
  const Matrix& state = ModesOf(x);
  FreeMotion motion;
  Matrix& inputs = motion.modes.inputs;
  Matrix& nodes = motion.modes.nodes;
  Matrix& middles = motion.modes.middles;
  nodes.resize(modes.num_modes(), steps);
  middles.resize(modes.num_modes(), steps);
  const bool is_general = form_ == SourceForm::kGeneral;
  if (is_general) {
    CarrySources(sources, stop, [&](Index j, const Matrix& node, const Matrix& middle) {
      nodes.col(j - 1) = node.transpose() * modes.n;
      middles.col(j - 1) = middle.transpose() * modes.n;
    });
  }

  // e^{tA} x0 by the exponentials of the basis; those along the axis are at most 1 and carry no shift.
  const double top = modes.mu.maxCoeff();
  const LowRank seen = SeenByBasis(modes, state);
  const Matrix across = seen.rows.transpose();
  Exponentials along_axis((modes.mu(modes.basis.kept).array() - top).matrix(), sources.step / 2);
  Exponentials across_axis((modes.lambda.array() + top).matrix(), sources.step / 2);
  Vector weights, seen_now;
  for (Index i = 0; i <= 2 * steps; ++i) {
    const Vector &along = along_axis.At(i), &shift = across_axis.At(i);
    if (i == 0) continue;
    weights = seen.columns.transpose() * along;
    seen_now.noalias() = across * weights;
    auto at = (i % 2 == 0 ? nodes : middles).col((i - 1) / 2);
    seen_now.array() *= shift.array();
    if (is_general) {
      at += seen_now;
    } else {
      at = seen_now;
    }
  }

  motion.nodes.resize(modes.num_modes(), steps + 1);
  motion.nodes.col(0) = state.transpose() * modes.n;
  motion.nodes.rightCols(steps) = nodes;
  if (form_ == SourceForm::kAlongWall) {
    inputs.resize(modes.num_modes(), steps + 1);
    modes.Drive(C_psi_, sources.psi, inputs, workers);
    const auto kernel = Kernel(sources.step, Hold::kLinear);
    if (hold == Hold::kLinear) {  // the middles wait for y, which enters as the sources do
      Matrix no_middles;
      kernel->RespondInModes(inputs, KroneckerKernel::Result::kAdds, motion.nodes.rightCols(steps), no_middles,
                             workers);
    } else {
      kernel->RespondInModes(inputs, KroneckerKernel::Result::kAdds, nodes, middles, workers);
      motion.nodes.rightCols(steps) = nodes;
      inputs.resize(0, 0);
    }
  }
  motion.nodes = modes.Observe(std::move(motion.nodes), workers);
  return motion;
}

Matrix KroneckerSystem::States(const Vector& x, const RunSources& sources, const Matrix& y, Hold hold,
                               const std::vector<Index>& nodes, Workers& workers, const std::stop_token& stop) {
  const KroneckerModes& modes = *modes_;
  const Index count = static_cast<Index>(nodes.size());
  const Vector rates = modes.mu(modes.basis.kept);
  std::vector<Matrix> driven(nodes.size(), Matrix::Zero(rates.size(), modes.num_modes()));
  const bool along_wall = form_ == SourceForm::kAlongWall;
  const bool joined = along_wall && hold == Hold::kLinear;
  Matrix inputs(modes.num_modes(), y.cols());
  modes.C.Multiply(y, inputs);
  if (joined) C_psi_.AddProduct(inputs, sources.psi.leftCols(inputs.cols()), inputs);
  AddResponses({rates, modes.lambda, sources.step, hold}, modes.ToModes(std::move(inputs)), hold, nodes, workers,
               driven);
  if (along_wall && !joined) {
    inputs.resize(modes.num_modes(), y.cols());
    modes.Drive(C_psi_, sources.psi.leftCols(y.cols()), inputs, workers);
    AddResponses({rates, modes.lambda, sources.step, Hold::kLinear}, inputs, Hold::kLinear, nodes, workers, driven);
  }
  std::vector<Matrix> carried(nodes.size());
  if (form_ == SourceForm::kGeneral) {
    std::size_t next = 0;
    CarrySources(sources, stop, [&](Index j, const Matrix& node, const Matrix&) {
      if (next < nodes.size() && nodes[next] == j) carried[next++] = node;
    });
    if (next < nodes.size()) return {};
  }

  const Matrix& state = ModesOf(x);
  const double top = modes.mu.maxCoeff();
  const Matrix withdrawn = (-modes.b).asDiagonal() * modes.basis.weights;
  Matrix states(modes.num_states, count);
  workers.ForBlocks(count, 1, [&](Index i, Index, Index) {
    if (stop.stop_requested()) return;
    const auto at = static_cast<std::size_t>(i);
    const double t = sources.step * static_cast<double>(nodes[at]);
    const Vector along = WithoutNothing(((modes.mu.array() - top) * t).exp());
    const Vector across = WithoutNothing(((modes.lambda.array() + top) * t).exp());
    Matrix value = along.asDiagonal() * state * across.asDiagonal();
    Subtract(withdrawn, driven[at], value);
    if (carried[at].size() > 0) value += carried[at];
    modes.StateFromModes(std::move(value), states.col(i));
  });
  return states;
}

PropagatorRecord KroneckerSystem::record() const {
  return {.used = PropagatorKind::kKroneckerSum,
          .reason = "A is a symmetric Kronecker sum, B and N act along one axis of its grid",
          .terms = modes_->response.rates.size(),
          .factorizations = 0,
          .error = modes_->response.error};
}

}  // namespace dlcs
