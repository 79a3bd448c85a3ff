// SPDX-License-Identifier: Apache-2.0
// All solutions of the linear complementarity problem of a circuit at one time, block by block.

#ifndef DLCS_CORE_CIRCUITS_SOLUTION_BLOCKS_H_
#define DLCS_CORE_CIRCUITS_SOLUTION_BLOCKS_H_

#include <vector>

#include "core/circuits/circuit_branches.h"
#include "core/lcp/lcp.h"
#include "core/types.h"

namespace dlcs {

// A solution of 0 <= y ⟂ w = q + M y >= 0. Entries that are zero but for rounding are zero. M is nonsingular in the
// basis if there is such a basis.
struct BlockSolution {
  Vector y, w;
  Basis basis;
  bool is_between = false;  // between two folds, in some block
};

struct BlockSolutions {
  std::vector<BlockSolution> all;
  // Pairs that depend on each other, and whose solutions could not be listed; empty if `all` is complete. A convex set
  // of solutions counts as one of them, which stands for all.
  std::vector<Index> undecided;
  // The first row of `observed` whose value such a set leaves open; -1 if there is none.
  Index open_row = -1;
};

// Pairs that depend on each other, at once and in both directions, are a block: a strongly connected component of the
// graph of M. Blocks are solved one after the other. The solutions of a P-matrix or a positive semidefinite one are one
// point, or a convex set. In any other block what holds the nodes of `clamps` is decided by trial, three cases for each
// of them: in each case the other pairs must have a matrix of these two classes. Where they have not, all bases of the
// block are searched, 16,384 in all, which is a block of 14 pairs; the pairs of one beyond that are `undecided`. So are
// those of a convex set in which values differ on which a block with several solutions depends.
//
// `sign` tells of each pair whether y is the current of its diode (1) or its reverse voltage (-1); w_i above
// -tolerance_i counts as nonnegative; `observed` has a column for each pair.
// Cost: an LCP for each block, for those with feedback 3^c of them with c clamps, c <= 8, and a factorization for each
// basis.
BlockSolutions SolveByBlocks(const Matrix& M, const Vector& q, const Vector& tolerance, const Matrix& observed,
                             const std::vector<ClampBranches>& clamps, const Vector& sign);

// The first of `rows`, linear functions of y, that differs among the solutions of LCP(q, M), of which `y` is one; -1 if
// none does, -2 if it could not be decided. For a positive semidefinite M: the others are { y >= 0, q + M y >= 0,
// (M + Mᵀ)(y - y*) = 0, qᵀ(y - y*) = 0 } ([Cottle 1992], Theorem 3.1.7). Only those count that have the values of `y`
// in the linear functions `fixed`. Cost: two linear programs for each row.
Index FirstOpenRow(const Matrix& M, const Vector& q, const Matrix& rows, const Vector& y, const Matrix& fixed = {});

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_SOLUTION_BLOCKS_H_
