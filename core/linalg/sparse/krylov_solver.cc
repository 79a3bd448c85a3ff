// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/sparse/krylov_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

constexpr Index kRowsOfAVectorBlock = 4096;

// Sums and maxima over blocks, in the order of blocks.
template <typename Body>
double SumOfBlocks(Index count, Workers& workers, const Body& body) {
  std::vector<double> sums((count + kRowsOfAVectorBlock - 1) / kRowsOfAVectorBlock);
  workers.ForBlocks(count, kRowsOfAVectorBlock,
                    [&](Index block, Index begin, Index end) { sums[block] = body(begin, end); });
  double sum = 0;
  for (const double of_block : sums) sum += of_block;
  return sum;
}

// b += factor a
void AddMultiple(double factor, const Eigen::Ref<const Vector>& a, Eigen::Ref<Vector> b, Workers& workers) {
  workers.ForBlocks(a.size(), kRowsOfAVectorBlock, [&](Index, Index begin, Index end) {
    b.segment(begin, end - begin) += factor * a.segment(begin, end - begin);
  });
}

struct ResidualSize {
  double scaled = 0, plain = 0;
};

}  // namespace

KrylovSolver::KrylovSolver(CompressedRows<double> K, bool is_symmetric, Workers& workers, Team& team)
    : K_(std::move(K)),
      is_symmetric_(is_symmetric),
      workers_(workers),
      team_(team),
      is_fixed_(K_.rows(), 0),
      r_(K_.rows()) {
  const Index size = K_.rows();
  if (is_symmetric_) {
    for (Vector* vector : {&z_, &p_, &q_}) vector->resize(size);
  } else {
    basis_.resize(size, kRestart + 1);
    corrections_.resize(size, kRestart);
    z_.resize(size);
  }
}

void KrylovSolver::Fix(const std::vector<std::uint8_t>& is_fixed) {
  is_fixed_ = is_fixed;
  PrepareFixed(is_fixed);
}

double KrylovSolver::RowTimes(Index i, const Vector& x) const {
  double sum = 0;
  for (int k = K_.start[i]; k < K_.start[i + 1]; ++k) sum += K_.value[k] * x[K_.column[k]];
  if (outside_.rows() == 0) return sum;
  for (int k = outside_.start[i]; k < outside_.start[i + 1]; ++k) {
    sum += outside_.value[k] * outside_values_[outside_.column[k]];
  }
  return sum;
}

double KrylovSolver::Multiply(const Vector& v, Vector& product) {
  Expand(v);
  return team_.Sum(SumOfBlocks(v.size(), workers_, [&](Index begin, Index end) {
    double dot = 0;
    for (Index i = begin; i < end; ++i) {
      product[i] = is_fixed_[i] ? 0 : RowTimes(i, v);
      dot += v[i] * product[i];
    }
    return dot;
  }));
}

double KrylovSolver::Dot(const Eigen::Ref<const Vector>& a, const Eigen::Ref<const Vector>& b) {
  return team_.Sum(SumOfBlocks(a.size(), workers_, [&](Index begin, Index end) {
    return a.segment(begin, end - begin).dot(b.segment(begin, end - begin));
  }));
}

void KrylovSolver::CountAndPrecondition(const Vector& v, Vector& z) {
  ++iterations_;
  Precondition(v, size_of_r_, z);
}

namespace {

// max |r_i| of a block.
ResidualSize SizeOf(const Vector& r, const ResidualScale& scale, Index begin, Index end) {
  ResidualSize size;
  const Index split = std::clamp(scale.split, begin, end);
  const double first = MaxAbs(r.segment(begin, split - begin)), second = MaxAbs(r.segment(split, end - split));
  size.plain = NanMax(first, second);
  size.scaled = NanMax(first / scale.first, second / scale.second);
  return size;
}

}  // namespace

template <typename Body>
void KrylovSolver::UpdateResidual(const Body& update) {
  std::vector<ResidualSize> sizes((r_.size() + kRowsOfAVectorBlock - 1) / kRowsOfAVectorBlock);
  workers_.ForBlocks(r_.size(), kRowsOfAVectorBlock, [&](Index block, Index begin, Index end) {
    update(begin, end);
    sizes[block] = SizeOf(r_, scale_, begin, end);
  });
  residual_ = size_of_r_ = 0;
  for (const ResidualSize& size : sizes) {
    residual_ = NanMax(residual_, size.scaled);
    size_of_r_ = NanMax(size_of_r_, size.plain);
  }
  residual_ = team_.Max(residual_);
  size_of_r_ = team_.Max(size_of_r_);
}

void KrylovSolver::ComputeResidual() {
  Expand(*x_);
  UpdateResidual([&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) r_[i] = is_fixed_[i] ? 0 : (*b_)[i] - RowTimes(i, *x_);
  });
}

void KrylovSolver::Start(const Vector& b, Vector& x, const ResidualScale& scale) {
  b_ = &b;
  x_ = &x;
  scale_ = scale;
  Refresh();
}

void KrylovSolver::Refresh() {
  has_direction_ = false;
  ComputeResidual();
}

bool KrylovSolver::Reduce(double target, Index max_iterations) {
  if (std::isnan(residual_)) return false;
  if (residual_ <= target) return true;
  return is_symmetric_ ? ReduceByConjugateGradients(target, max_iterations) : ReduceByGmres(target, max_iterations);
}

// The next direction is made orthogonal to the last one by the change of the residual, -last_step_ q: the
// preconditioner is not the same to the last bit at each step (Polak-Ribière).
bool KrylovSolver::ReduceByConjugateGradients(double target, Index max_iterations) {
  for (Index iteration = 0; iteration < max_iterations; ++iteration) {
    CountAndPrecondition(r_, z_);
    const double rho = Dot(r_, z_);
    if (!(rho > 0)) return false;
    const double beta = has_direction_ ? -last_step_ * Dot(z_, q_) / rho_ : 0;
    rho_ = rho;
    if (has_direction_) {
      workers_.ForBlocks(p_.size(), kRowsOfAVectorBlock, [&](Index, Index begin, Index end) {
        const Index rows = end - begin;
        p_.segment(begin, rows) = z_.segment(begin, rows) + beta * p_.segment(begin, rows);
      });
    } else {
      p_ = z_;
    }
    const double curvature = Multiply(p_, q_);
    if (!(curvature > 0)) return false;
    last_step_ = Dot(r_, p_) / curvature;
    has_direction_ = true;
    UpdateResidual([&](Index begin, Index end) {
      const Index rows = end - begin;
      x_->segment(begin, rows) += last_step_ * p_.segment(begin, rows);
      r_.segment(begin, rows) -= last_step_ * q_.segment(begin, rows);
    });
    if (std::isnan(residual_)) return false;
    if (residual_ <= target) return true;
  }
  return false;
}

bool KrylovSolver::ReduceByGmres(double target, Index max_iterations) {
  for (Index done = 0; done < max_iterations;) {
    const double before = residual_;
    done += GmresCycle(0.5 * target / residual_, std::min(kRestart, max_iterations - done));
    ComputeResidual();
    if (residual_ <= target) return true;
    constexpr double kProgress = 0.9;
    if (!(residual_ < kProgress * before)) return false;
  }
  return false;
}

// x + Z y of least ‖r - K Z y‖₂, Z the corrections, with K Z = V H and the columns of the basis V orthonormal.
Index KrylovSolver::GmresCycle(double factor, Index steps) {
  const double norm = std::sqrt(Dot(r_, r_));
  if (!(norm > 0)) return steps;
  Matrix H = Matrix::Zero(steps + 1, steps);
  Vector rotated = Vector::Zero(steps + 1), cosine(steps), sine(steps);
  rotated[0] = norm;
  basis_.col(0) = r_ / norm;
  Index size = 0;
  while (size < steps && std::abs(rotated[size]) > factor * norm) {
    const Index k = size;
    r_ = basis_.col(k);  // work space from here on
    size_of_r_ = team_.Max(MaxAbs(r_));
    CountAndPrecondition(r_, z_);
    corrections_.col(k) = z_;
    Multiply(z_, r_);
    for (Index i = 0; i <= k; ++i) {
      H(i, k) = Dot(basis_.col(i), r_);
      AddMultiple(-H(i, k), basis_.col(i), r_, workers_);
    }
    const double left = std::sqrt(Dot(r_, r_));
    H(k + 1, k) = left;
    for (Index i = 0; i < k; ++i) {
      const double above = H(i, k), below = H(i + 1, k);
      H(i, k) = cosine[i] * above + sine[i] * below;
      H(i + 1, k) = cosine[i] * below - sine[i] * above;
    }
    const double length = std::hypot(H(k, k), H(k + 1, k));
    ++size;
    if (!(length > 0)) {  // K is singular, or a number is not finite
      --size;
      break;
    }
    cosine[k] = H(k, k) / length;
    sine[k] = H(k + 1, k) / length;
    H(k, k) = length;
    rotated[k + 1] = -sine[k] * rotated[k];
    rotated[k] *= cosine[k];
    if (!(left > 0)) break;
    basis_.col(k + 1) = r_ / left;
  }
  const Vector y = H.topLeftCorner(size, size).triangularView<Eigen::Upper>().solve(rotated.head(size));
  for (Index k = 0; k < size; ++k) AddMultiple(y[k], corrections_.col(k), *x_, workers_);
  return std::max<Index>(size, 1);
}

}  // namespace dlcs
