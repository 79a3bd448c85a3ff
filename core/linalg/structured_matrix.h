// SPDX-License-Identifier: Apache-2.0
// A matrix that keeps its structure: dense, sparse, a Kronecker sum, or known by its products only.

#ifndef DLCS_CORE_LINALG_STRUCTURED_MATRIX_H_
#define DLCS_CORE_LINALG_STRUCTURED_MATRIX_H_

#include <Eigen/SparseCore>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "core/types.h"

namespace dlcs {

class Diagonals;

using SparseMatrix = Eigen::SparseMatrix<double>;

// F_1 ⊕ F_2 ⊕ ... = F_1 ⊗ I ⊗ ... + I ⊗ F_2 ⊗ ... + ..., all factors square, the index of the last factor running
// fastest: a finite-difference operator on a grid, with one factor per direction. Of size Π rows(F_i).
struct KroneckerSum {
  std::vector<SparseMatrix> factors;  // at least one

  Index size() const;
  SparseMatrix Assemble() const;
};

// A matrix known by its products only. Of a matrix whose rows are distributed over a team, the rows of this process by
// its own unknowns; products then exchange values with the other processes.
class LinearOperator {
 public:
  virtual ~LinearOperator() = default;
  virtual Index rows() const = 0;
  virtual Index cols() const = 0;
  virtual Index nonzeros() const = 0;
  // left = this · right
  virtual void Multiply(const Eigen::Ref<const Matrix>& right, Eigen::Ref<Matrix> left) const = 0;
  // |this| v for v >= 0
  virtual Vector AbsTimes(const Eigen::Ref<const Vector>& v) const = 0;
  // All entries. Throws std::logic_error where they are not known.
  virtual SparseMatrix Entries() const;
};

// Products use the structure; Dense() gives it up. Conversion from and to a dense Matrix is implicit, so that code for
// small problems need not know about structure.
//
// Threads: const calls are safe at once.
class StructuredMatrix {
 public:
  StructuredMatrix() : StructuredMatrix(Matrix()) {}
  StructuredMatrix(Matrix dense);
  StructuredMatrix(SparseMatrix sparse);
  StructuredMatrix(KroneckerSum sum);
  // Dense(), Sparse() and MaxAbs() need its Entries().
  StructuredMatrix(std::shared_ptr<const LinearOperator> linear_operator);
  template <class Derived>
  StructuredMatrix(const Eigen::MatrixBase<Derived>& dense) : StructuredMatrix(Matrix(dense)) {}

  Index rows() const { return is_dense() ? Dense().rows() : rows_; }
  Index cols() const { return is_dense() ? Dense().cols() : cols_; }
  Index size() const { return rows() * cols(); }
  // Numbers that are stored.
  Index nonzeros() const;
  std::string Describe() const;  // "dense 3x3", "sparse 9x3 (3 nonzeros)", "Kronecker sum of 255x255 and 255x255"

  bool is_dense() const { return std::holds_alternative<Matrix>(value_); }
  const SparseMatrix* sparse() const { return std::get_if<SparseMatrix>(&value_); }  // null where it is none
  const KroneckerSum* kronecker_sum() const { return std::get_if<KroneckerSum>(&value_); }
  const LinearOperator* linear_operator() const;

  // The most entries that Dense() may create: 512 MB.
  static constexpr Index kMaxDenseEntries = Index{1} << 26;
  bool FitsDense() const { return is_dense() || rows_ == 0 || cols_ <= kMaxDenseEntries / rows_; }
  // All entries. For a matrix with structure they are computed at the first call and kept; there must be at most
  // kMaxDenseEntries.
  const Matrix& Dense() const;
  operator const Matrix&() const { return Dense(); }

  // The nonzero entries, whatever the structure.
  SparseMatrix Sparse() const;

  // The matrix itself where it is dense, to be changed in place.
  Matrix& MutableDense() { return std::get<Matrix>(value_); }
  double& operator()(Index row, Index column) { return MutableDense()(row, column); }
  double operator()(Index row, Index column) const { return Dense()(row, column); }

  // ‖·‖_∞ and the largest entry in size; NaN where an entry is.
  double InfinityNorm() const;
  double MaxAbs() const;
  bool AllFinite() const;
  bool IsZero() const;  // no entry but 0
  // Zero of a Kronecker sum or a product, whose entries are not written down.
  Vector Diagonal() const;
  // |A| v for v >= 0.
  Vector AbsTimes(const Eigen::Ref<const Vector>& v) const;

  // The product with a few columns. Cost: the nonzeros, times the columns; of a Kronecker sum those of its factors,
  // times the size of the others.
  template <class Derived>
  auto operator*(const Eigen::MatrixBase<Derived>& right) const {
    using Product = Eigen::Matrix<double, Eigen::Dynamic, Derived::ColsAtCompileTime>;
    Product product(rows(), right.cols());
    Multiply(right, product);
    return product;
  }
  Matrix operator*(const StructuredMatrix& right) const;
  // left = this · right
  void Multiply(const Eigen::Ref<const Matrix>& right, Eigen::Ref<Matrix> left) const;

 private:
  struct Expansion;

  // The matrix by its diagonals, made at the first call and kept; null where there are too many.
  const Diagonals* StoredDiagonals(const SparseMatrix& sparse) const;

  std::variant<Matrix, SparseMatrix, KroneckerSum, std::shared_ptr<const LinearOperator>> value_;
  Index rows_ = 0;  // of a matrix with structure
  Index cols_ = 0;
  std::shared_ptr<Expansion> expansion_;  // Dense() and the diagonals, of a matrix with structure
};

double InfinityNorm(const StructuredMatrix& matrix);

// Whether M = Mᵀ, to the bit; not where an entry is NaN. Cost: the nonzeros.
bool IsSymmetric(const SparseMatrix& M);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_STRUCTURED_MATRIX_H_
