// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/signorini_euler.h"

#include <stdexcept>

#include "core/linalg/simd/simd_dispatch.h"
#include "core/problem/time_function.h"

namespace dlcs::bench {
namespace {

Vector Neighbors(const Vector& v) {
  Vector sum = Vector::Zero(v.size());
  sum.head(v.size() - 1) += v.tail(v.size() - 1);
  sum.tail(v.size() - 1) += v.head(v.size() - 1);
  return sum;
}

}  // namespace

Matrix SampleObstacle(const Problem& problem, Index steps) {
  auto evaluator = TimeFunctionEvaluator::Create(problem.g.Inner(), problem.num_constraints());  // ψ of g = M ψ
  Matrix samples(problem.num_constraints(), steps + 1);
  for (Index j = 0; j <= steps; ++j) {
    const double t = problem.horizon * static_cast<double>(j) / static_cast<double>(steps);
    evaluator->Evaluate(t, Side::kLeft, samples.col(j));
  }
  return samples;
}

SignoriniEuler::SignoriniEuler(const Problem& problem, Index steps)
    : size_(problem.num_constraints()),
      steps_(steps),
      step_(problem.horizon / static_cast<double>(steps)),
      weight_(problem.B.Sparse().coeff(0, 0)),
      transform_(*FactorTransform::Create(problem.A.kronecker_sum()->factors[0])),
      along_(transform_.Forward(Vector::Unit(size_, 0))),
      M_(problem.M.Dense()),
      psi_(SampleObstacle(problem, steps)) {
  const Vector& lambda = transform_.eigenvalues();
  R_.resize(size_, size_);  // (b, a)
  for (Index a = 0; a < size_; ++a) R_.col(a) = (1 - step_ * (lambda[a] + lambda.array())).inverse();
  const Vector now = -2 * step_ * weight_ * (R_ * along_.cwiseAbs2());
  const Matrix identity = Matrix::Identity(size_, size_);
  const Matrix coupled = M_ + transform_.Backward(now.asDiagonal() * transform_.Forward(identity));
  auto splitting = SplitOffBand(coupled, 0.8);
  if (!splitting) throw std::runtime_error("M^h is far from banded");
  solver_ = std::make_unique<SplittingLcpSolver>(*std::move(splitting));
  tolerance_ = Vector::Constant(size_, 1e-13);
  y_ = Matrix::Zero(size_, steps + 1);
}

void SignoriniEuler::SolveLcp(const Vector& N_x, Index j) {
  const Vector q = N_x + M_.diagonal().cwiseProduct(psi_.col(j)) - Neighbors(psi_.col(j));
  Vector y = j < 4 ? Vector(y_.col(j - 1)) : Vector(3 * (y_.col(j - 1) - y_.col(j - 2)) + y_.col(j - 3));
  if (solver_->Solve(q, tolerance_, y) != SplittingVerdict::kSolved) throw std::runtime_error("an LCP is not solved");
  y_.col(j) = y;
}

CholeskyEuler::CholeskyEuler(const Problem& problem, Index steps)
    : SignoriniEuler(problem, steps), B_(problem.B.Sparse()), N_(problem.N.Sparse()), x_(problem.x0) {
  SparseMatrix identity(x_.size(), x_.size());
  identity.setIdentity();
  factor_.compute(identity - step_ * problem.A.Sparse());
}

void CholeskyEuler::Run(Index count) {
  for (Index j = 1; j <= count; ++j) {
    x_ += step_ * (B_ * psi_.col(j));
    SolveLcp(N_ * factor_.solve(x_), j);
    x_ += step_ * (B_ * y_.col(j));
    x_ = factor_.solve(x_).eval();
  }
}

SineEuler::SineEuler(const Problem& problem, Index steps) : SignoriniEuler(problem, steps), modes_(size_, size_) {
  const Eigen::Map<const Matrix> x0(problem.x0.data(), size_, size_);  // (x1, x2)
  modes_ = transform_.Forward(transform_.Forward(x0).transpose());     // (b, a)
}

void SineEuler::Run() {
  FactorTransform::Workspace workspace;
  const Matrix psi = transform_.Forward(psi_);
  const Vector response = R_ * along_.cwiseAbs2();
  Vector input = Vector::Zero(size_), seen(size_);
  for (Index j = 1; j <= steps_; ++j) {
    // x <- R (x + h B (y + ψ)) of the step before, and N R x for this one.
    seen.setZero();
    Advance(j > 1, input, seen);
    Vector N_x = -2 * (seen + step_ * weight_ * response.cwiseProduct(psi.col(j)));
    transform_.BackwardInPlace(N_x, workspace);
    SolveLcp(N_x, j);
    input = y_.col(j);
    transform_.ForwardInPlace(input, workspace);
    input = step_ * weight_ * (input + psi.col(j));
  }
  Advance(true, input, seen);
}

void SineEuler::Advance(bool moves, const Vector& input_modes, Vector& seen_modes) {
  const Index size = size_;
  RunWide([=, u = input_modes.data(), sum = seen_modes.data(), x_all = modes_.data(), r_all = R_.data(),
           along = along_.data()]() DLCS_WIDE {
    double* __restrict seen = sum;
    const double* __restrict input = u;
    for (Index a = 0; a < size; ++a) {
      double* __restrict x = x_all + a * size;
      const double* __restrict r = r_all + a * size;
      const double weight = along[a];
      if (moves) {
        for (Index b = 0; b < size; ++b) {
          const double next = r[b] * (x[b] + weight * input[b]);
          x[b] = next;
          seen[b] += weight * (r[b] * next);
        }
      } else {
        for (Index b = 0; b < size; ++b) seen[b] += weight * (r[b] * x[b]);
      }
    }
  });
}

}  // namespace dlcs::bench
