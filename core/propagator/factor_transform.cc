// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/factor_transform.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <utility>

#include "core/linalg/decompositions.h"
#include "core/linalg/simd/simd_dispatch.h"
#include "core/linalg/simd/simd_pack.h"
#include "core/linalg/structured_matrix.h"

namespace dlcs {
namespace {

using std::numbers::pi;

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

struct SineTables {
  Index half;  // N/2
  const double *sines, *turn_re, *turn_im;
};

// The real sequence of length N whose transform holds that of the sines, its even elements in `re` and its odd ones in
// `im`.
template <Index lanes>
void Fold(const SineTables& tables, const double* x, double* re_out, double* im_out) {
  const Index half = tables.half, length = 2 * half;
  const double* sines = tables.sines;
  RunWide([=]() DLCS_WIDE {
    double* __restrict re = re_out;
    double* __restrict im = im_out;
    for (Index l = 0; l < lanes; ++l) re[l] = 0;
    for (Index i = 0; i < half; ++i) {
      for (Index l = 0; l < lanes; ++l) {
        if (i > 0) {
          const double one = x[(2 * i - 1) * lanes + l], other = x[(length - 2 * i - 1) * lanes + l];
          re[i * lanes + l] = sines[2 * i] * (one + other) + 0.5 * (one - other);
        }
        const double one = x[2 * i * lanes + l], other = x[(length - 2 * i - 2) * lanes + l];
        im[i * lanes + l] = sines[2 * i + 1] * (one + other) + 0.5 * (one - other);
      }
    }
  });
}

// The sine transform from the half-length transform of the folded sequence, even and odd elements taken apart first.
template <Index lanes>
void Unfold(const SineTables& tables, BatchedFft::Parts z, double* x_out) {
  const Index half = tables.half;
  const double scale = std::sqrt(1.0 / static_cast<double>(half));  // √(2/N)
  RunWide([=]() DLCS_WIDE {
    double* __restrict x = x_out;
    double odd[lanes];
    for (Index l = 0; l < lanes; ++l) {
      odd[l] = 0.5 * (z.re[l] + z.im[l]);
      x[l] = scale * odd[l];
    }
    for (Index k = 1; k < half; ++k) {
      const double *a_re = z.re + k * lanes, *a_im = z.im + k * lanes;
      const double *b_re = z.re + (half - k) * lanes, *b_im = z.im + (half - k) * lanes;
      const double w_re = tables.turn_re[k], w_im = tables.turn_im[k];
      for (Index l = 0; l < lanes; ++l) {
        const double odd_re = 0.5 * (a_im[l] + b_im[l]), odd_im = 0.5 * (b_re[l] - a_re[l]);
        const double re = 0.5 * (a_re[l] + b_re[l]) + (w_re * odd_re - w_im * odd_im);
        const double im = 0.5 * (a_im[l] - b_im[l]) + (w_re * odd_im + w_im * odd_re);
        odd[l] += re;
        x[(2 * k - 1) * lanes + l] = -scale * im;
        x[2 * k * lanes + l] = scale * odd[l];
      }
    }
  });
}

}  // namespace

struct FactorTransform::Work {
  Vector values, parts;  // of the lanes; real and imaginary parts, twice
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
  if (difference && size % 2 == 1 && BatchedFft::IsFastLength(size + 1)) {
    const Index half = (size + 1) / 2;
    transform.is_fast_ = true;
    transform.eigenvalues_.resize(size);
    transform.fourier_ = BatchedFft(half);
    transform.sines_ = Vector::Zero(size + 1);
    transform.turn_re_.resize(half);
    transform.turn_im_.resize(half);
    for (Index k = 0; k < half; ++k) {
      const double angle = pi * static_cast<double>(k) / static_cast<double>(half);
      transform.turn_re_[k] = std::cos(angle);
      transform.turn_im_[k] = -std::sin(angle);
    }
    for (Index k = 0; k < size; ++k) {
      const double angle = pi * static_cast<double>(k + 1) / static_cast<double>(size + 1);
      transform.sines_[k + 1] = std::sin(angle);
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
// sin(πj/N) (x_j + x_{N-j}) + (x_j - x_{N-j})/2 the imaginary parts are the even components, and the real parts are the
// differences of the odd ones [Press et al., Numerical Recipes, section 12.4]. The real FFT is a complex one of half
// the length.
void FactorTransform::SineTransform(double* x, Work& work) const {
  const Index half = fourier_.length();
  work.parts.resize(4 * half);
  double* parts = work.parts.data();
  const SineTables tables{half, sines_.data(), turn_re_.data(), turn_im_.data()};
  Fold<1>(tables, x, parts, parts + half);
  Unfold<1>(tables, fourier_.Forward(1, {parts, parts + half}, {parts + 2 * half, parts + 3 * half}), x);
}

void FactorTransform::SineTransformLanes(Work& work) const {
  const Index half = fourier_.length(), part = half * kLanes;
  work.parts.resize(4 * part);
  double *values = work.values.data(), *parts = work.parts.data();
  const SineTables tables{half, sines_.data(), turn_re_.data(), turn_im_.data()};
  Fold<kLanes>(tables, values, parts, parts + part);
  const auto spectrum = fourier_.Forward(kLanes, {parts, parts + part}, {parts + 2 * part, parts + 3 * part});
  Unfold<kLanes>(tables, spectrum, values);
}

void FactorTransform::SineTransforms(Eigen::Ref<Matrix> columns, Work& work) const {
  const Index size = columns.rows();
  work.values.resize(size * kLanes);
  double* const values = work.values.data();
  const bool fills_lanes = columns.cols() == kLanes;
  Eigen::Map<Eigen::Matrix<double, kLanes, Eigen::Dynamic>> lanes(values, kLanes, size);
  if (fills_lanes) {
    ColumnsToLanes(columns.data(), columns.outerStride(), size, values, kLanes);
  } else {
    lanes.setZero();
    lanes.topRows(columns.cols()) = columns.transpose();
  }
  SineTransformLanes(work);
  if (fills_lanes) {
    LanesToColumns(values, kLanes, size, columns.data(), columns.outerStride());
  } else {
    columns = lanes.topRows(columns.cols()).transpose();
  }
}

void FactorTransform::ForwardInPlace(Eigen::Ref<Vector> x, Workspace& workspace) const {
  if (!workspace.work_) workspace.work_ = std::make_unique<Work>();
  if (is_fast_) return SineTransform(x.data(), *workspace.work_);
  workspace.work_->product.noalias() = Q_.transpose() * x;
  x = workspace.work_->product;
}

void FactorTransform::BackwardInPlace(Eigen::Ref<Vector> x, Workspace& workspace) const {
  if (!workspace.work_) workspace.work_ = std::make_unique<Work>();
  if (is_fast_) return SineTransform(x.data(), *workspace.work_);
  workspace.work_->product.noalias() = Q_ * x;
  x = workspace.work_->product;
}

void FactorTransform::ForwardColumns(Eigen::Ref<Matrix> X) const {
  if (!is_fast_) {
    X = (Q_.transpose() * X).eval();
    return;
  }
  Work work;
  for (Index k = 0; k < X.cols(); k += kLanes) {
    SineTransforms(X.middleCols(k, std::min(kLanes, X.cols() - k)), work);
  }
}

void FactorTransform::BackwardColumns(Eigen::Ref<Matrix> X) const {
  if (is_fast_) return ForwardColumns(X);
  X = (Q_ * X).eval();
}

// Neighboring rows lie side by side as lanes do.
void FactorTransform::ForwardRows(Eigen::Ref<Matrix> X) const {
  if (!is_fast_) {
    X = (X * Q_).eval();
    return;
  }
  Work work;
  work.values.resize(size() * kLanes);
  Eigen::Map<Eigen::Matrix<double, kLanes, Eigen::Dynamic>> lanes(work.values.data(), kLanes, size());
  Index row = 0;
  for (; row + kLanes <= X.rows(); row += kLanes) {
    lanes = X.middleRows<kLanes>(row);
    SineTransformLanes(work);
    X.middleRows<kLanes>(row) = lanes;
  }
  if (const Index rest = X.rows() - row; rest > 0) {
    lanes.setZero();
    lanes.topRows(rest) = X.bottomRows(rest);
    SineTransformLanes(work);
    X.bottomRows(rest) = lanes.topRows(rest);
  }
}

void FactorTransform::BackwardRows(Eigen::Ref<Matrix> X) const {
  if (is_fast_) return ForwardRows(X);
  X = (X * Q_.transpose()).eval();
}

// Of sines, 2/N Σ_k sin(πki/N) v_k sin(πkj/N) = t_{i-j} - t_{i+j} with t_d = 1/N Σ_k v_k cos(πkd/N), even and of period
// 2N.
Matrix FactorTransform::Function(const Vector& values) const {
  const Index q = size(), length = q + 1;
  if (!is_fast_) return Q_ * values.asDiagonal() * Q_.transpose();
  Vector cosines(2 * length), t(2 * length + 1);
  for (Index k = 0; k < 2 * length; ++k) {
    cosines[k] = std::cos(pi * static_cast<double>(k) / static_cast<double>(length));
  }
  for (Index d = 0; d <= length; ++d) {
    double sum = 0;
    for (Index k = 1, angle = d; k <= q; ++k, angle += angle + d < 2 * length ? d : d - 2 * length) {
      sum += values[k - 1] * cosines[angle];
    }
    t[d] = t[2 * length - d] = sum / static_cast<double>(length);
  }
  Matrix function(q, q);
  for (Index j = 0; j < q; ++j) {
    for (Index i = 0; i < q; ++i) function(i, j) = t[std::abs(i - j)] - t[i + j + 2];
  }
  return function;
}

Matrix FactorTransform::Forward(const Eigen::Ref<const Matrix>& X) const {
  if (!is_fast_) return Q_.transpose() * X;
  Matrix result = X;
  ForwardColumns(result);
  return result;
}

Matrix FactorTransform::Backward(const Eigen::Ref<const Matrix>& X) const {
  if (!is_fast_) return Q_ * X;
  return Forward(X);
}

}  // namespace dlcs
