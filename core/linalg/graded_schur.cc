// SPDX-License-Identifier: Apache-2.0

#include "core/linalg/graded_schur.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/linalg/balance.h"
#include "core/linalg/double_double.h"
#include "core/linalg/norms.h"
#include "core/linalg/qr_iteration.h"
#include "core/linalg/schur_form.h"
#include "core/linalg/strong_components.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

using Complex = std::complex<double>;
using Wide = DoubleDoubleComplex;

// By columns.
class WideMatrix {
 public:
  explicit WideMatrix(Index size) : size_(size), entries_(static_cast<std::size_t>(size * size)) {}
  Index size() const { return size_; }
  Wide& operator()(Index i, Index j) { return entries_[static_cast<std::size_t>(i + size_ * j)]; }
  const Wide& operator()(Index i, Index j) const { return entries_[static_cast<std::size_t>(i + size_ * j)]; }

  Eigen::MatrixXcd Rounded() const {
    Eigen::MatrixXcd rounded(size_, size_);
    for (Index j = 0; j < size_; ++j) {
      for (Index i = 0; i < size_; ++i) rounded(i, j) = (*this)(i, j).Rounded();
    }
    return rounded;
  }

 private:
  Index size_;
  std::vector<Wide> entries_;
};

// [cosine, sine; -conj(sine), cosine] (x, y) = (r, 0)
struct Rotation {
  DoubleDouble cosine = 1;
  Wide sine;
};

Wide Scaled(const Wide& z, int exponent) {
  return {{std::ldexp(z.real.high, exponent), std::ldexp(z.real.low, exponent)},
          {std::ldexp(z.imag.high, exponent), std::ldexp(z.imag.low, exponent)}};
}

DoubleDouble SquaredSize(const Wide& z) { return z.real * z.real + z.imag * z.imag; }

Rotation RotationOf(Wide x, Wide y) {
  if (y.Size() == 0) return {};
  if (x.Size() == 0) return {0, {1, 0}};
  const int exponent = -std::ilogb(std::max(x.Size(), y.Size()));
  x = Scaled(x, exponent);
  y = Scaled(y, exponent);
  // Squares of what is far below 1 underflow; x is scaled once more by itself.
  const Wide x_own = Scaled(x, -std::ilogb(x.Size()));
  const DoubleDouble x_own_size = Sqrt(SquaredSize(x_own));
  const DoubleDouble norm = Sqrt(SquaredSize(x) + SquaredSize(y));
  const Wide sign = (DoubleDouble(1) / x_own_size) * x_own;  // x / |x|
  const Wide x_over_sign = Conjugate(sign) * x;              // |x|
  return {x_over_sign.real / norm, (DoubleDouble(1) / norm) * (sign * Conjugate(y))};
}

// Rows i, i + 1 from column `first` on; columns i, i + 1 down to row `last`.
void RotateRows(const Rotation& r, WideMatrix& A, Index i, Index first) {
  for (Index k = first; k < A.size(); ++k) {
    const Wide x = A(i, k), y = A(i + 1, k);
    A(i, k) = r.cosine * x + r.sine * y;
    A(i + 1, k) = r.cosine * y - Conjugate(r.sine) * x;
  }
}
void RotateColumns(const Rotation& r, WideMatrix& A, Index i, Index last) {
  for (Index k = 0; k <= last; ++k) {
    const Wide x = A(k, i), y = A(k, i + 1);
    A(k, i) = r.cosine * x + Conjugate(r.sine) * y;
    A(k, i + 1) = r.cosine * y - r.sine * x;
  }
}

// T := Uᴴ T U upper triangular, with the large eigenvalues first.
class WideSchur {
 public:
  explicit WideSchur(const Matrix& A) : T(A.rows()), U(A.rows()) {
    for (Index j = 0; j < A.cols(); ++j) {
      for (Index i = 0; i < A.rows(); ++i) T(i, j).real = A(i, j);
      U(j, j).real = 1;
    }
  }

  bool Run() {
    constexpr Index kMaxIterations = 60;
    ReduceToHessenberg();
    if (!IterateQr(T.size(), kMaxIterations, *this)) return false;
    Sort();
    return true;
  }

  WideMatrix T, U;

  // The interface that IterateQr() requires.
  bool CutsOff(Index i) {
    // Twice the rounding of a product, 2^-104. What is dropped need only be far below the 53 bits of the results beside
    // eigenvalues 1e14 times as small: a bit or two more or less are rounding.
    constexpr double kPrecision = 0x1p-103;
    const double beside = T(i, i).Size() + T(i + 1, i + 1).Size();
    if (!(T(i + 1, i).Size() <= kPrecision * beside)) return false;
    T(i + 1, i) = {};
    return true;
  }

  // Computed in double. The missing digits cost another sweep.
  Wide Shift(Index end, int iteration) const {
    const Wide& last = T(end, end);
    if (iteration % 10 == 9) return {last.real + T(end, end - 1).Size(), last.imag};
    // The eigenvalue of the last 2 × 2 block nearest to `last`: last + d - sqrt(d² + bc), d half the difference of the
    // diagonal.
    const Complex half = (T(end - 1, end - 1) - last).Rounded() / 2.0;
    const Complex b = T(end - 1, end).Rounded(), c = T(end, end - 1).Rounded();
    if (b == 0.0) return last;
    const Complex product = b * c;
    Complex root = std::sqrt(half * half + product);
    if ((std::conj(half) * root).real() < 0) root = -root;
    const Complex sum = half + root;
    if (sum == 0.0) return last;
    const Complex change = -product / sum;
    return {last.real + change.real(), last.imag + change.imag()};
  }

  void Begin(Index begin, Index end, const Wide& shift) {
    Rotate(RotationOf(T(begin, begin) - shift, T(begin + 1, begin)), begin, begin, std::min(begin + 2, end));
  }

  void Chase(Index i, Index end) {
    Rotate(RotationOf(T(i, i - 1), T(i + 1, i - 1)), i, i - 1, std::min(i + 2, end));
    T(i + 1, i - 1) = {};
  }

 private:
  void Rotate(const Rotation& r, Index i, Index first, Index last) {
    RotateRows(r, T, i, first);
    RotateColumns(r, T, i, last);
    RotateColumns(r, U, i, U.size() - 1);
  }

  void ReduceToHessenberg() {
    const Index size = T.size();
    for (Index j = 0; j + 2 < size; ++j) {
      LookForStop();
      for (Index i = size - 2; i > j; --i) {
        if (T(i + 1, j).Size() == 0) continue;
        Rotate(RotationOf(T(i, j), T(i + 1, j)), i, j, size - 1);
        T(i + 1, j) = {};
      }
    }
  }

  // Exchanges neighbors on the diagonal while the later one is more than twice as large.
  void Sort() {
    for (Index end = T.size() - 1; end > 0; --end) {
      LookForStop();
      for (Index i = 0; i < end; ++i) {
        if (!(T(i + 1, i + 1).Size() > 2 * T(i, i).Size())) continue;
        const Wide first = T(i, i), second = T(i + 1, i + 1);
        Rotate(RotationOf(T(i, i + 1), second - first), i, i, i + 1);
        T(i, i) = second;
        T(i + 1, i + 1) = first;
        T(i + 1, i) = {};
      }
    }
  }
};

// Whether the parts of an irreducible block hang together by entries of at least `part` times the largest of all.
bool HangsTogether(const Matrix& block, double part) {
  return StronglyConnected(block, part * MaxAbs(block)).size() == 1;
}

// Whether doubles lose digits that the entries of the balanced `block` have.
bool NeedsWide(const Matrix& block, double duration) {
  constexpr Index kLargest = 64;
  // In doubles couplings lose as many digits as they are smaller than the largest, slow eigenvalues as
  // many as duration · ‖block‖ has.
  constexpr double kSmallCoupling = 0x1p-8, kClearlySmaller = 0x1p-3, kLongTime = 64;
  if (block.rows() > kLargest) return false;
  if (!HangsTogether(block, kSmallCoupling)) return true;
  return !(duration * InfinityNorm(block) <= kLongTime) && !HangsTogether(block, kClearlySmaller);
}

std::optional<SchurForm> SchurOfBlock(const Matrix& block, double duration) {
  if (!NeedsWide(block, duration)) return ComputeSchurForm(block);
  const int exponent = std::ilogb(MaxAbs(block));
  WideSchur schur(std::ldexp(1.0, -exponent) * block);
  if (!schur.Run()) return std::nullopt;
  return SchurForm{std::ldexp(1.0, exponent) * schur.T.Rounded(), schur.U.Rounded()};
}

}  // namespace

std::optional<GradedSchurForm> ComputeGradedSchurForm(const Matrix& A, double duration) {
  if (!A.allFinite()) return std::nullopt;
  const BalancedMatrix balanced = Balance(A);
  const Index m = A.rows();
  GradedSchurForm form;
  form.triangle = balanced.matrix.cast<Complex>();
  form.vectors = form.inverse = Eigen::MatrixXcd::Zero(m, m);
  for (Index b = 0; b < balanced.num_blocks(); ++b) {
    const Index begin = balanced.begins[b], size = balanced.size_of_block(b), after = m - begin - size;
    Eigen::MatrixXcd U = Eigen::MatrixXcd::Identity(size, size);
    if (size > 1) {
      std::optional<SchurForm> block = SchurOfBlock(balanced.matrix.block(begin, begin, size, size), duration);
      if (!block) return std::nullopt;
      U = std::move(block->vectors);
      form.triangle.topRows(begin).middleCols(begin, size) *= U;
      form.triangle.middleRows(begin, size).rightCols(after) =
          U.adjoint() * form.triangle.middleRows(begin, size).rightCols(after);
      form.triangle.block(begin, begin, size, size) = block->triangle;
    }
    for (Index k = begin; k < begin + size; ++k) {
      const Index state = balanced.order[k];
      const double unit = std::ldexp(1.0, balanced.exponents[k]);
      form.vectors.row(state).segment(begin, size) = unit * U.row(k - begin);
      form.inverse.col(state).segment(begin, size) = 1 / unit * U.row(k - begin).adjoint();
    }
  }
  return form;
}

}  // namespace dlcs
