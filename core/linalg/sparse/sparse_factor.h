// SPDX-License-Identifier: Apache-2.0
// Systems of equations with a large sparse matrix, factored once.

#ifndef DLCS_CORE_LINALG_SPARSE_SPARSE_FACTOR_H_
#define DLCS_CORE_LINALG_SPARSE_SPARSE_FACTOR_H_

#include <complex>
#include <memory>
#include <type_traits>

#include "core/linalg/equilibration.h"
#include "core/linalg/structured_matrix.h"
#include "core/types.h"

namespace dlcs {

// An order of the unknowns that keeps the factors of zE - sA sparse: row and column `order[k]` come k-th. `E` with 0
// rows stands for the identity. Approximate minimum degree on the pattern of A + E and its transpose; source: [Amestoy,
// Davis, Duff 1996] An approximate minimum degree ordering algorithm. SIAM J. Matrix Anal. Appl. 17, 886-905.
Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> SparseOrder(const SparseMatrix& A,
                                                                          const SparseMatrix& E = {});

// The size of a Cholesky factor, and the multiplications that make it; the entries of the matrix.
struct FactorSize {
  double nonzeros = 0, multiplications = 0;
  double matrix_nonzeros = 0;
};

// That of a matrix with the pattern of A + E and its transpose in the order of SparseOrder(). Cost: below that of one
// solve.
FactorSize PredictFactor(const SparseMatrix& A, const SparseMatrix& E = {});

// The factors of zE - sA, in an order from SparseOrder() for the pattern of both: LU with pivots off the diagonal only
// where those on it are smaller than a hundredth of the column, or where the factors grow by that. Real z and s with a
// symmetric, positive definite zE - sA: Cholesky. Real factors whose pivots are all on the diagonal are dense panels.
//
// Cost: for a grid of m points in the plane some 30 m log m numbers and m^{3/2} work, in space m^{4/3} and m².
template <typename Scalar>
class SparseFactor {
 public:
  using Columns = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  using Column = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  using Order = Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int>;

  // `E` with 0 rows stands for the identity.
  SparseFactor(const SparseMatrix& A, const Order& order, Scalar z, double s, const SparseMatrix& E = {});
  SparseFactor(SparseFactor&&) noexcept;
  ~SparseFactor();

  // False where the matrix is singular to working precision.
  bool is_regular() const { return is_regular_; }
  // The memory of the factors.
  double bytes() const;
  // What a solve reads of it.
  double bytes_of_a_solve() const;

  // (zE - sA)⁻¹ times the columns; not finite where the matrix is singular. Safe to call from several threads.
  Columns Solve(const Eigen::Ref<const Columns>& columns) const;

  // Where real factors have all pivots on the diagonal, in the order P, Pᵀ L U P: FirstHalf(b) = L⁻¹ P b, which is
  // sparse where b is so, and SecondHalf(u) = Pᵀ U⁻¹ u. The solution is both. An entry cᵀx of it needs the first alone,
  // since it is that of FirstHalfOfTranspose(c) = U⁻ᵀ P c and FirstHalf(b).
  bool has_halves() const;
  Column FirstHalf(const Eigen::Ref<const Column>& right) const;
  Column FirstHalfOfTranspose(const Eigen::Ref<const Column>& right) const;
  Column SecondHalf(Column half) const;

 private:
  struct Factors;

  // Solves for a right-hand side without a pattern, and sets is_regular_. `units` are those of the rows and columns.
  // Whether the residual is that of factors that have not grown beyond the matrix.
  bool Probe(const Eigen::SparseMatrix<Scalar>& ordered, const Equilibration& units);
  void SolveInOrder(Column& column) const;

  Order order_;
  std::unique_ptr<Factors> factors_;
  bool is_regular_ = false;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_SPARSE_SPARSE_FACTOR_H_
