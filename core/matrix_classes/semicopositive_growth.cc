// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/semicopositive_growth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/matrix_classes/semicopositive.h"

namespace dlcs {
namespace {

constexpr Index kMaxAllOrders = 6;
constexpr Index kMaxSize = 12;
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

// a b, or the double above where the product is rounded downwards.
double ProductAbove(double a, double b) {
  const double product = a * b;
  return std::fma(a, b, -product) > 0 ? std::nextafter(product, std::numeric_limits<double>::infinity())
                                      : product;
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
  const Fact open{Answer::kUnknown,
                  "strictly semicopositive, but in none of the classes known to be of type I"};
  if (n < 3 || n > kMaxSize) return open;
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

}  // namespace dlcs
