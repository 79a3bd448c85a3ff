// SPDX-License-Identifier: Apache-2.0
#include "core/problem/mass_matrix.h"

#include <functional>
#include <utility>
#include <variant>

#include "core/linalg/structured_matrix.h"
#include "core/problem/mass_factor.h"

namespace dlcs {
namespace {

using Columns = std::function<Matrix(const Matrix& columns)>;

// E⁻¹ `source`. Formulas stay as they are, behind a lift.
TimeFunction Mapped(const TimeFunction& source, Index size, const Columns& map) {
  if (source.is_lifted()) return {.pieces = source.pieces, .lift = map(source.lift.Dense())};
  TimeFunction mapped = source;
  for (TimeFunction::Piece& piece : mapped.pieces) {
    if (auto* constant = std::get_if<ConstantFunction>(&piece.function)) {
      constant->value = map(constant->value);
    } else if (auto* samples = std::get_if<SampledFunction>(&piece.function)) {
      samples->values = map(samples->values);
    } else if (auto* polynomial = std::get_if<PiecewisePolynomial>(&piece.function)) {
      for (Matrix& coefficients : polynomial->coefficients) coefficients = map(coefficients);
    } else {
      return {.pieces = source.pieces, .lift = map(Matrix::Identity(size, size))};
    }
  }
  return mapped;
}

// The system with row i divided by E_ii.
Problem DividedByDiagonal(const Problem& problem) {
  const SparseMatrix E = problem.E.Sparse();
  const Vector inverse = E.diagonal().cwiseInverse();
  const auto map = [&](const Matrix& columns) -> Matrix { return inverse.asDiagonal() * columns; };
  Problem divided = problem;
  divided.E = {};
  for (StructuredMatrix* matrix : {&divided.A, &divided.B}) {
    *matrix = matrix->is_dense() ? StructuredMatrix(map(matrix->Dense()))
                                 : StructuredMatrix(SparseMatrix(inverse.asDiagonal() * matrix->Sparse()));
  }
  const KroneckerSum* sum = problem.A.kronecker_sum();
  if (sum != nullptr && (inverse.array() == inverse[0]).all()) {
    KroneckerSum scaled = *sum;
    for (SparseMatrix& factor : scaled.factors) factor *= inverse[0];
    divided.A = std::move(scaled);
  }
  divided.f = Mapped(problem.f, inverse.size(), map);
  if (divided.f.is_lifted() && !(problem.f.is_lifted() && problem.f.lift.is_dense())) {
    divided.f.lift = divided.f.lift.Sparse();
  }
  return divided;
}

}  // namespace

Matrix SolveMass(const Problem& problem, const Matrix& columns) {
  if (!problem.has_mass()) return columns;
  return MassFactor(problem.E.Sparse()).Solve(columns);
}

Problem WithoutMass(const Problem& problem) {
  if (!problem.has_mass()) return problem;
  if (IsDiagonal(problem.E)) return DividedByDiagonal(problem);
  const MassFactor factor(problem.E.Sparse());
  const auto map = [&](const Matrix& columns) { return factor.Solve(columns); };
  Problem multiplied = problem;
  multiplied.E = {};
  multiplied.A = map(problem.A.Dense());
  multiplied.B = map(problem.B.Dense());
  multiplied.f = Mapped(problem.f, problem.num_states(), map);
  return multiplied;
}

}  // namespace dlcs
