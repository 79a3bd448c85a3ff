// SPDX-License-Identifier: Apache-2.0
#include "tests/hostile/exact_lcp.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <optional>

namespace dlcs::testing {
namespace {

Integer Divisor(Integer a, Integer b) {
  while (b != 0) {
    const Integer rest = a % b;
    a = b;
    b = rest;
  }
  return a < 0 ? -a : a;
}

void Reduce(Fractions& y) {
  Integer divisor = y.denominator;
  for (const Integer entry : y.numerator) divisor = Divisor(divisor, entry);
  y.denominator /= divisor;
  for (Integer& entry : y.numerator) entry /= divisor;
}

// y with y_T = -M_RT⁻¹ q_R and zeros elsewhere, of any sign; absent if M_RT is singular.
std::optional<Fractions> PointOf(const IntegerMatrix& M, const IntegerVector& q, const std::vector<Index>& R,
                                 const std::vector<Index>& T) {
  Fractions y{std::vector<Integer>(q.size(), 0), ExactDeterminant(M, R, T)};
  if (y.denominator == 0) return std::nullopt;
  for (const Index k : T) {
    IntegerMatrix replaced = M;
    for (const Index i : R) replaced[i][k] = -q[i];
    y.numerator[k] = ExactDeterminant(replaced, R, T);
  }
  if (y.denominator < 0) {
    y.denominator = -y.denominator;
    for (Integer& entry : y.numerator) entry = -entry;
  }
  Reduce(y);
  return y;
}

// w times the denominator.
std::vector<Integer> ImageOf(const IntegerMatrix& M, const IntegerVector& q, const Fractions& y) {
  std::vector<Integer> w;
  for (std::size_t i = 0; i < q.size(); ++i) {
    w.push_back(q[i] * y.denominator);
    for (std::size_t j = 0; j < q.size(); ++j) w.back() += M[i][j] * y.numerator[j];
  }
  return w;
}

bool Solves(const IntegerMatrix& M, const IntegerVector& q, const Fractions& y) {
  const std::vector<Integer> w = ImageOf(M, q, y);
  for (std::size_t i = 0; i < q.size(); ++i) {
    if (y.numerator[i] < 0 || w[i] < 0 || (y.numerator[i] > 0 && w[i] > 0)) return false;
  }
  return true;
}

void AddOnce(const Fractions& y, std::vector<Fractions>& list) {
  if (std::find(list.begin(), list.end(), y) == list.end()) list.push_back(y);
}

// An extreme ray of { d >= 0, d = 0 beside S, (M d)_S = 0, M d >= 0 } with the support T: M_RT d = 0 for |T| - 1 rows.
bool IsRay(const IntegerMatrix& M, const std::vector<Index>& R, const std::vector<Index>& T, unsigned S) {
  std::vector<Integer> d(M.size(), 0);
  for (std::size_t k = 0; k < T.size(); ++k) {
    std::vector<Index> others = T;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
    d[T[k]] = (k % 2 == 0 ? 1 : -1) * ExactDeterminant(M, R, others);
  }
  if (d[T[0]] < 0) {
    for (Integer& entry : d) entry = -entry;
  }
  for (const Index k : T) {
    if (d[k] <= 0) return false;
  }
  for (std::size_t i = 0; i < M.size(); ++i) {
    Integer image = 0;
    for (const Index k : T) image += M[i][k] * d[k];
    if (image < 0 || ((S >> i & 1u) != 0 && image != 0)) return false;
  }
  return true;
}

// Whether the piece of S, whose solutions have y = 0 beside S and w_S = 0, has a ray.
bool PieceHasRay(const IntegerMatrix& M, unsigned S) {
  const unsigned all = 1u << M.size();
  for (unsigned T = 1; T < all; ++T) {
    if ((T & ~S) != 0) continue;
    for (unsigned R = 0; R < all; ++R) {
      if (std::popcount(R) + 1 == std::popcount(T) && IsRay(M, Members(R), Members(T), S)) return true;
    }
  }
  return false;
}

}  // namespace

ExactLcp SolveExactly(const IntegerMatrix& M, const IntegerVector& q) {
  const unsigned all = 1u << M.size();
  ExactLcp lcp;
  for (unsigned T = 0; T < all; ++T) {
    for (unsigned R = 0; R < all; ++R) {
      if (std::popcount(R) != std::popcount(T)) continue;
      const std::optional<Fractions> y = PointOf(M, q, Members(R), Members(T));
      if (!y || !Solves(M, q, *y)) continue;
      AddOnce(*y, lcp.vertices);
      if (R == T) AddOnce(*y, lcp.basic);
    }
  }
  for (unsigned S = 0; S < all && lcp.bounded; ++S) {
    const auto is_in_piece = [&](const Fractions& y) {
      const std::vector<Integer> w = ImageOf(M, q, y);
      for (std::size_t i = 0; i < q.size(); ++i) {
        if ((S >> i & 1u) != 0 ? w[i] != 0 : y.numerator[i] != 0) return false;
      }
      return true;
    };
    if (std::any_of(lcp.vertices.begin(), lcp.vertices.end(), is_in_piece)) lcp.bounded = !PieceHasRay(M, S);
  }
  return lcp;
}

std::vector<long double> LeastComponents(const ExactLcp& lcp) {
  std::vector<long double> least(lcp.vertices.front().numerator.size(), std::numeric_limits<long double>::infinity());
  for (const Fractions& y : lcp.vertices) {
    for (std::size_t i = 0; i < least.size(); ++i) least[i] = std::min(least[i], y[i]);
  }
  return least;
}

}  // namespace dlcs::testing
