// SPDX-License-Identifier: Apache-2.0

#include "core/linalg/phi_functions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/linalg/balance.h"
#include "core/linalg/panel_product.h"

namespace dlcs {
namespace {

constexpr int kDegree = 15;

// φ_2(Z) ≈ Σ_{k=0}^{15} Z^k / (k+2)!, as a cubic in Z⁴ whose coefficients are cubics in Z.
Matrix TaylorPhi2(const Matrix& Z) {
  std::array<double, kDegree + 1> c;
  double factorial = 2;
  for (int k = 0; k <= kDegree; ++k) {
    c[k] = 1 / factorial;
    factorial *= k + 3;
  }
  const Matrix identity = Matrix::Identity(Z.rows(), Z.cols());
  const Matrix Z2 = Product(Z, Z);
  const Matrix Z3 = Product(Z2, Z);
  const Matrix Z4 = Product(Z2, Z2);
  const auto cubic = [&](int k) -> Matrix { return c[k] * identity + c[k + 1] * Z + c[k + 2] * Z2 + c[k + 3] * Z3; };
  Matrix sum = cubic(12);
  for (int k = 8; k >= 0; k -= 4) sum = Product(Z4, sum) + cubic(k);
  return sum;
}

// φ_k at Z/2^doublings, on the way to those at Z. e^Z is kept as `rest` + diag(ones): near the identity the part that
// counts is e^Z - I, and where e^Z has decayed it is e^Z itself. Each doubling then errs by some ulp of |rest|², entry
// by entry in any units, where e^Z as a whole would lose one ulp of 1 each time, and twice that at the next.
struct Doubling {
  Matrix rest;
  Vector ones;  // 0 or 1
  Matrix phi1, phi2;

  explicit Doubling(const Matrix& Z) : ones(Vector::Ones(Z.rows())) {
    phi2 = TaylorPhi2(Z);
    phi1 = Matrix::Identity(Z.rows(), Z.cols()) + Product(Z, phi2);
    rest = Product(Z, phi1);
    TakeUpDecay();
  }

  // From φ_k(Z) to φ_k(2Z):  φ_0(2z) = φ_0²,  φ_1(2z) = (φ_0 + 1) φ_1 / 2,  φ_2(2z) = (φ_1² + 2 φ_2) / 4.
  void Double() {
    phi2 = (Product(phi1, phi1) + 2 * phi2) / 4;
    Matrix product = Product(rest, phi1);
    const Vector ones_and_one = ones.array() + 1;
    for (Index j = 0; j < ones.size(); ++j) {
      product.col(j) = (product.col(j) + ones_and_one.cwiseProduct(phi1.col(j))) / 2;
    }
    phi1.swap(product);
    product = Product(rest, rest);
    for (Index j = 0; j < ones.size(); ++j) {
      product.col(j).array() += (ones.array() + ones[j]) * rest.col(j).array();
    }
    rest.swap(product);
    TakeUpDecay();
  }

  // e^z - 1 has the digits of e^z down to a quarter.
  void TakeUpDecay() {
    for (Index i = 0; i < ones.size(); ++i) {
      if (ones[i] == 0 || !(rest(i, i) < -0.75)) continue;
      rest(i, i) += 1;
      ones[i] = 0;
    }
  }

  PhiFunctions Finish() const {
    PhiFunctions phi{rest, phi1, phi2};
    phi.phi0.diagonal() += ones;
    return phi;
  }
};

// How often Z is to be halved, and the states that depend on themselves alone, whose e^z is a scalar's.
struct Scaling {
  int halvings = 0;
  std::vector<Index> scalars;
};

double SumNorm(const Matrix& A) { return A.size() ? A.cwiseAbs().colwise().sum().maxCoeff() : 0; }

// Whether rows and columns are alike already, and every state depends on others, and they on it.
bool IsEven(const Matrix& A) {
  // Powers of two that balance them further save at most two doublings: with a factor of 4 here, at most four.
  constexpr double kAlike = 4;
  const Vector diagonal = A.diagonal().cwiseAbs();
  const Vector columns = A.cwiseAbs().colwise().sum().transpose() - diagonal;
  const Vector rows = A.cwiseAbs().rowwise().sum() - diagonal;
  return ((rows.array() > 0) && (rows.array() <= kAlike * columns.array()) &&
          (columns.array() <= kAlike * rows.array()))
      .all();
}

Scaling ChooseScaling(const Matrix& Z) {
  constexpr double kEnough = 0.5;
  // Balancing takes as long as some doublings, and here it could save four at most: where it begins to pay, a factor of
  // 4 is two doublings more or less.
  constexpr double kTame = 8;
  Scaling scaling;
  double norm = SumNorm(Z);
  if (norm > kTame && std::isfinite(norm) && !IsEven(Z)) {
    const BalancedMatrix balanced = Balance(Z);
    norm = SumNorm(balanced.matrix);
    for (Index b = 0; b < balanced.num_blocks(); ++b) {
      if (balanced.size_of_block(b) == 1) scaling.scalars.push_back(balanced.order[balanced.begins[b]]);
    }
  }
  if (norm > kEnough && std::isfinite(norm)) scaling.halvings = static_cast<int>(std::ceil(std::log2(norm / kEnough)));
  return scaling;
}

PhiFunctions Finish(const Doubling& doubling, const Scaling& scaling, const Matrix& Z, double part) {
  PhiFunctions phi = doubling.Finish();
  for (const Index i : scaling.scalars) phi.phi0(i, i) = std::exp(part * Z(i, i));
  return phi;
}

}  // namespace

PhiFunctions ComputePhiFunctions(const Matrix& Z) {
  const Scaling scaling = ChooseScaling(Z);
  Doubling doubling(std::ldexp(1.0, -scaling.halvings) * Z);
  for (int k = 0; k < scaling.halvings; ++k) doubling.Double();
  return Finish(doubling, scaling, Z, 1);
}

PhiFunctionsOfStep ComputePhiFunctionsOfStep(const Matrix& Z) {
  const Scaling scaling = ChooseScaling(Z);
  const int halvings = std::max(1, scaling.halvings);
  Doubling doubling(std::ldexp(1.0, -halvings) * Z);
  for (int k = 0; k + 1 < halvings; ++k) doubling.Double();
  PhiFunctionsOfStep phi;
  phi.half = Finish(doubling, scaling, Z, 0.5);
  doubling.Double();
  phi.whole = Finish(doubling, scaling, Z, 1);
  return phi;
}

}  // namespace dlcs
