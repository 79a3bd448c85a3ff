// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/semicopositive_types.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/linalg/linear_program.h"
#include "core/matrix_classes/s_matrix.h"
#include "core/matrix_classes/semicopositive.h"

namespace dlcs {

namespace {

constexpr Index kMaxAllOrders = 6;
constexpr Index kMaxTypeThreeSize = 12;
constexpr int kRandomOrders = 100;
constexpr double kFactors[] = {1.25, 1.5, 2, 3, 4, 6, 10};

using Order = std::vector<Index>;

// Orders that start with 0: the others are rotations.
std::vector<Order> Orders(Index n) {
  Order order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), Index{0});
  std::vector<Order> orders;
  if (n <= kMaxAllOrders) {
    do orders.push_back(order);
    while (std::next_permutation(order.begin() + 1, order.end()));
    return orders;
  }
  std::mt19937_64 generator(2007);  // fixed: the answer must not change from call to call
  for (int k = 0; k < kRandomOrders; ++k) {
    orders.push_back(order);
    std::shuffle(order.begin() + 1, order.end(), generator);
  }
  return orders;
}

// Returns a b, or the next larger double if the product was rounded down.
double ProductAbove(double a, double b) {
  const double product = a * b;
  return std::fma(a, b, -product) > 0 ? std::nextafter(product, std::numeric_limits<double>::infinity()) : product;
}

// ½ (λ + 1) D + λ L + U, rounded upwards; `place[i]` is when z_i grows.
Matrix RoundMatrix(const Matrix& M, const Vector& place, double factor) {
  return Matrix::NullaryExpr(M.rows(), M.cols(), [&](Index i, Index j) {
    if (i == j) return ProductAbove(0.5 * (factor + 1), M(i, i));
    return place[j] < place[i] ? ProductAbove(factor, M(i, j)) : M(i, j);
  });
}

}  // namespace

Fact RefuteTypeThree(const Matrix& M) {
  const Index n = M.rows();
  const Fact open{Answer::kUnknown, "strictly semicopositive, but in none of the classes known to be of type I"};
  if (n < 3 || n > kMaxTypeThreeSize) return open;
  for (const Order& order : Orders(n)) {
    Vector place(n);
    for (Index k = 0; k < n; ++k) place[order[static_cast<std::size_t>(k)]] = static_cast<double>(k);
    for (const double factor : kFactors) {
      Fact no = TestStrictlySemicopositive(RoundMatrix(M, place, factor));
      if (!no.no()) continue;
      no.why = absl::StrCat("entries that grow by ", factor, " one after the other, in the order {",
                            absl::StrJoin(order, ", "), "}, round after round, have no positive integral");
      no.witness.value = factor;
      no.witness.r = place(no.witness.indices);
      return no;
    }
  }
  return open;
}

namespace {

struct Weights {
  Vector f;
  std::string why;  // what K > 0 for this f shows
};

// Returns a b, or the next smaller double if the product was rounded up.
double ProductBelow(double a, double b) {
  const double product = a * b;
  return std::fma(a, b, -product) < 0 ? std::nextafter(product, -std::numeric_limits<double>::infinity()) : product;
}

// f with f_i m_ij = f_j m_ji but for errors of programs, which decides in the end; empty where there is none. Walks
// along the nonzero entries.
Vector SymmetrizingWeights(const Matrix& M) {
  const Index n = M.rows();
  Vector f = Vector::Zero(n);
  std::vector<Index> reached;
  for (Index root = 0; root < n; ++root) {
    if (f[root] > 0) continue;
    f[root] = 1;
    reached.assign(1, root);
    while (!reached.empty()) {
      const Index i = reached.back();
      reached.pop_back();
      for (Index j = 0; j < n; ++j) {
        if (j == i || (M(i, j) == 0 && M(j, i) == 0)) continue;
        if (!(M(i, j) / M(j, i) > 0)) return {};
        const double weight = f[i] * (M(i, j) / M(j, i));
        if (!std::isfinite(weight)) return {};
        if (f[j] > 0 && !(std::abs(f[j] - weight) <= kProgramTolerance * weight)) return {};
        if (f[j] > 0) continue;
        f[j] = weight;
        reached.push_back(j);
      }
    }
  }
  return f;
}

std::vector<Weights> CandidateWeights(const Matrix& M) {
  std::vector<Weights> candidates = {
      {Vector::Ones(M.rows()), M == M.transpose() ? "symmetric and strictly copositive: Proposition 3 (b)"
                                                  : "min(m_ij, m_ji) makes a strictly copositive matrix"}};
  if (Vector f = SymmetrizingWeights(M); f.size() > 0 && M != M.transpose()) {
    candidates.push_back({std::move(f), "symmetric after scaling rows, and strictly copositive: DME of Proposition 3"});
  }
  for (const double share : {0.5, 1.0}) {
    Matrix below = ZMatrixBelow(M);
    below.diagonal() *= share;
    const Vector x = PositiveImageOfMMatrix(below), y = PositiveImageOfMMatrix(below.transpose());
    if (x.size() == 0 || y.size() == 0) continue;
    candidates.push_back(
        {y.cwiseQuotient(x), "min(f_i m_ij, f_j m_ji) makes a strictly copositive matrix for some f > 0"});
  }
  return candidates;
}

}  // namespace

Matrix TypeIComparison(const Matrix& M, const Vector& f) {
  return Matrix::NullaryExpr(M.rows(), M.cols(), [&](Index i, Index j) {
    return std::min(ProductBelow(f[i], M(i, j)), ProductBelow(f[j], M(j, i)));
  });
}

Fact TestSemicopositiveTypeI(const Matrix& M, const Fact& strict) {
  if (strict.no()) return strict;
  const Vector ones = Vector::Ones(M.rows());
  if (M.minCoeff() >= 0 && strict.yes()) {
    Fact fact{Answer::kYes, "nonnegative with positive diagonal: Proposition 3 (a)"};
    fact.witness.z = ones;
    return fact;
  }
  for (auto& [f, why] : CandidateWeights(M)) {
    if (!TestStrictlySemicopositive(TypeIComparison(M, f)).yes()) continue;
    Fact fact{Answer::kYes, std::move(why)};
    fact.witness.z = std::move(f);
    return fact;
  }
  if (!strict.yes()) return strict;
  if (M.rows() <= 2 && strict.yes()) {
    return {Answer::kYes, absl::StrCat("Proposition 4 (n <= 2), and strictly semicopositive: ", strict.why)};
  }
  return RefuteTypeThree(M);
}

Fact TestSemicopositiveTypeI(const Matrix& M) { return TestSemicopositiveTypeI(M, TestStrictlySemicopositive(M)); }

}  // namespace dlcs
