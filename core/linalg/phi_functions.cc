// SPDX-License-Identifier: Apache-2.0

#include "core/linalg/phi_functions.h"

#include <algorithm>
#include <array>
#include <cmath>

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
  const auto cubic = [&](int k) -> Matrix {
    return c[k] * identity + c[k + 1] * Z + c[k + 2] * Z2 + c[k + 3] * Z3;
  };
  Matrix sum = cubic(12);
  for (int k = 8; k >= 0; k -= 4) sum = Product(Z4, sum) + cubic(k);
  return sum;
}

}  // namespace

PhiFunctions DoublePhiFunctions(const PhiFunctions& phi) {
  PhiFunctions doubled;
  doubled.phi2 = (Product(phi.phi1, phi.phi1) + 2 * phi.phi2) / 4;
  doubled.phi1 = (Product(phi.phi0, phi.phi1) + phi.phi1) / 2;
  doubled.phi0 = Product(phi.phi0, phi.phi0);
  return doubled;
}

PhiFunctions ComputePhiFunctions(const Matrix& Z) {
  const double norm = Z.size() ? Z.cwiseAbs().colwise().sum().maxCoeff() : 0;
  int doublings = 0;
  if (norm > 0.5 && std::isfinite(norm)) doublings = static_cast<int>(std::ceil(std::log2(norm / 0.5)));
  const Matrix scaled = std::ldexp(1.0, -doublings) * Z;
  const Matrix identity = Matrix::Identity(Z.rows(), Z.cols());

  PhiFunctions phi;
  phi.phi2 = TaylorPhi2(scaled);
  phi.phi1 = identity + Product(scaled, phi.phi2);
  phi.phi0 = identity + Product(scaled, phi.phi1);
  for (int k = 0; k < doublings; ++k) phi = DoublePhiFunctions(phi);
  return phi;
}

}  // namespace dlcs
