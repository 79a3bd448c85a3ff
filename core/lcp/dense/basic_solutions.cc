// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/basic_solutions.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/lcp/basis/basis_point.h"
#include "core/lcp/basis/polish.h"
#include "core/lcp/basis/tolerance.h"
#include "core/lcp/dense/enumeration.h"
#include "core/lcp/dense/nearest_point.h"
#include "core/linalg/decompositions.h"
#include "core/linalg/equilibration.h"

namespace dlcs {
namespace {

constexpr std::size_t kMaxSolutions = 4096;

class Collector {
 public:
  Collector(const Matrix& M, const Vector& q) : M_(M), q_(q) { found_.complete = true; }

  void AddSolution(const std::vector<Index>& S, const Vector& y) {
    for (BasicSolution& known : found_.solutions) {
      if (!Same(known.y, y)) continue;
      ++known.num_bases;
      return;
    }
    found_.solutions.push_back({.y = y, .w = q_ + M_ * y, .sets = FindIndexSets(M_, q_, y), .basis = S});
  }

  // A face without equations to solve is dismissed before the quadratic program.
  void AddFace(const std::vector<Index>& S) {
    const Equilibration scale = EquilibrateRowsAndColumns(M_(S, S));
    const Matrix block = Scaled(M_(S, S), scale);
    const Vector rhs = -scale.row.cwiseProduct(q_(S));
    const Vector y = block.completeOrthogonalDecomposition().solve(rhs);
    const Vector size = rhs.cwiseAbs() + block.cwiseAbs() * y.cwiseAbs();
    if (((block * y - rhs).cwiseAbs().array() > kSameResult * size.array()).any()) return;

    const Index n = static_cast<Index>(S.size());
    const NearestPoint nearest = FindNearestPoint(SolutionFaceOf(M_, q_, S), {Matrix::Identity(n, n), Vector::Zero(n)});
    if (nearest.answer == Feasibility::kUnknown) GiveUpUnlessEmpty(S);
    if (nearest.answer != Feasibility::kFeasible) return;
    SolutionFace face{.basis = S, .nearest = Vector::Zero(q_.size())};
    face.nearest(S) = nearest.v;
    face.point = !HasOtherPoint(SolutionFaceOf(M_, q_, S), nearest.v);
    found_.faces.push_back(face);
  }

  bool full() const { return found_.solutions.size() + found_.faces.size() >= kMaxSolutions; }
  // Where rounding hides whether there is a solution with the support in S.
  void GiveUpUnlessEmpty(const std::vector<Index>& S) {
    if (SolveFaceExactly(M_, q_, S).answer != Feasibility::kInfeasible) GiveUp();
  }
  void GiveUp() { found_.complete = false; }

  // Drops the faces that are single points already listed.
  BasicSolutions Finish() && {
    std::vector<SolutionFace> kept;
    for (const SolutionFace& face : found_.faces) {
      const auto is_known = [&](const auto& list, const auto& point_of) {
        return std::any_of(list.begin(), list.end(),
                           [&](const auto& item) { return Same(point_of(item), face.nearest); });
      };
      const bool known = is_known(found_.solutions, [](const BasicSolution& s) { return s.y; }) ||
                         is_known(kept, [](const SolutionFace& f) { return f.nearest; });
      if (!face.point || !known) kept.push_back(face);
    }
    found_.faces = kept;
    return std::move(found_);
  }

 private:
  // Whether two solutions differ by no more than rounding, relative to the size of the entry or to the terms of all
  // rows that it occurs in.
  bool Same(const Vector& a, const Vector& b) const {
    const Vector larger = a.cwiseMax(b);
    const Vector size = q_.cwiseAbs() + M_.cwiseAbs() * larger;
    for (Index j = 0; j < a.size(); ++j) {
      const double difference = std::abs(a[j] - b[j]);
      if (difference <= kMaybeZero * larger[j]) continue;
      const bool seen = ((M_.col(j).cwiseAbs() * difference).array() > kMaybeZero * size.array()).any();
      if (seen || M_.col(j).isZero(0)) return false;
    }
    return true;
  }

  const Matrix& M_;
  const Vector& q_;
  BasicSolutions found_;
};

// The columns of each row of M that are not zero, as bits.
std::vector<unsigned> RowMasks(const Matrix& M) {
  std::vector<unsigned> masks(static_cast<std::size_t>(M.rows()), 0);
  for (Index i = 0; i < M.rows(); ++i) {
    for (Index j = 0; j < M.cols(); ++j) masks[static_cast<std::size_t>(i)] |= (M(i, j) != 0 ? 1u : 0u) << j;
  }
  return masks;
}

// Whether an equation w_i = 0 of the subset has no unknown, and a constant: no factors are needed to see it.
bool HasEmptyEquation(const std::vector<unsigned>& masks, const Vector& q, unsigned subset) {
  for (std::size_t i = 0; i < masks.size(); ++i) {
    if ((subset >> i & 1u) != 0 && (masks[i] & subset) == 0 && q[static_cast<Index>(i)] != 0) return true;
  }
  return false;
}

}  // namespace

BasicSolutions AllBasicSolutions(const Matrix& M, const Vector& q, const std::stop_token& stop,
                                 const Vector& tolerance) {
  const Index n = M.rows();
  ScaledLcp lcp(M);
  lcp.Load(q, tolerance.size() > 0 ? tolerance : Vector::Zero(n));
  BasisPoint point(lcp, Elimination::kPivoting);
  Collector collector(M, q);
  Vector y(n);
  const std::vector<unsigned> masks = RowMasks(M);
  for (unsigned subset = 0; subset < (1u << n); ++subset) {
    if (stop.stop_requested() || collector.full()) {
      collector.GiveUp();
      break;
    }
    if (HasEmptyEquation(masks, q, subset)) continue;
    const Basis basis = BasisOf(subset, n);
    if (!point.Compute(lcp, basis) || !point.accurate()) {
      collector.AddFace(IndicesOf(basis));
    } else if (point.solved()) {
      point.Write(lcp, y);
      PolishSolution(M, q, y);
      if (y.allFinite()) {
        collector.AddSolution(point.indices(), y);
      } else {
        collector.GiveUp();
      }
    } else if (point.IsDoubtful(lcp, basis)) {
      collector.GiveUpUnlessEmpty(IndicesOf(basis));
    }
  }
  return std::move(collector).Finish();
}

}  // namespace dlcs
