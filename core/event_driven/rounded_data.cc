// SPDX-License-Identifier: Apache-2.0
#include "core/event_driven/rounded_data.h"

#include <cmath>
#include <limits>

#include "core/linalg/weyl_sequence.h"


namespace dlcs {
namespace {

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
    if (matrix.is_dense()) return Round(matrix.MutableDense());
    if (matrix.sparse() == nullptr) return;
    SparseMatrix sparse = *matrix.sparse();
    sparse.makeCompressed();
    Round(sparse);
    matrix = sparse;
  }
  // Raises diagonal entries only: semidefinite, copositive, P- and Z-matrices keep their class.
  void RaiseDiagonal(StructuredMatrix& matrix) const {
    if (matrix.is_dense()) {
      Matrix& dense = matrix.MutableDense();
      dense.diagonal() += change_ * dense.diagonal().cwiseAbs();
    } else if (matrix.sparse() != nullptr) {
      SparseMatrix sparse = *matrix.sparse();
      for (Index j = 0; j < sparse.outerSize(); ++j) {
        for (SparseMatrix::InnerIterator entry(sparse, j); entry; ++entry) {
          if (entry.row() == entry.col()) entry.valueRef() += change_ * std::abs(entry.value());
        }
      }
      matrix = sparse;
    }
  }
  void Round(TimeFunction& function, Index size) {
    if (function.is_lifted()) return Round(function.lift);
    SparseMatrix factors(size, size);
    factors.setIdentity();
    Round(factors);
    function.lift = factors;
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
  rounding.Round(rounded.f, rounded.num_states());
  rounding.Round(rounded.g, rounded.num_constraints());
  if (rounded.has_mass()) rounding.Round(rounded.E);
  return rounded;
}

}  // namespace dlcs
