// SPDX-License-Identifier: Apache-2.0
#include "tests/hostile/exact_classes_truth.h"

#include <algorithm>
#include <bit>

#include "tests/hostile/exact_lcp.h"

namespace dlcs::testing {
namespace {

using Row = std::vector<std::int64_t>;
using Rows = std::vector<Row>;

std::int64_t Product(const Row& a, const Row& b) {
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

Row TruncateUtf8(Row v) {
  std::int64_t divisor = 0;
  for (std::int64_t entry : v) {
    entry = std::abs(entry);
    while (entry != 0) std::swap(divisor %= entry, entry);
  }
  if (divisor > 1) {
    for (std::int64_t& entry : v) entry /= divisor;
  }
  return v;
}

Row Negative(Row v) {
  for (std::int64_t& entry : v) entry = -entry;
  return v;
}

bool IsZero(const Row& v) {
  return std::all_of(v.begin(), v.end(), [](std::int64_t entry) { return entry == 0; });
}

// The vector at right angles to d - 1 rows of d entries, by cofactors; zero if they depend on each other.
Row Normal(const Rows& rows, std::size_t dimension) {
  Row normal(dimension);
  const auto all = Members((1u << rows.size()) - 1u);
  for (std::size_t k = 0; k < dimension; ++k) {
    std::vector<Index> columns;
    for (std::size_t j = 0; j < dimension; ++j) {
      if (j != k) columns.push_back(static_cast<Index>(j));
    }
    normal[k] = (k % 2 == 0 ? 1 : -1) * static_cast<std::int64_t>(ExactDeterminant(rows, all, columns));
  }
  return TruncateUtf8(normal);
}

template <typename Visit>
void ForSubsetsOf(std::size_t size, std::size_t count, const Visit& visit) {
  for (unsigned set = 0; set < 1u << size; ++set) {
    if (static_cast<std::size_t>(std::popcount(set)) == count) visit(set);
  }
}

Rows Chosen(const Rows& rows, unsigned set) {
  Rows chosen;
  for (const Index i : Members(set)) chosen.push_back(rows[static_cast<std::size_t>(i)]);
  return chosen;
}

// Directions of { x : h x >= 0 } with d - 1 independent rows at zero: its extreme rays, and where it holds one line,
// that.
Rows Rays(const Rows& constraints, std::size_t dimension) {
  Rows rays;
  ForSubsetsOf(constraints.size(), dimension - 1, [&](unsigned set) {
    const Row normal = Normal(Chosen(constraints, set), dimension);
    if (IsZero(normal)) return;
    for (const Row& ray : {normal, Negative(normal)}) {
      const bool inside =
          std::all_of(constraints.begin(), constraints.end(), [&](const Row& h) { return Product(h, ray) >= 0; });
      if (inside && std::find(rays.begin(), rays.end(), ray) == rays.end()) rays.push_back(ray);
    }
  });
  return rays;
}

Row Sum(const Rows& rows, std::size_t dimension) {
  Row sum(dimension, 0);
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < dimension; ++i) sum[i] += row[i];
  }
  return sum;
}

// Some z >= 0 has W z > 0, W of any shape with k columns.
bool HasPositiveImage(const Rows& W, std::size_t k) {
  Rows constraints = W;
  for (std::size_t i = 0; i < k; ++i) {
    constraints.push_back(Row(k, 0));
    constraints.back()[i] = 1;
  }
  const Row z = Sum(Rays(constraints, k), k);
  return std::all_of(W.begin(), W.end(), [&](const Row& row) { return Product(row, z) > 0; });
}

bool IsFeasibleBeyondDoubt(const IntegerMatrix& M, const Row& q) {
  // q + M z > 0 for some z >= 0: some (t, z) >= 0 with t q + M z > 0.
  Rows W = M;
  for (std::size_t i = 0; i < W.size(); ++i) W[i].insert(W[i].begin(), q[i]);
  return HasPositiveImage(W, M.size() + 1);
}

// The normals of the facets of full complementary cones, pointing inwards, cone by cone.
std::vector<Rows> Cones(const IntegerMatrix& M) {
  const std::size_t n = M.size();
  std::vector<Rows> cones;
  for (unsigned S = 0; S < 1u << n; ++S) {
    Rows generators(n, Row(n, 0));
    for (std::size_t j = 0; j < n; ++j) {
      generators[j][j] = 1;
      for (std::size_t i = 0; i < n && (S >> j & 1u) != 0; ++i) generators[j][i] = -M[i][j];
    }
    Rows normals;
    for (std::size_t k = 0; k < n; ++k) {
      Rows others = generators;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
      const Row normal = Normal(others, n);
      const std::int64_t side = Product(normal, generators[k]);
      if (side != 0) normals.push_back(side > 0 ? normal : Negative(normal));
    }
    if (normals.size() == n) cones.push_back(normals);
  }
  return cones;
}

}  // namespace

bool IsExactlyS(const IntegerMatrix& M) { return HasPositiveImage(M, M.size()); }

bool IsExactlyR0(const IntegerMatrix& M) { return SolveExactly(M, IntegerVector(M.size(), 0)).bounded; }

QTruth ExactlyQAndQ0(const IntegerMatrix& M) {
  const std::size_t n = M.size();
  const std::vector<Rows> cones = Cones(M);
  Rows planes;
  for (const Rows& cone : cones) {
    for (const Row& normal : cone) {
      if (std::find(planes.begin(), planes.end(), normal) == planes.end() &&
          std::find(planes.begin(), planes.end(), Negative(normal)) == planes.end()) {
        planes.push_back(normal);
      }
    }
  }
  for (std::size_t i = 0; i < n; ++i) {  // so that every cell has n independent rays
    planes.push_back(Row(n, 0));
    planes.back()[i] = 1;
  }
  Rows rays;
  ForSubsetsOf(planes.size(), n - 1, [&](unsigned set) {
    const Row normal = Normal(Chosen(planes, set), n);
    if (IsZero(normal)) return;
    for (const Row& ray : {normal, Negative(normal)}) {
      if (std::find(rays.begin(), rays.end(), ray) == rays.end()) rays.push_back(ray);
    }
  });
  QTruth truth;
  std::vector<std::size_t> pick;  // increasing
  for (std::size_t k = 0; k < n; ++k) pick.push_back(k);
  Row q(n);
  while ((truth.q0 || truth.q) && rays.size() >= n) {
    for (std::size_t i = 0; i < n; ++i) {
      q[i] = 0;
      for (const std::size_t k : pick) q[i] += rays[k][i];
    }
    const bool inside = std::none_of(planes.begin(), planes.end(), [&](const Row& h) { return Product(h, q) == 0; });
    const bool solvable = !inside || std::any_of(cones.begin(), cones.end(), [&](const Rows& cone) {
      return std::all_of(cone.begin(), cone.end(), [&](const Row& h) { return Product(h, q) > 0; });
    });
    if (!solvable) {
      truth.q = false;
      if (truth.q0 && IsFeasibleBeyondDoubt(M, q)) truth.q0 = false;
    }
    std::size_t k = n;
    while (k > 0 && pick[k - 1] == rays.size() - n + k - 1) --k;
    if (k == 0) break;
    ++pick[k - 1];
    for (; k < n; ++k) pick[k] = pick[k - 1] + 1;
  }
  return truth;
}

bool IsExactlyHiddenZ(const IntegerMatrix& M) {
  const std::size_t n = M.size();
  std::vector<Rows> columns;
  for (std::size_t j = 0; j < n; ++j) {
    Rows constraints;
    for (std::size_t i = 0; i < n; ++i) {
      if (i == j) continue;
      constraints.push_back(Row(n, 0));
      constraints.back()[i] = -1;
      constraints.push_back(Negative(M[i]));
    }
    columns.emplace_back();
    for (const std::int64_t side : {1, -1}) {  // each half is in an orthant, and holds no line
      constraints.push_back(Row(n, 0));
      constraints.back()[j] = side;
      for (const Row& ray : Rays(constraints, n)) columns.back().push_back(ray);
      constraints.pop_back();
    }
    if (columns.back().empty()) return false;
  }
  std::vector<std::size_t> pick(n, 0);
  while (true) {
    Rows constraints(3 * n, Row(n, 0));  // λ, -X λ, -M X λ >= 0
    for (std::size_t j = 0; j < n; ++j) {
      const Row& x = columns[j][pick[j]];
      constraints[j][j] = 1;
      for (std::size_t i = 0; i < n; ++i) {
        constraints[n + i][j] = -x[i];
        constraints[2 * n + i][j] = -Product(M[i], x);
      }
    }
    if (Rays(constraints, n).empty()) return true;
    std::size_t k = 0;
    while (k < n && ++pick[k] == columns[k].size()) pick[k++] = 0;
    if (k == n) return false;
  }
}

}  // namespace dlcs::testing
