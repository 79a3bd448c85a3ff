// SPDX-License-Identifier: Apache-2.0
// All basic solutions of a small LCP(q, M).

#ifndef DLCS_CORE_LCP_DENSE_BASIC_SOLUTIONS_H_
#define DLCS_CORE_LCP_DENSE_BASIC_SOLUTIONS_H_

#include <stop_token>
#include <vector>

#include "core/lcp/basis/solution_function.h"
#include "core/types.h"

namespace dlcs {

inline constexpr Index kMaxBasicSolutionsSize = 16;

// A solution y with y_S = -M_SS⁻¹ q_S and y = 0 elsewhere, for some S with M_SS nonsingular.
struct BasicSolution {
  Vector y, w;
  IndexSets sets;
  std::vector<Index> basis;  // the first such S
  Index num_bases = 1;       // how many S give this y: more than one if y is degenerate
};

// Solutions whose S has a singular M_SS: the polyhedron { y_S >= 0, y = 0 elsewhere, w_S = 0, w >= 0 }.
struct SolutionFace {
  std::vector<Index> basis;
  Vector nearest;      // its point of least norm
  bool point = false;  // it is that point alone; otherwise a continuum of solutions
};

struct BasicSolutions {
  std::vector<BasicSolution> solutions;  // distinct, in the order of their first bases as binary numbers
  std::vector<SolutionFace> faces;       // those that are not empty and hold more than solutions already listed
  bool complete = false;                 // every S was decided: all solutions are on the two lists
  bool empty() const { return solutions.empty() && faces.empty(); }
  bool unique() const { return complete && solutions.size() == 1 && faces.empty(); }
};

// All solutions of LCP(q, M), n <= kMaxBasicSolutionsSize, by looking at each of the 2ⁿ complementary bases once. For a
// nondegenerate M the solutions are all there is. Not complete where `stop` was requested (looked at for every basis),
// where more than 4096 solutions or faces were found, where a solution is beyond the range of doubles, or where a
// nearly singular basis could not be decided. `M` is n × n, `q` has n entries; all finite. Cost: 2ⁿ factorizations, and
// a quadratic program per singular basis with q_S in the range of M_SS.
BasicSolutions AllBasicSolutions(const Matrix& M, const Vector& q, const std::stop_token& stop = {},
                                 const Vector& tolerance = {});

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_BASIC_SOLUTIONS_H_
