// SPDX-License-Identifier: Apache-2.0
// Random linear complementarity problems of every class, and the two published Z-matrices with several
// solutions.

#ifndef DLCS_TESTS_SUPPORT_LCP_PROBLEMS_H_
#define DLCS_TESTS_SUPPORT_LCP_PROBLEMS_H_

#include <cstdint>
#include <random>

#include "core/types.h"

namespace dlcs::testing {

// Draws matrices and vectors from a local generator: the same seed gives the same problems on every machine
// with the same standard library.
class LcpGenerator {
 public:
  explicit LcpGenerator(std::uint64_t seed) : engine_(seed) {}

  double Normal() { return std::normal_distribution<double>()(engine_); }
  double Uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  Index Integer(Index low, Index high) { return std::uniform_int_distribution<Index>(low, high)(engine_); }

  Matrix Gaussian(Index rows, Index columns);
  Vector GaussianVector(Index size) { return Gaussian(size, 1); }

  Matrix MMatrix(Index n);           // nonsingular, nonsymmetric, diagonally dominant by columns only
  Matrix SingularMMatrix(Index n);   // the Laplacian of a weighted directed graph: M·1 = 0
  Matrix ZMatrix(Index n);           // diagonal of both signs and zero: no P-matrix
  Matrix PositiveDefinite(Index n);  // far from symmetric
  // A P-matrix whose symmetric part is indefinite and that is no H-matrix, for n >= 2: block triangular in a
  // hidden order, with a large part above its blocks.
  Matrix IndefinitePMatrix(Index n);
  Matrix Skew(Index n);
  Matrix PositiveSemidefinite(Index n, Index rank);  // G Gᵀ of that rank plus a skew matrix
  // Rows and columns multiplied by powers of ten between 10^-decades and 10^decades, symmetrically.
  Matrix BadlyScaled(const Matrix& M, double decades);

  // q of which LCP(q, M) has the solution y with about half of the entries positive; degenerate entries (y =
  // w = 0) among them where `degenerate`.
  Vector SolvableQ(const Matrix& M, bool degenerate, Vector* y = nullptr);

  // Seeded by the caller's; for shuffles.
  std::mt19937_64& engine() { return engine_; }

 private:
  std::mt19937_64 engine_;
};

// M of example 4.1 in [Chen & Xiang 2013]: LCP(q, M) has up to four solutions.
Matrix ChenXiangExample41();

// M of example (4.2) in [Wu & Chen], a Z-matrix and no P-matrix.
Matrix WuChenExample42();

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_LCP_PROBLEMS_H_
