// SPDX-License-Identifier: Apache-2.0
// Eigen's decompositions of dense matrices, compiled once (decompositions.cc) and not again in each file that uses
// them.

#ifndef DLCS_CORE_LINALG_DECOMPOSITIONS_H_
#define DLCS_CORE_LINALG_DECOMPOSITIONS_H_

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

#include "core/types.h"

extern template class Eigen::ColPivHouseholderQR<dlcs::Matrix>;
extern template class Eigen::CompleteOrthogonalDecomposition<dlcs::Matrix>;
extern template class Eigen::FullPivLU<dlcs::Matrix>;
extern template class Eigen::JacobiSVD<dlcs::Matrix>;
extern template class Eigen::PartialPivLU<dlcs::Matrix>;
extern template class Eigen::SelfAdjointEigenSolver<dlcs::Matrix>;

#endif  // DLCS_CORE_LINALG_DECOMPOSITIONS_H_
