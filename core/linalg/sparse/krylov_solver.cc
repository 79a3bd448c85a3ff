// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/sparse/krylov_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/linalg/norms.h"

namespace dlcs {
namespace {

constexpr Index kRowsOfAVectorBlock = 4096;

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
      diagonals_(SymmetricDiagonals::Of(K_)),
      is_symmetric_(is_symmetric),
      workers_(workers),
      team_(team),
      is_fixed_(K_.rows(), 0),
      r_(K_.rows()) {
  const Index size = K_.rows();
  if (is_symmetric_) {
    for (Vector* vector : {&z_, &p_, &q_}) vector->setZero(size);
  } else {
    basis_.resize(size, kRestart + 1);
    corrections_.resize(size, kRestart);
    z_.resize(size);
  }
}

void KrylovSolver::Fix(const std::vector<std::uint8_t>& is_fixed) {
  is_fixed_ = is_fixed;
  if (!uses_diagonal_) PrepareFixed(is_fixed);
}

bool KrylovSolver::TryDiagonal() {
  constexpr int kMostPowers = 24;
  const Index size = K_.rows();
  inverse_diagonal_.resize(size);
  bool is_positive = is_symmetric_;
  for (Index i = 0; i < size; ++i) {
    double diagonal = 0;
    for (int k = K_.start[i]; k < K_.start[i + 1]; ++k) diagonal += K_.column[k] == i ? K_.value[k] : 0;
    inverse_diagonal_[i] = 1 / diagonal;
    is_positive = is_positive && diagonal > 0;
  }
  if (team_.Any(!is_positive)) return false;
  // J = D⁻¹|K - D|, D the diagonal. Of a positive v, min (Jv)_i / v_i <= ρ <= max (Jv)_i / v_i (Collatz and Wielandt),
  // and powers of J bring both together.
  const auto sum_of_sizes = [](const CompressedRows<double>& rows, Index i, const Vector& v) {
    double sum = 0;
    for (int k = rows.start[i]; k < rows.start[i + 1]; ++k) sum += std::abs(rows.value[k]) * v[rows.column[k]];
    return sum;
  };
  Vector v = inverse_diagonal_.cwiseSqrt(), next(size);  // in any units of a symmetric K it is the same start
  for (int power = 0; power < kMostPowers; ++power) {
    Expand(v);
    workers_.ForBlocks(size, kRowsOfAVectorBlock, [&](Index, Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        double sum = sum_of_sizes(K_, i, v);
        if (outside_.rows() > 0) sum += sum_of_sizes(outside_, i, outside_values_);
        next[i] = inverse_diagonal_[i] * sum - v[i];
      }
    });
    const auto ratios = next.array() / v.array();
    const double largest = team_.Max(size > 0 ? ratios.maxCoeff() : 0);
    const double smallest = -team_.Max(size > 0 ? -ratios.minCoeff() : -kDominated);
    uses_diagonal_ = largest <= kDominated;
    if (uses_diagonal_ || smallest > kDominated) break;
    v = (v + next) / 2;  // some powers of J alone would alternate
  }
  if (!uses_diagonal_) inverse_diagonal_.resize(0);
  return uses_diagonal_;
}

double KrylovSolver::RowTimes(Index i, const Vector& x) const {
  double product = 0;
  MultiplyRows(x, i, i + 1, &product);
  return product;
}

void KrylovSolver::MultiplyRows(const Vector& x, Index begin, Index end, double* product) const {
  const auto times = [begin, end, product](const CompressedRows<double>& rows, const double* factor, bool adds) {
    const int *const start = rows.start.data(), *const column = rows.column.data();
    const double* const value = rows.value.data();
    for (Index i = begin; i < end; ++i) {
      double sum = adds ? product[i - begin] : 0;
      for (int k = start[i], last = start[i + 1]; k < last; ++k) sum += value[k] * factor[column[k]];
      product[i - begin] = sum;
    }
  };
  if (diagonals_) {
    diagonals_->MultiplyRows(x.data(), begin, end, product);
  } else {
    times(K_, x.data(), false);
  }
  if (outside_.rows() > 0) times(outside_, outside_values_.data(), true);
}

void KrylovSolver::MultiplyFree(const Vector& v, Index begin, Index end, Vector& product) const {
  MultiplyRows(v, begin, end, product.data() + begin);
  for (Index i = begin; i < end; ++i) product[i] = is_fixed_[i] ? 0 : product[i];
}

KrylovSolver::Sums KrylovSolver::Multiply(const Vector& v, const Vector& other, Vector& product) {
  Expand(v);
  const Sums sums = SumOfBlocks([&](Index begin, Index end) {
    MultiplyFree(v, begin, end, product);
    const auto of_v = v.segment(begin, end - begin);
    return Sums{of_v.dot(product.segment(begin, end - begin)), of_v.dot(other.segment(begin, end - begin))};
  });
  return {team_.Sum(sums.first), team_.Sum(sums.second)};
}

double KrylovSolver::Dot(const Eigen::Ref<const Vector>& a, const Eigen::Ref<const Vector>& b) {
  const Sums sums = SumOfBlocks([&](Index begin, Index end) {
    return Sums{a.segment(begin, end - begin).dot(b.segment(begin, end - begin)), 0};
  });
  return team_.Sum(sums.first);
}

KrylovSolver::Sums KrylovSolver::MeasurePreconditioned(Index begin, Index end) const {
  const auto z = z_.segment(begin, end - begin);
  return {z.dot(r_.segment(begin, end - begin)), z.dot(q_.segment(begin, end - begin))};
}

KrylovSolver::Sums KrylovSolver::PreconditionResidual() {
  ++iterations_;
  Sums sums = of_diagonal_;
  if (!uses_diagonal_) {
    Precondition(r_, size_of_r_, z_);
    sums = SumOfBlocks([&](Index begin, Index end) { return MeasurePreconditioned(begin, end); });
  }
  return {team_.Sum(sums.first), team_.Sum(sums.second)};
}

template <typename Body>
KrylovSolver::Sums KrylovSolver::SumOfBlocks(const Body& body) {
  std::vector<Sums> sums((K_.rows() + kRowsOfAVectorBlock - 1) / kRowsOfAVectorBlock);
  workers_.ForBlocks(K_.rows(), kRowsOfAVectorBlock,
                     [&](Index block, Index begin, Index end) { sums[block] = body(begin, end); });
  Sums sum;
  for (const Sums& of_block : sums) sum += of_block;
  return sum;
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
  std::vector<Sums> sums(sizes.size());
  workers_.ForBlocks(r_.size(), kRowsOfAVectorBlock, [&](Index block, Index begin, Index end) {
    update(begin, end);
    sizes[block] = SizeOf(r_, scale_, begin, end);
    if (!uses_diagonal_) return;
    const Index rows = end - begin;
    z_.segment(begin, rows) = inverse_diagonal_.segment(begin, rows).cwiseProduct(r_.segment(begin, rows));
    sums[block] = MeasurePreconditioned(begin, end);
  });
  of_diagonal_ = {};
  for (const Sums& of_block : sums) of_diagonal_ += of_block;
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
    MultiplyRows(*x_, begin, end, r_.data() + begin);
    for (Index i = begin; i < end; ++i) r_[i] = is_fixed_[i] ? 0 : (*b_)[i] - r_[i];
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
    const auto [rho, change] = PreconditionResidual();
    if (!(rho > 0)) return false;
    const double beta = has_direction_ ? -last_step_ * change / rho_ : 0;
    rho_ = rho;
    if (has_direction_) {
      workers_.ForBlocks(p_.size(), kRowsOfAVectorBlock, [&](Index, Index begin, Index end) {
        const Index rows = end - begin;
        p_.segment(begin, rows) = z_.segment(begin, rows) + beta * p_.segment(begin, rows);
      });
    } else {
      p_ = z_;
    }
    const auto [curvature, slope] = Multiply(p_, r_, q_);
    if (!(curvature > 0)) return false;
    last_step_ = slope / curvature;
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
    ++iterations_;
    Precondition(r_, size_of_r_, z_);
    corrections_.col(k) = z_;
    Expand(z_);
    workers_.ForBlocks(r_.size(), kRowsOfAVectorBlock,
                       [&](Index, Index begin, Index end) { MultiplyFree(z_, begin, end, r_); });
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
