// SPDX-License-Identifier: Apache-2.0
// Eigen's decompositions, and the functions below them and below products that take long to compile, compiled once. A
// file that includes only Eigen compiles its own.

#ifndef DLCS_CORE_LINALG_DECOMPOSITIONS_H_
#define DLCS_CORE_LINALG_DECOMPOSITIONS_H_

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <Eigen/SparseLU>
#include <complex>

#include "core/types.h"

namespace Eigen {

// What Householder reflections consist of and are applied to.
using BlockOfMatrix = Block<MatrixXd>;
using PartOfColumn = Block<const MatrixXd, Dynamic, 1>;

extern template class ColPivHouseholderQR<MatrixXd>;
extern template class CompleteOrthogonalDecomposition<MatrixXd>;
extern template class FullPivLU<MatrixXd>;
extern template class JacobiSVD<MatrixXd>;
extern template class PartialPivLU<MatrixXd>;
extern template class SelfAdjointEigenSolver<MatrixXd>;
extern template class SparseLU<SparseMatrix<double>, COLAMDOrdering<int>>;
extern template void MatrixBase<BlockOfMatrix>::applyHouseholderOnTheLeft(const PartOfColumn&, const double&, double*);
extern template void MatrixBase<BlockOfMatrix>::applyHouseholderOnTheRight(const PartOfColumn&, const double&, double*);

namespace internal {

using PartOfVector = VectorBlock<const VectorXd>;
using BlockOfVector = Block<const VectorXd, Dynamic, 1>;
using Triangle = Matrix<double, Dynamic, Dynamic, RowMajor>;
template <typename Scalar>
using Rows = const_blas_data_mapper<Scalar, Index, RowMajor>;
template <typename Scalar>
using Columns = const_blas_data_mapper<Scalar, Index, ColMajor>;

extern template struct general_matrix_vector_product<Index, double, Rows<double>, RowMajor, false, double,
                                                     Columns<double>, false, 0>;
extern template struct general_matrix_vector_product<Index, std::complex<double>, Rows<std::complex<double>>, RowMajor,
                                                     false, double, Columns<double>, false, 0>;
extern template struct general_matrix_vector_product<Index, double, Rows<double>, RowMajor, false, std::complex<double>,
                                                     Columns<std::complex<double>>, false, 0>;
extern template struct general_matrix_vector_product<Index, std::complex<double>, Rows<std::complex<double>>, RowMajor,
                                                     false, std::complex<double>, Columns<std::complex<double>>, false,
                                                     0>;
extern template void make_block_householder_triangular_factor(Triangle&, const BlockOfMatrix&, const PartOfVector&);
extern template void make_block_householder_triangular_factor(Triangle&, const BlockOfMatrix&, const BlockOfVector&);
extern template void apply_block_householder_on_the_left(BlockOfMatrix&, const BlockOfMatrix&, const PartOfVector&,
                                                         bool);
extern template void evaluateProductBlockingSizesHeuristic<double, double, 1>(Index&, Index&, Index&, Index);
extern template void evaluateProductBlockingSizesHeuristic<double, double, 4>(Index&, Index&, Index&, Index);
extern template void assign_sparse_to_sparse(SparseMatrix<double>&, const SparseMatrix<double>&);
extern template void sparselu_gemm(Index, Index, Index, const double*, Index, const double*, Index, double*, Index);

}  // namespace internal
}  // namespace Eigen

#endif  // DLCS_CORE_LINALG_DECOMPOSITIONS_H_
