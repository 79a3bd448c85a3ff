// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/dense/nearest_point.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/lcp/basis/tolerance.h"
#include "core/lcp/dense/complementary_solver.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/decompositions.h"
#include "core/linalg/equilibration.h"
#include "core/linalg/weyl_sequence.h"

namespace dlcs {
namespace {

// Rows of `E` that span all of them, by elimination with row exchanges, in units in which its entries are of size one.
std::vector<Index> IndependentRows(const Matrix& E) {
  if (E.rows() == 0) return {};
  Eigen::ColPivHouseholderQR<Matrix> qr(Scaled(E, EquilibrateRowsAndColumns(E)).transpose());
  qr.setThreshold(kWorkingPrecision);
  const auto& order = qr.colsPermutation().indices();
  return std::vector<Index>(order.data(), order.data() + qr.rank());
}

// The units of a polyhedron in which the entries of E and G are of size one, and what its bounds are in them.
struct Units {
  explicit Units(const Polyhedron& polyhedron) {
    Matrix all(polyhedron.E.rows() + polyhedron.G.rows(), std::max(polyhedron.E.cols(), polyhedron.G.cols()));
    if (polyhedron.E.rows() > 0) all.topRows(polyhedron.E.rows()) = polyhedron.E;
    if (polyhedron.G.rows() > 0) all.bottomRows(polyhedron.G.rows()) = polyhedron.G;
    scale = EquilibrateRowsAndColumns(all);
    for (Index i = 0; i < polyhedron.e.size(); ++i) bound = std::max(bound, of_E(i) * std::abs(polyhedron.e[i]));
    for (Index i = 0; i < polyhedron.g.size(); ++i)
      bound = std::max(bound, scale.row[polyhedron.e.size() + i] * std::abs(polyhedron.g[i]));
  }
  double of_E(Index i) const { return scale.row[i]; }

  Equilibration scale;
  double bound = 0;
};

// Whether v satisfies all equations. The quadratic program checks the inequalities, but it leaves out equations that
// depend on others.
bool Contains(const Polyhedron& polyhedron, const Vector& v) {
  const Matrix& E = polyhedron.E;
  const Units units(polyhedron);
  const Vector miss = E * v - polyhedron.e;
  const Vector size = E.cwiseAbs() * v.cwiseAbs() + polyhedron.e_size;
  for (Index i = 0; i < miss.size(); ++i) {
    if (!(std::abs(miss[i]) <= kWorkingPrecision * (size[i] + units.bound / units.of_E(i)))) return false;
  }
  return true;
}

// Whether a combination of the rows of E is zero to rounding and that of e clearly is not: no v satisfies them.
bool EquationsContradict(const Polyhedron& polyhedron) {
  const Matrix& E = polyhedron.E;
  const std::vector<Index> rows = IndependentRows(E);
  if (static_cast<Index>(rows.size()) == E.rows()) return false;
  const Matrix independent = E(rows, Eigen::all);
  const Vector e = polyhedron.e(rows);
  Matrix factors_of_rows = Matrix::Zero(e.size(), E.rows());
  if (!rows.empty()) factors_of_rows = independent.transpose().colPivHouseholderQr().solve(E.transpose());
  for (Index i = 0; i < E.rows(); ++i) {
    const auto factors = factors_of_rows.col(i);
    const Vector rest = E.row(i).transpose() - independent.transpose() * factors;
    const Vector terms = E.row(i).cwiseAbs().transpose() + independent.cwiseAbs().transpose() * factors.cwiseAbs();
    const double size = polyhedron.e_size[i] + factors.cwiseAbs().dot(e.cwiseAbs());
    const bool is_zero = (rest.array().abs() <= RoundingOf(128) * terms.array()).all();
    if (is_zero && std::abs(polyhedron.e[i] - factors.dot(e)) > kClearDifference * size) return true;
  }
  return false;
}

struct Minimum {
  LcpStatus verdict = LcpStatus::kPivotLimit;
  Vector v;
};

// One quadratic program.
Minimum Minimize(const Polyhedron& polyhedron, const Selector& selector) {
  const auto& [E, e, e_size, G, g, g_size] = polyhedron;
  const std::vector<Index> rows = IndependentRows(E);
  const Index n = selector.C.cols();
  const Index r = static_cast<Index>(rows.size());
  Matrix A(2 * r + G.rows(), n);
  Vector a(A.rows());
  A.topRows(r) = E(rows, Eigen::all);
  A.middleRows(r, r) = -E(rows, Eigen::all);
  A.bottomRows(G.rows()) = G;
  a.head(r) = e(rows);
  a.segment(r, r) = -e(rows);
  a.tail(g.size()) = g;

  const Index size = n + A.rows();
  Matrix kkt = Matrix::Zero(size, size);
  kkt.topLeftCorner(n, n) = selector.C.transpose() * selector.C;
  kkt.topRightCorner(n, A.rows()) = -A.transpose();
  kkt.bottomLeftCorner(A.rows(), n) = A;
  Vector rhs(size);
  rhs.head(n) = -selector.C.transpose() * selector.b;
  rhs.tail(A.rows()) = -a;

  ComplementarySolver solver(kkt, ComplementarySolver::Known::kNothing);
  // The bounds come from somebody's arithmetic. Where a basis is nearly singular their rounding is blown up.
  Vector solution(size), tolerance = Vector::Zero(size);
  Minimum minimum;
  for (const double rounding : {kLcpTolerance, kWorkingPrecision}) {
    tolerance.tail(A.rows()) << rounding * e_size(rows), rounding * e_size(rows), rounding * g_size;
    Basis basis(static_cast<std::size_t>(size), 0);
    minimum.verdict = solver.Solve(rhs, tolerance, basis, solution);
    minimum.v = solution.head(n);
    if (minimum.verdict == LcpStatus::kInfeasible) return minimum;
    if (minimum.verdict == LcpStatus::kSolved && Contains(polyhedron, minimum.v)) return minimum;
  }
  return {};
}

}  // namespace

Polyhedron SolutionFaceOf(const Matrix& M, const Vector& q, const std::vector<Index>& S) {
  std::vector<Index> rest;
  for (Index i = 0, p = 0; i < q.size(); ++i) {
    if (p < static_cast<Index>(S.size()) && S[p] == i) {
      ++p;
    } else {
      rest.push_back(i);
    }
  }
  return {.E = M(S, S),
          .e = -q(S),
          .e_size = q(S).cwiseAbs(),
          .G = M(rest, S),
          .g = -q(rest),
          .g_size = q(rest).cwiseAbs()};
}

Polyhedron ConvexSolutionSet(const Matrix& M, const Vector& q, const Vector& solution) {
  const Index n = M.rows();
  Matrix E(n + 1, n);
  E.topRows(n) = M + M.transpose();
  E.row(n) = q.transpose();
  return {.E = E,
          .e = E * solution,
          .e_size = E.cwiseAbs() * solution.cwiseAbs(),
          .G = M,
          .g = (-q).cwiseMin(M * solution),
          .g_size = q.cwiseAbs() + M.cwiseAbs() * solution.cwiseAbs()};
}

bool HasOtherPoint(const Polyhedron& polyhedron, const Vector& v) {
  const Units units(polyhedron);
  const Vector inverse = units.scale.column.cwiseInverse();
  Vector direction(v.size());
  for (Index i = 0; i < v.size(); ++i) direction[i] = inverse[i] * (1 + WeylValue(static_cast<double>(i + 1)));
  const double largest = std::max(units.bound, 2 * v.cwiseProduct(inverse).lpNorm<Eigen::Infinity>());
  const double far = largest > 0 ? largest : 1;
  for (const double shift : {far, -far}) {
    const Minimum other = Minimize(polyhedron, {direction.transpose(), Vector::Constant(1, direction.dot(v) + shift)});
    if (other.verdict != LcpStatus::kSolved) continue;
    if ((other.v - v).cwiseProduct(inverse).lpNorm<Eigen::Infinity>() > 1e-8 * far) return true;
  }
  return false;
}

NearestPoint FindNearestPoint(const Polyhedron& polyhedron, const Selector& selector) {
  const Index n = selector.C.cols();
  NearestPoint nearest;
  const Minimum first = Minimize(polyhedron, selector);
  if (first.verdict != LcpStatus::kSolved) {
    const bool infeasible = first.verdict == LcpStatus::kInfeasible || EquationsContradict(polyhedron);
    if (infeasible) nearest.answer = Feasibility::kInfeasible;
    return nearest;
  }
  nearest.answer = Feasibility::kFeasible;
  nearest.v = first.v;
  nearest.distance = (selector.C * first.v - selector.b).norm();

  // All minimizers have the same C v. Where that does not fix v: the least in norm among them.
  Polyhedron minimizers = polyhedron;
  const Index rows = polyhedron.E.rows();
  minimizers.E.conservativeResize(rows + selector.C.rows(), n);
  minimizers.E.bottomRows(selector.C.rows()) = selector.C;
  minimizers.e.conservativeResize(minimizers.E.rows());
  minimizers.e.tail(selector.C.rows()) = selector.C * first.v;
  minimizers.e_size.conservativeResize(minimizers.E.rows());
  minimizers.e_size.tail(selector.C.rows()) = selector.C.cwiseAbs() * first.v;
  if (static_cast<Index>(IndependentRows(minimizers.E).size()) == n) return nearest;
  const Minimum least = Minimize(minimizers, {Matrix::Identity(n, n), Vector::Zero(n)});
  if (least.verdict == LcpStatus::kSolved) nearest.v = least.v;
  nearest.unique = !HasOtherPoint(minimizers, nearest.v);
  return nearest;
}

}  // namespace dlcs
