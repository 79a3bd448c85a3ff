// SPDX-License-Identifier: Apache-2.0
#include "core/event_driven/rounded_data.h"

#include <cmath>
#include <limits>

#include "core/linalg/weyl_sequence.h"

namespace dlcs {
namespace {

// Calls `change` with the entries of a matrix, a Matrix or a SparseMatrix.
template <typename Change>
void ChangeEntries(StructuredMatrix& matrix, const Change& change) {
  if (matrix.is_dense()) return change(matrix.MutableDense());
  if (matrix.sparse() == nullptr) return;
  SparseMatrix sparse = *matrix.sparse();
  sparse.makeCompressed();
  change(sparse);
  matrix = sparse;
}

// The factors of the components of `function`, which may be changed then.
StructuredMatrix& LiftOf(TimeFunction& function, Index size) {
  if (!function.is_lifted()) {
    SparseMatrix factors(size, size);
    factors.setIdentity();
    function.lift = factors;
  }
  return function.lift;
}

// Of one number after the other.
class Rounding {
 public:
  Rounding(double ulps, unsigned seed) : change_(ulps * std::numeric_limits<double>::epsilon()), seed_(seed) {}

  Vector Factors(Index size) {
    ++seed_;
    return (1 + change_ * SignsOfRounding(size, seed_).array()).matrix();
  }
  void Round(Matrix& matrix) { matrix.reshaped().array() *= Factors(matrix.size()).array(); }
  void Round(SparseMatrix& matrix) { matrix.coeffs() *= Factors(matrix.nonZeros()).array(); }
  void Round(StructuredMatrix& matrix) {
    ChangeEntries(matrix, [this](auto& entries) { Round(entries); });
  }
  // Raises diagonal entries only: semidefinite, copositive, P- and Z-matrices keep their class.
  void RaiseDiagonal(Matrix& matrix) const { matrix.diagonal() += change_ * matrix.diagonal().cwiseAbs(); }
  void RaiseDiagonal(SparseMatrix& matrix) const {
    for (Index j = 0; j < matrix.outerSize(); ++j) {
      for (SparseMatrix::InnerIterator entry(matrix, j); entry; ++entry) {
        if (entry.row() == entry.col()) entry.valueRef() += change_ * std::abs(entry.value());
      }
    }
  }
  void RaiseDiagonal(StructuredMatrix& matrix) const {
    ChangeEntries(matrix, [this](auto& entries) { RaiseDiagonal(entries); });
  }

 private:
  double change_;
  unsigned seed_;
};

}  // namespace

Problem WithRoundedData(const Problem& problem, double ulps, bool changes_M, unsigned seed) {
  constexpr unsigned kMatrices = 16;  // more than are rounded
  Rounding rounding(ulps, kMatrices * seed);
  Problem rounded = problem;
  rounding.Round(rounded.A);
  rounding.Round(rounded.B);
  rounding.Round(rounded.N);
  if (changes_M) {
    rounding.Round(rounded.M);
  } else {
    rounding.RaiseDiagonal(rounded.M);
  }
  rounded.x0.array() *= rounding.Factors(rounded.x0.size()).array();
  rounding.Round(LiftOf(rounded.f, rounded.num_states()));
  rounding.Round(LiftOf(rounded.g, rounded.num_constraints()));
  if (rounded.has_mass()) rounding.Round(rounded.E);
  return rounded;
}

Problem WithFasterRates(const Problem& problem, double ulps) {
  const double factor = 1 + ulps * std::numeric_limits<double>::epsilon();
  Problem faster = problem;
  for (StructuredMatrix* matrix : {&faster.A, &faster.B, &LiftOf(faster.f, problem.num_states())}) {
    ChangeEntries(*matrix, [factor](auto& entries) { entries *= factor; });
  }
  return faster;
}

}  // namespace dlcs
