// SPDX-License-Identifier: Apache-2.0
#include "core/lcp/nearest_point.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "core/lcp/complementary_solver.h"

namespace dlcs {
namespace {

// Entries of E v - e and of negative G v - g up to this part of what they are summed from count as zero.
constexpr double kRounding = 1e-11;

// Rows of `E` that span all of them, by elimination with row exchanges.
std::vector<Index> IndependentRows(const Matrix& E) {
  if (E.rows() == 0) return {};
  Eigen::ColPivHouseholderQR<Matrix> qr(E.transpose());
  qr.setThreshold(kRounding);
  const auto& order = qr.colsPermutation().indices();
  return std::vector<Index>(order.data(), order.data() + qr.rank());
}

// |rows| |v| + |bound|, what the rounding of rows v - bound is measured against.
Vector SizeOfRows(const Matrix& rows, const Vector& bound, const Vector& v) {
  return rows.cwiseAbs() * v.cwiseAbs() + bound.cwiseAbs();
}

bool Contains(const Polyhedron& polyhedron, const Vector& v) {
  const auto& [E, e, G, g] = polyhedron;
  const double least_size = std::max(e.lpNorm<Eigen::Infinity>(), g.lpNorm<Eigen::Infinity>());
  const Vector e_size = SizeOfRows(E, e, v).array() + least_size;
  const Vector g_size = SizeOfRows(G, g, v).array() + least_size;
  return ((E * v - e).cwiseAbs().array() <= kRounding * e_size.array()).all() &&
         ((G * v - g).array() >= -kRounding * g_size.array()).all();
}

struct Minimum {
  LcpVerdict verdict = LcpVerdict::kPivotLimit;
  Vector v;
};

// One quadratic program.
Minimum Minimise(const Polyhedron& polyhedron, const Selector& selector) {
  const auto& [E, e, G, g] = polyhedron;
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
  Vector tolerance = Vector::Zero(size);
  tolerance.tail(A.rows()).setConstant(1e-13 * a.lpNorm<Eigen::Infinity>());

  ComplementarySolver solver(kkt, ComplementarySolver::Known::kNothing);
  Basis basis(size, 0);
  Vector solution(size);
  const LcpVerdict verdict = solver.Solve(rhs, tolerance, basis, solution);
  const bool solved = verdict == LcpVerdict::kSolved;
  if (solved && !Contains(polyhedron, solution.head(n))) return {};
  return {verdict, solution.head(n)};
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
  return {.E = M(S, S), .e = -q(S), .G = M(rest, S), .g = -q(rest)};
}

Polyhedron ConvexSolutionSet(const Matrix& M, const Vector& q, const Vector& solution) {
  const Index n = M.rows();
  Matrix E(n + 1, n);
  E.topRows(n) = M + M.transpose();
  E.row(n) = q.transpose();
  return {.E = E, .e = E * solution, .G = M, .g = (-q).cwiseMin(M * solution)};
}

bool HasOtherPoint(const Polyhedron& polyhedron, const Vector& v) {
  constexpr double kGoldenRatio = 0.6180339887498949;
  Vector direction(v.size());
  for (Index i = 0; i < v.size(); ++i)
    direction[i] = 1 + std::fmod(kGoldenRatio * static_cast<double>(i + 1), 1.0);
  const double far = std::max(1.0, 2 * v.lpNorm<Eigen::Infinity>());
  for (const double shift : {far, -far}) {
    const Minimum other =
        Minimise(polyhedron, {direction.transpose(), Vector::Constant(1, direction.dot(v) + shift)});
    if (other.verdict != LcpVerdict::kSolved) continue;
    if ((other.v - v).lpNorm<Eigen::Infinity>() > 1e-8 * far) return true;
  }
  return false;
}

NearestPoint FindNearestPoint(const Polyhedron& polyhedron, const Selector& selector) {
  const Index n = selector.C.cols();
  NearestPoint nearest;
  const Minimum first = Minimise(polyhedron, selector);
  if (first.verdict == LcpVerdict::kInfeasible) nearest.answer = Feasibility::kInfeasible;
  if (first.verdict != LcpVerdict::kSolved) return nearest;
  nearest.answer = Feasibility::kFeasible;
  nearest.v = first.v;
  nearest.distance = (selector.C * first.v - selector.b).norm();

  // All minimisers have the same C v. Where that does not fix v: the least in norm among them.
  Polyhedron minimisers = polyhedron;
  const Index rows = polyhedron.E.rows();
  minimisers.E.conservativeResize(rows + selector.C.rows(), n);
  minimisers.E.bottomRows(selector.C.rows()) = selector.C;
  minimisers.e.conservativeResize(minimisers.E.rows());
  minimisers.e.tail(selector.C.rows()) = selector.C * first.v;
  if (static_cast<Index>(IndependentRows(minimisers.E).size()) == n) return nearest;
  const Minimum least = Minimise(minimisers, {Matrix::Identity(n, n), Vector::Zero(n)});
  if (least.verdict == LcpVerdict::kSolved) nearest.v = least.v;
  nearest.unique = !HasOtherPoint(minimisers, nearest.v);
  return nearest;
}

}  // namespace dlcs
