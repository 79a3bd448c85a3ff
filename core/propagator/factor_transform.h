// SPDX-License-Identifier: Apache-2.0
// The eigenvector basis of a symmetric factor, as a fast transform if there is one.

#ifndef DLCS_CORE_PROPAGATOR_FACTOR_TRANSFORM_H_
#define DLCS_CORE_PROPAGATOR_FACTOR_TRANSFORM_H_

#include <memory>
#include <optional>

#include "core/linalg/structured_matrix.h"
#include "core/propagator/batched_fft.h"
#include "core/types.h"

namespace dlcs {

// F = Q Λ Qᵀ. For F = tridiag(b, a, b), second differences with fixed ends, Q is the sine transform, made by an FFT
// where its length has small prime factors only (columns side by side, core/propagator/batched_fft.h); for all others
// it is computed (9 q³) and applied as a dense product. The bits of a column do not depend on the other columns.
class FactorTransform {
 public:
  // Absent where F is not symmetric.
  static std::optional<FactorTransform> Create(const SparseMatrix& factor);

  Index size() const { return eigenvalues_.size(); }
  const Vector& eigenvalues() const { return eigenvalues_; }
  bool is_fast() const { return is_fast_; }

  // Qᵀ X and Q X, column by column. Several threads may apply one transform.
  Matrix Forward(const Eigen::Ref<const Matrix>& X) const;
  Matrix Backward(const Eigen::Ref<const Matrix>& X) const;
  // In place.
  void ForwardColumns(Eigen::Ref<Matrix> X) const;
  void BackwardColumns(Eigen::Ref<Matrix> X) const;
  // Q diag(`values`) Qᵀ, the function of F with these values at the eigenvalues. Cost: 2 q² where the transform is
  // fast.
  Matrix Function(const Vector& values) const;
  // Row by row, in place: X Q and X Qᵀ.
  void ForwardRows(Eigen::Ref<Matrix> X) const;
  void BackwardRows(Eigen::Ref<Matrix> X) const;
  // One column in place, without an allocation once `work` has been used.
  struct Work;
  class Workspace {
   public:
    Workspace();
    ~Workspace();
    Workspace(Workspace&&) noexcept;

   private:
    friend class FactorTransform;
    std::unique_ptr<Work> work_;
  };
  void ForwardInPlace(Eigen::Ref<Vector> x, Workspace& workspace) const;
  void BackwardInPlace(Eigen::Ref<Vector> x, Workspace& workspace) const;

 private:
  void SineTransform(double* x, Work& work) const;
  void SineTransforms(Eigen::Ref<Matrix> columns, Work& work) const;  // at most kLanes
  void SineTransformLanes(Work& work) const;                          // of work.values, entry by entry

  static constexpr Index kLanes = 8;

  Vector eigenvalues_;
  bool is_fast_ = false;
  // Of the sine transform, N = q + 1: the FFT of length N/2, sin(πj/N) for j < N, and e^{-2πik/N} for k < N/2.
  BatchedFft fourier_;
  Vector sines_, turn_re_, turn_im_;
  Matrix Q_;  // of all others
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_FACTOR_TRANSFORM_H_
