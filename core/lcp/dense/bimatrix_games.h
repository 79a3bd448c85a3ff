// SPDX-License-Identifier: Apache-2.0
// LCPs that are bimatrix games, in any order of their indices.

#ifndef DLCS_CORE_LCP_DENSE_BIMATRIX_GAMES_H_
#define DLCS_CORE_LCP_DENSE_BIMATRIX_GAMES_H_

#include <optional>
#include <vector>

#include "core/lcp/basis/lcp_solver.h"
#include "core/lcp/basis/scaled_lcp.h"

namespace dlcs {

// The games that an LCP(q, M) falls into. y = 0 outside of them.
struct BimatrixGames {
  // M has entries between the indices of two players only, and q has one sign for each player, not both positive. With
  // R = M_IJ, C = M_JIᵀ and q = -1: the costs of the players, of whom the first takes i with the probability y_i / Σ
  // y_I.
  struct Game {
    std::vector<Index> first, second;  // I, J, increasing
  };
  std::vector<Game> games;
  bool is_nonnegative = true;  // R and C of all games
  bool is_infeasible = false;  // proven: no y solves the LCP
};

// Recognizes games. An index i with q_i >= 0 and a row of M without negative entries may have y_i = 0 (it must, if
// q_i > 0); so it is left out, and others may follow. What M connects of the rest must then fall into two players.
// Absent if it does not. Cost: O(n²).
std::optional<BimatrixGames> FindBimatrixGames(const ScaledLcp& lcp);

// Looks for a solution by the method of Lemke and Howson, each game by itself, and from one equilibrium to others until
// one is a solution. Where R and C are positive, each is. With zeros and negative entries only those are at which the
// costs have the signs of -q; there may be none, or others than those that are found. True if `basis` is that of a
// solution (BasisPoint). Adds the exchanges to `pivots`.
//
// Rows are divided by |q_i| and columns by their largest entry, so the units of y and w do not matter. A column with
// entries that are not positive gets a constant added: at a given v with Σ v_j = 1 it changes all costs by as much, so
// the equilibria are the same.
bool SolveByLemkeHowson(const ScaledLcp& lcp, const BimatrixGames& games, Basis& basis, Index& pivots);

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_BIMATRIX_GAMES_H_
