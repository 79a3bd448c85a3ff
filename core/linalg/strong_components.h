// SPDX-License-Identifier: Apache-2.0
// The strongly connected components of the graph of a matrix.

#ifndef DLCS_CORE_LINALG_STRONG_COMPONENTS_H_
#define DLCS_CORE_LINALG_STRONG_COMPONENTS_H_

#include <Eigen/SparseCore>
#include <vector>

#include "core/types.h"

namespace dlcs {

// The strongly connected components of the graph i -> j where |A(i, j)| > threshold: the states that i depends on,
// directly or not, are in its own set or in later ones. Of a triangular A, upper or lower, every state is its own set;
// an upper one keeps its order. Cost: the entries.
std::vector<std::vector<Index>> StronglyConnected(const Eigen::Ref<const Matrix>& A, double threshold = 0);

// The same for a sparse A, for its entries other than zero.
std::vector<std::vector<Index>> StronglyConnected(const Eigen::SparseMatrix<double, Eigen::RowMajor>& A);

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_STRONG_COMPONENTS_H_
