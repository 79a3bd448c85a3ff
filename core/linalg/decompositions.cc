// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/decompositions.h"

namespace Eigen {

template class ColPivHouseholderQR<MatrixXd>;
template class CompleteOrthogonalDecomposition<MatrixXd>;
template class FullPivLU<MatrixXd>;
template class JacobiSVD<MatrixXd>;
template class PartialPivLU<MatrixXd>;
template class SelfAdjointEigenSolver<MatrixXd>;
template class SparseLU<SparseMatrix<double>, COLAMDOrdering<int>>;
template void MatrixBase<BlockOfMatrix>::applyHouseholderOnTheLeft(const PartOfColumn&, const double&, double*);
template void MatrixBase<BlockOfMatrix>::applyHouseholderOnTheRight(const PartOfColumn&, const double&, double*);

namespace internal {

template struct general_matrix_vector_product<Index, double, Rows<double>, RowMajor, false, double, Columns<double>,
                                              false, 0>;
template struct general_matrix_vector_product<Index, std::complex<double>, Rows<std::complex<double>>, RowMajor, false,
                                              double, Columns<double>, false, 0>;
template struct general_matrix_vector_product<Index, double, Rows<double>, RowMajor, false, std::complex<double>,
                                              Columns<std::complex<double>>, false, 0>;
template struct general_matrix_vector_product<Index, std::complex<double>, Rows<std::complex<double>>, RowMajor, false,
                                              std::complex<double>, Columns<std::complex<double>>, false, 0>;
template void make_block_householder_triangular_factor(Triangle&, const BlockOfMatrix&, const PartOfVector&);
template void make_block_householder_triangular_factor(Triangle&, const BlockOfMatrix&, const BlockOfVector&);
template void apply_block_householder_on_the_left(BlockOfMatrix&, const BlockOfMatrix&, const PartOfVector&, bool);
template void evaluateProductBlockingSizesHeuristic<double, double, 1>(Index&, Index&, Index&, Index);
template void evaluateProductBlockingSizesHeuristic<double, double, 4>(Index&, Index&, Index&, Index);
template void assign_sparse_to_sparse(SparseMatrix<double>&, const SparseMatrix<double>&);
template void sparselu_gemm(Index, Index, Index, const double*, Index, const double*, Index, double*, Index);

}  // namespace internal
}  // namespace Eigen
