// SPDX-License-Identifier: Apache-2.0
// Algebraic multigrid: an approximate inverse of a large sparse matrix, in a few passes over its entries.

#ifndef DLCS_CORE_LINALG_SPARSE_MULTIGRID_H_
#define DLCS_CORE_LINALG_SPARSE_MULTIGRID_H_

#include <Eigen/LU>
#include <cstdint>
#include <vector>

#include "core/linalg/sparse/compressed_rows.h"
#include "core/parallel/parallel.h"
#include "core/types.h"

namespace dlcs {

// One V-cycle over levels of smoothed aggregation (core/linalg/sparse/aggregation.h): Gauss-Seidel forward before,
// backward after the correction from the coarser level, A_c = Pᵀ A P. For a symmetric K the V-cycle is symmetric, and
// positive definite where K is. It is made for matrices I - hA of diffusion, with convection if it does not dominate
// within a cell; for other matrices it may be a poor approximation, and nothing here claims otherwise.
//
// Unknowns can be fixed: then it approximates the inverse of the rows and columns of the others. The coarse functions
// are cut off at fixed unknowns, and the coarse matrices follow: only rows near unknowns whose state changed are
// computed again, with the bits that computing all of them would have. So the quality does not depend on which
// unknowns are fixed.
//
// Gauss-Seidel runs through blocks of 4096 rows, each with the values that the other blocks had before the sweep, and
// with the sum of the couplings to them added to the diagonal, which makes every such sweep converge for a symmetric
// positive definite matrix. Blocks do not depend on the number of threads, so neither do the bits. All levels are in
// single precision: a preconditioner needs no more, and passes over memory are what it costs.
//
// Source: aggregation.h; [Baker, Falgout, Kolev, Yang 2011] Multigrid smoothers for ultraparallel computing. SIAM J.
// Sci. Comput. 33, 2864-2887 (the diagonal); [Gräser, Kornhuber 2009] Multigrid methods for obstacle problems. J.
// Comput. Math. 27, 1-44 (the truncation).
class Multigrid {
 public:
  // The pattern of `K` is symmetric and holds the diagonal. Cost: some twenty V-cycles.
  Multigrid(const CompressedRows<double>& K, Workers& workers);

  // From now on the unknowns with is_fixed[i] != 0 are fixed, and no others.
  void Fix(const std::vector<std::uint8_t>& is_fixed);

  // z = the V-cycle applied to r, 0 in fixed unknowns. `size`: max |r_i|. Looks for stop requests.
  void Apply(const Vector& r, double size, Vector& z);

  // Entries of all levels, relative to those of K.
  double complexity() const;

 private:
  struct Level {
    CompressedRows<float> A;
    CompressedRows<float> P, R;           // to the next level, where there is one; R = Pᵀ
    std::vector<float> inverse_diagonal;  // 0 where there is no unknown
    std::vector<float> b, x, work;
  };

  void AddLevels();
  void InvertDiagonal(Level& level, const std::vector<std::uint8_t>* is_fixed, Index begin, Index end) const;
  // Computes the rows of the matrix of the level after `fine` whose marks are set.
  void ComputeRows(const Level& fine, const std::vector<std::uint8_t>& marks, Level& coarse) const;
  void FactorCoarsest();
  void Cycle(std::size_t at);
  void SweepForwardFromZero(Level& level) const;
  void SweepBackward(Level& level) const;

  Workers& workers_;
  std::vector<Level> levels_;
  std::vector<std::uint8_t> is_fixed_;
  Eigen::PartialPivLU<Matrix> coarsest_;
  bool has_coarsest_ = false;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_SPARSE_MULTIGRID_H_
