// SPDX-License-Identifier: Apache-2.0
#include "core/realisation/factor_transform.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>
#include <utility>
#include <vector>

namespace dlcs {
namespace {

using std::numbers::pi;

bool IsSymmetric(const SparseMatrix& factor) {
  if (factor.rows() != factor.cols()) return false;
  const SparseMatrix difference = factor - SparseMatrix(factor.transpose());
  for (Index j = 0; j < difference.outerSize(); ++j) {
    for (SparseMatrix::InnerIterator entry(difference, j); entry; ++entry) {
      if (entry.value() != 0) return false;
    }
  }
  return true;
}

// The diagonal and the one beside it of tridiag(b, a, b).
struct SecondDifference {
  double diagonal, beside;
};

std::optional<SecondDifference> AsSecondDifference(const SparseMatrix& factor) {
  if (factor.rows() < 2) return std::nullopt;
  const SecondDifference found{factor.coeff(0, 0), factor.coeff(1, 0)};
  Index matching = 0;
  for (Index j = 0; j < factor.outerSize(); ++j) {
    for (SparseMatrix::InnerIterator entry(factor, j); entry; ++entry) {
      const Index distance = std::abs(entry.row() - j);
      const double expected = distance == 0 ? found.diagonal : distance == 1 ? found.beside : 0;
      if (entry.value() != expected) return std::nullopt;
      if (distance <= 1) ++matching;
    }
  }
  if (matching != 3 * factor.rows() - 2) return std::nullopt;
  return found;
}

// Even, for the real FFT, and without large prime factors.
bool IsFastLength(Index length) {
  if (length % 2 != 0) return false;
  for (const Index prime : {2, 3, 5}) {
    while (length % prime == 0) length /= prime;
  }
  return length == 1;
}

}  // namespace

struct FactorTransform::Work {
  Eigen::FFT<double> fft;
  std::vector<double> series;
  std::vector<std::complex<double>> spectrum;
  Vector product;
};

FactorTransform::Workspace::Workspace() = default;
FactorTransform::Workspace::~Workspace() = default;
FactorTransform::Workspace::Workspace(Workspace&&) noexcept = default;

std::optional<FactorTransform> FactorTransform::Create(const SparseMatrix& factor) {
  if (!IsSymmetric(factor)) return std::nullopt;
  const Index size = factor.rows();
  FactorTransform transform;
  const auto difference = AsSecondDifference(factor);
  if (difference && IsFastLength(size + 1)) {
    transform.is_fast_ = true;
    transform.eigenvalues_.resize(size);
    transform.sines_.resize(size);
    for (Index k = 0; k < size; ++k) {
      const double angle = pi * static_cast<double>(k + 1) / static_cast<double>(size + 1);
      transform.sines_[k] = std::sin(angle);
      // a + 2b cos θ without cancellation for a = -2b.
      const double s = std::sin(angle / 2);
      transform.eigenvalues_[k] = (difference->diagonal + 2 * difference->beside) - 4 * difference->beside * s * s;
    }
    return transform;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix> solver{Matrix(factor)};
  transform.eigenvalues_ = solver.eigenvalues();
  transform.Q_ = solver.eigenvectors();
  return transform;
}

// x_k = √(2/N) Σ_j sin(πjk/N) x_j, N = q + 1, its own inverse, by one real FFT of length N: of the sequence
// sin(πj/N) (x_j + x_{N-j}) + (x_j - x_{N-j})/2 the imaginary parts are the even components, and the real parts are the differences
// of the odd ones [Press et al., Numerical Recipes, section 12.4].
void FactorTransform::SineTransform(Eigen::Ref<Vector> x, Work& work) const {
  const Index size = x.size(), length = size + 1;
  work.series.resize(static_cast<std::size_t>(length));
  work.series[0] = 0;
  for (Index j = 1; j < length; ++j) {
    const double one = x[j - 1], other = x[length - j - 1];
    work.series[static_cast<std::size_t>(j)] = sines_[j - 1] * (one + other) + 0.5 * (one - other);
  }
  work.fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  work.fft.fwd(work.spectrum, work.series);
  const double scale = std::sqrt(2.0 / static_cast<double>(length));
  double odd = 0.5 * work.spectrum[0].real();
  x[0] = scale * odd;
  for (Index k = 1; 2 * k <= size; ++k) {
    const std::complex<double> value = work.spectrum[static_cast<std::size_t>(k)];
    x[2 * k - 1] = -scale * value.imag();
    odd += value.real();
    if (2 * k < size) x[2 * k] = scale * odd;
  }
}

void FactorTransform::ForwardInPlace(Eigen::Ref<Vector> x, Workspace& workspace) const {
  if (!workspace.work_) workspace.work_ = std::make_unique<Work>();
  if (is_fast_) return SineTransform(x, *workspace.work_);
  workspace.work_->product.noalias() = Q_.transpose() * x;
  x = workspace.work_->product;
}

void FactorTransform::BackwardInPlace(Eigen::Ref<Vector> x, Workspace& workspace) const {
  if (!workspace.work_) workspace.work_ = std::make_unique<Work>();
  if (is_fast_) return SineTransform(x, *workspace.work_);
  workspace.work_->product.noalias() = Q_ * x;
  x = workspace.work_->product;
}

Matrix FactorTransform::Forward(const Eigen::Ref<const Matrix>& X) const {
  if (!is_fast_) return Q_.transpose() * X;
  Matrix result = X;
  Work work;
  for (Index k = 0; k < X.cols(); ++k) SineTransform(result.col(k), work);
  return result;
}

Matrix FactorTransform::Backward(const Eigen::Ref<const Matrix>& X) const {
  if (!is_fast_) return Q_ * X;
  return Forward(X);
}

}  // namespace dlcs
