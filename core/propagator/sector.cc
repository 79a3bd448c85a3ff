// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/sector.h"

#include <Eigen/SparseCholesky>
#include <cmath>
#include <complex>
#include <limits>

#include "core/format_number.h"
#include "core/laplace/range_contour.h"
#include "core/linalg/sparse/sparse_factor.h"

namespace dlcs {
namespace {

// The ratio of times and the accuracy for which nodes are counted. They serve only to rank sectors.
constexpr double kRatio = 1000;
constexpr double kAccuracy = 40;

class SectorProof {
 public:
  SectorProof(const SparseMatrix& A, const SparseMatrix& E) {
    const SparseMatrix transposed = A.transpose();
    const auto order = SparseOrder(A, E);
    symmetric_ = SparseMatrix((A + transposed) / 2).twistedBy(order);
    skew_ = SparseMatrix((A - transposed) / 2).twistedBy(order);
    skew_.prune(0.0);
    if (E.rows() > 0) {
      mass_ = E.twistedBy(order);
      has_inner_product_ = IsSymmetric(E) && IsPositive<double>(mass_);
    } else {
      mass_.resize(A.rows(), A.rows());
      mass_.setIdentity();
    }
  }

  // Whether E is symmetric positive definite.
  bool has_inner_product() const { return has_inner_product_; }

  bool is_symmetric() const { return skew_.nonZeros() == 0; }
  double factor_nonzeros() const { return factor_nonzeros_; }

  bool Holds(double angle, double shift) {
    if (is_symmetric()) return IsPositive<double>(shift * mass_ - symmetric_);
    using Complex = std::complex<double>;
    return IsPositive<Complex>((shift * mass_ - symmetric_).cast<Complex>() +
                               Complex(0, 1 / std::tan(angle)) * skew_.cast<Complex>());
  }

 private:
  template <typename Scalar>
  bool IsPositive(const Eigen::SparseMatrix<Scalar>& matrix) {
    const Eigen::SimplicialLLT<Eigen::SparseMatrix<Scalar>, Eigen::Lower, Eigen::NaturalOrdering<int>> factor(matrix);
    if (factor.info() != Eigen::Success) return false;
    factor_nonzeros_ = static_cast<double>(factor.matrixL().nestedExpression().nonZeros());
    return true;
  }

  SparseMatrix symmetric_, skew_, mass_;
  bool has_inner_product_ = true;
  double factor_nonzeros_ = 0;
};

// Returns the narrowest angle with this shift, to 0.05, or nothing if it is beyond the widest.
std::optional<double> NarrowestAngle(const std::function<bool(double, double)>& holds, bool is_symmetric,
                                     double shift) {
  constexpr double kStep = 0.05;
  constexpr int kWidest = 27;
  if (!holds(kWidest * kStep, shift)) return std::nullopt;
  if (is_symmetric) return 0;
  int low = 0, high = kWidest;  // fails, holds
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    (holds(middle * kStep, shift) ? high : low) = middle;
  }
  return high * kStep;
}

}  // namespace

std::optional<Sector> FindSector(const SparseMatrix& A, double horizon, const SparseMatrix& E) {
  SectorProof proof(A, E);
  if (!proof.has_inner_product()) return std::nullopt;
  const auto holds = [&proof](double angle, double shift) { return proof.Holds(angle, shift); };
  auto sector = FindSector(holds, proof.is_symmetric(), horizon);
  if (sector) sector->factor_nonzeros = proof.factor_nonzeros();
  return sector;
}

std::optional<Sector> FindSector(const std::function<bool(double angle, double shift)>& holds, bool is_symmetric,
                                 double horizon) {
  constexpr double kShifts[] = {0, 0.5, 1.5, 3};  // over the horizon each costs a factor of e^σ in rounding
  constexpr Index kFewNodes = 160;                // not worth a search for less
  std::optional<Sector> best;
  Index fewest = std::numeric_limits<Index>::max();
  for (const double growth : kShifts) {
    const double shift = growth / horizon;
    const auto angle = NarrowestAngle(holds, is_symmetric, shift);
    if (!angle) continue;
    const auto contour = FindSectorContour(horizon / kRatio, horizon, kAccuracy, *angle, shift);
    if (!contour || contour->hyperbola.nodes >= fewest) continue;
    fewest = contour->hyperbola.nodes;
    best = Sector{.angle = *angle, .shift = shift};
    if (fewest <= kFewNodes) break;
  }
  return best;
}

std::string WhyNoSector(bool has_mass, double horizon) {
  const std::string of = has_mass ? "the pencil (A, E), whose E must be symmetric positive definite," : "A";
  return "no sector holds the field of values of " + of +
         " that is narrow enough for a contour up to T = " + FormatNumber(horizon) +
         ": solutions grow too much, or oscillate too fast for their decay";
}

}  // namespace dlcs
