// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/decompositions.h"

template class Eigen::ColPivHouseholderQR<dlcs::Matrix>;
template class Eigen::CompleteOrthogonalDecomposition<dlcs::Matrix>;
template class Eigen::FullPivLU<dlcs::Matrix>;
template class Eigen::JacobiSVD<dlcs::Matrix>;
template class Eigen::PartialPivLU<dlcs::Matrix>;
template class Eigen::SelfAdjointEigenSolver<dlcs::Matrix>;
